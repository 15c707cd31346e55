//! W2: one closed-chain run of 20 s at 0.25 ms. W3: a batch of runs of 2 s. Times are per step.

use std::hint::black_box;

use arm_sim::{Experiment, Integrator, models, simulate};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn w2(integrator: Integrator, output_interval: Option<f64>) -> Experiment<3> {
    let mut experiment = models::human_experiment(20.0, [0.0; 3]).expect("a sample experiment");
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

criterion_group!(benches, single);
criterion_main!(benches);
