//! One constrained fit, from triangular factor to estimate.

use arm_numerics::Matrix;
use arm_numerics::least_squares::program::{Cone, Program};
use criterion::{Criterion, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use std::hint::black_box;

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

fn random(p: usize) -> Program {
    let mut rng = ChaCha8Rng::seed_from_u64(p as u64);
    let r = Matrix::from_fn(p, p, |i, j| {
        if i <= j {
            uniform(&mut rng) + if i == j { 2.0 } else { 0.0 }
        } else {
            0.0
        }
    });
    let z = (0..p).map(|_| uniform(&mut rng)).collect();
    Program::new(r, z).expect("all numbers are finite")
}

/// Three links of eight parameters (m, hx, hy, I, …) under bounds, support constraints and one cone each.
fn physical() -> Program {
    let mut program = random(24);
    let mut lower = [f64::NEG_INFINITY; 24];
    for link in 0..3 {
        let (m, hx, hy, inertia) = (8 * link, 8 * link + 1, 8 * link + 2, 8 * link + 3);
        lower[m] = 0.1;
        lower[hx] = 0.0;
        let row = |entries: &[(usize, f64)]| {
            let mut row = [0.0; 24];
            entries.iter().for_each(|&(j, v)| row[j] = v);
            row
        };
        for entries in [
            vec![(hx, 1.0), (m, -0.4)],
            vec![(hy, 1.0), (m, -0.1)],
            vec![(hy, -1.0), (m, -0.1)],
            vec![(inertia, 1.0), (hx, -0.4), (m, -0.01)],
        ] {
            program = program.at_most(&row(&entries), 0.0).expect("finite");
        }
        let (l, mut a) = (0.3, Matrix::zeros(3, 24));
        a[(0, hx)] = 2.0 * l;
        a[(1, hy)] = 2.0 * l;
        a[(2, inertia)] = 1.0;
        a[(2, m)] = -l * l;
        let c = row(&[(inertia, 1.0), (m, l * l)]).to_vec();
        let cone = Cone {
            a,
            b: vec![0.0; 3],
            c,
            d: 0.0,
        };
        program = program.cone(cone).expect("finite");
    }
    let upper = [f64::INFINITY; 24];
    program.bounds(&lower, &upper).expect("ordered")
}

fn solve(c: &mut Criterion) {
    let mut group = c.benchmark_group("program");
    let mut run = |name: &str, program: &Program| {
        group.bench_function(name, |b| b.iter(|| black_box(program).solve()));
    };
    for p in [3, 12, 24] {
        run(&format!("free/p{p}"), &random(p));
        let bounded = random(p).bounds(&vec![0.0; p], &vec![0.1; p]);
        run(&format!("bounded/p{p}"), &bounded.expect("ordered"));
    }
    run("cones/p24", &physical());
    group.finish();
}

criterion_group!(benches, solve);
criterion_main!(benches);
