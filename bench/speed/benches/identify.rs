//! From samples to an estimate: the streamed cascade (wrist, elbow, shoulder, with bounds) and the joint method.

use arm_ident::cascade::quasi_static::Stream;
use arm_ident::inference::joint_method::identify;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use speed::identification::{joint as asked, model, slow};
use std::hint::black_box;

const SIZES: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];

fn cascade(c: &mut Criterion) {
    let mut group = c.benchmark_group("cascade");
    group.sample_size(10);
    let model = model(Vec::new());
    for n in SIZES {
        let (q, force) = slow(n);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::from_parameter(n), |bencher| {
            bencher.iter(|| {
                let mut stream = Stream::new(&model.chain);
                stream
                    .push(black_box(&q), black_box(&force))
                    .expect("finite samples");
                let condensed = stream.finish().expect("finite samples");
                condensed.solve(&model, 3.0).expect("a solution")
            });
        });
    }
    group.finish();
}

fn joint(c: &mut Criterion) {
    let mut group = c.benchmark_group("joint");
    group.sample_size(10);
    for n in SIZES {
        let (model, trial, options) = asked(n);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::from_parameter(n), |bencher| {
            bencher.iter(|| {
                identify(black_box(&model), black_box(&trial), &options).expect("a solution")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, cascade, joint);
criterion_main!(benches);
