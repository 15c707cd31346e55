//! Rows to a triangular factor: time per pass over N rows.

use arm_numerics::Condenser;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use std::hint::black_box;

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

fn condense(c: &mut Criterion) {
    let mut group = c.benchmark_group("condense");
    group.sample_size(10);
    for p in [3, 4, 6, 12, 18] {
        for n in [1_000, 10_000, 100_000, 1_000_000] {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let rows: Vec<f64> = (0..n * p).map(|_| uniform(&mut rng)).collect();
            let rhs: Vec<f64> = (0..n).map(|_| uniform(&mut rng)).collect();
            group.throughput(Throughput::Elements(n as u64));
            group.bench_function(BenchmarkId::new(format!("p{p}"), n), |bencher| {
                bencher.iter(|| {
                    let mut condenser = Condenser::new(p);
                    condenser
                        .push_block(black_box(&rows), black_box(&rhs))
                        .expect("all numbers are finite");
                    condenser.finish()
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, condense);
criterion_main!(benches);
