//! W2: one closed-chain run of 20 s at 0.25 ms. W3: a batch of runs of 2 s. Both also with dry friction in each joint. Times are per step.

use std::hint::black_box;

use arm_core::effect::{Effect, Kind};
use arm_sim::{Columns, Experiment, Integrator, sample_experiments, simulate, simulate_batch};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn w2(integrator: Integrator, output_interval: Option<f64>) -> Experiment<3> {
    let mut experiment =
        sample_experiments::human_experiment(20.0, [0.0; 3]).expect("a sample experiment");
    experiment.integrator = integrator;
    experiment.output_interval = output_interval;
    experiment
}

fn single(c: &mut Criterion) {
    let mut group = c.benchmark_group("w2");
    group
        .throughput(Throughput::Elements(80_000))
        .sample_size(20);
    let integrators = [
        ("euler", Integrator::SemiImplicitEuler),
        ("rk4", Integrator::Rk4),
    ];
    for (name, integrator) in integrators {
        for (record, interval) in [("ends", Some(20.0)), ("50hz", Some(0.02)), ("every", None)] {
            let experiment = w2(integrator, interval);
            group.bench_function(format!("{name}/{record}"), |b| {
                b.iter(|| simulate(black_box(&experiment)).expect("runs"));
            });
        }
    }
    group.finish();
}

/// 1000 runs with masses, viscosities and stiffnesses that differ, recorded at 50 Hz.
fn w3(integrator: Integrator) -> Vec<Experiment<3>> {
    let base = sample_experiments::human_experiment(2.0, [0.0; 3]).expect("a sample experiment");
    (0..1000)
        .map(|i| {
            let scale = 1.0 + 1e-4 * f64::from(i);
            let mut run = base.clone();
            run.integrator = integrator;
            run.output_interval = Some(0.02);
            for segment in &mut run.setup.segments {
                segment.mass *= scale;
            }
            for effect in &mut run.effects {
                effect.parameters[0] *= scale;
            }
            run
        })
        .collect()
}

fn batch(c: &mut Criterion) {
    let mut group = c.benchmark_group("w3");
    group
        .throughput(Throughput::Elements(8_000_000))
        .sample_size(10);
    let integrators = [
        ("euler", Integrator::SemiImplicitEuler),
        ("rk4", Integrator::Rk4),
    ];
    for (name, integrator) in integrators {
        let experiments = w3(integrator);
        for threads in [1, 2] {
            group.bench_function(format!("{name}/{threads}"), |b| {
                b.iter(|| simulate_batch(black_box(&experiments), threads));
            });
        }
    }
    group.finish();
}

/// One run of 20 s, and 100 of them with masses that differ; friction is set-valued (`smoothing` 0) or smooth (0.01 rad/s).
fn dry_friction(c: &mut Criterion) {
    let mut group = c.benchmark_group("dry_friction");
    group.sample_size(10);
    for (name, smoothing) in [("set-valued", 0.0), ("smooth", 0.01)] {
        let run = |i: u32| {
            let mut run = w2(Integrator::Rk4, Some(0.02));
            run.columns = Columns::Motion;
            for segment in &mut run.setup.segments {
                segment.mass *= 1.0 + 1e-3 * f64::from(i);
            }
            let coulomb = |j| Effect::new(Kind::Coulomb, j).with(&[0.1, smoothing]);
            run.effects.extend((0..3).map(coulomb));
            run
        };
        group.throughput(Throughput::Elements(80_000));
        let alone = run(0);
        group.bench_function(format!("{name}/single"), |b| {
            b.iter(|| simulate(black_box(&alone)).expect("runs"));
        });
        let experiments: Vec<_> = (0..100).map(run).collect();
        group.throughput(Throughput::Elements(8_000_000));
        group.bench_function(format!("{name}/batch"), |b| {
            b.iter(|| simulate_batch(black_box(&experiments), 1));
        });
    }
    group.finish();
}

criterion_group!(benches, single, batch, dry_friction);
criterion_main!(benches);
