//! From samples to an estimate: the streamed cascade (wrist, elbow, shoulder, with bounds) and the joint method.

use arm_core::effect::{Effect, Kind, Motion, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Plane, Pose, Segment, gravity, inverse_dynamics, jacobian, models,
};
use arm_ident::joint::{MotionSource, Options, identify};
use arm_ident::quasi_static::Stream;
use arm_ident::trial::{Model, Role, Tolerance, Trial};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use std::hint::black_box;

const SIZES: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
const RATE: f64 = 100.0;

/// The arm of table 4.10 as a laboratory would have it: every mass 8 % off, nothing known better than to 10 %.
fn model(fitted: Vec<Effect<f64>>) -> Model<3> {
    let arm = models::human_arm();
    let segments: [Segment<f64>; 3] = core::array::from_fn(|k| Segment {
        mass: arm.segments()[k].mass * [1.08, 0.92, 1.08][k],
        ..arm.segments()[k]
    });
    Model {
        chain: Chain::new(segments, arm.base(), arm.gravity()).expect("a valid arm"),
        segment_uncertainty: 0.1,
        fitted,
        held: Vec::new(),
        contact: Contact::new([1e4; 2], [25.0; 2]),
    }
}

/// Angles and forces of a slow movement: there and back as in the reference workload, with noise. The force holds shoulder and elbow.
fn slow(n: usize) -> (Vec<Joints<f64, 3>>, Vec<Plane<f64>>) {
    let arm = models::human_arm();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut noise = || (rng.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
    (0..n)
        .map(|i| {
            let s = 1.0 - (2.0 * i as f64 / n as f64 - 1.0).abs();
            let degrees = [-68.0 + 12.0 * s, 40.0 + 40.0 * s, 5.0 * s];
            let q = Joints::from(degrees.map(|d| (d + 0.1 * noise()).to_radians()));
            let pose = Pose::new(&q);
            let (j, g) = (jacobian(&arm, &pose), gravity(&arm, &pose));
            let det = j[(0, 0)] * j[(1, 1)] - j[(1, 0)] * j[(0, 1)];
            let force = [
                (g[0] * j[(1, 1)] - g[1] * j[(1, 0)]) / det + 0.2 * noise(),
                (g[1] * j[(0, 0)] - g[0] * j[(0, 1)]) / det + 0.2 * noise(),
            ];
            (q, force)
        })
        .unzip()
}

/// One trial with measured joint torques: sums of sines, viscosity and dry friction in every joint.
fn fast(n: usize, effects: &[Effect<f64>]) -> Trial<3> {
    let arm = models::human_arm();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut noise = || (rng.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
    let states = vec![0.0; effects.len()];
    let (mut angles, mut torques) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for i in 0..n {
        let t = i as f64 / RATE;
        let [q, qd, qdd] = [0, 1, 2].map(|d| {
            Joints::<f64, 3>::from_fn(|j, _| {
                let w = [2.1, 2.9, 3.7][j];
                let wave = [libm::sin(w * t), libm::cos(w * t), -libm::sin(w * t)][d];
                let centre = if d == 0 { [-0.9, 1.0, 0.1][j] } else { 0.0 };
                centre + 0.4 * wave * [1.0, w, w * w][d]
            })
        });
        let needed = inverse_dynamics(&arm, &Pose::new(&q), &qd, &qdd)
            + resisting_torque(effects, &Motion::new(t, q, qd), &states);
        angles.push(q.map(|v| v + 1e-4 * noise()));
        torques.push(needed.map(|v| v + 0.05 * noise()));
    }
    Trial {
        role: Role::Fit,
        configuration: 0,
        rate: RATE,
        q: angles,
        speed: None,
        force_on_arm: None,
        moment_on_arm: None,
        torque: Some(torques),
        handle: None,
        valid: vec![true; n],
    }
}

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
                stream.finish().solve(&model, 3.0).expect("a solution")
            });
        });
    }
    group.finish();
}

fn joint(c: &mut Criterion) {
    let mut group = c.benchmark_group("joint");
    group.sample_size(10);
    let effects = |values: [[f64; 3]; 2]| -> Vec<Effect<f64>> {
        let of =
            |kind, values: [f64; 3]| (0..3).map(move |j| Effect::new(kind, j).with(&[values[j]]));
        of(Kind::Viscous, values[0])
            .chain(of(Kind::Coulomb, values[1]))
            .collect()
    };
    let acting = effects([[0.2; 3], [0.1, 0.08, 0.03]]);
    let model = model(effects([[0.0; 3]; 2]));
    let options = Options {
        cutoff: Some(5.0),
        motion: MotionSource::Measured,
        tolerance: Tolerance::default(),
        level: 0.95,
    };
    for n in SIZES {
        let trial = [fast(n, &acting)];
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
