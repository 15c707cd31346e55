//! W2: one closed-chain run of 20 s at 0.25 ms. W3: a batch of runs of 2 s. Times are per step.

use std::hint::black_box;

use arm_sim::{Experiment, Integrator, sample_experiments, simulate, simulate_batch};
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

criterion_group!(benches, single, batch);
criterion_main!(benches);
