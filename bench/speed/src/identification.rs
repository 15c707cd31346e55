//! A three-joint arm as a laboratory would have measured it.

use arm_core::effect::{Effect, Kind, MAX_STATES, Motion, resisting_torque};
use arm_core::{
    Chain, Contact, Joints, Plane, Pose, Segment, gravity, inverse_dynamics, jacobian, sample_arms,
};
use arm_ident::inference::joint_method::{MotionSource, Options};
use arm_ident::regression::trial::{Model, Tolerance, Trial};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const RATE: f64 = 100.0;

/// The arm of table 4.10 as a laboratory would have it: every mass 8 % off, nothing known better than to 10 %.
pub fn model(fitted: Vec<Effect<f64>>) -> Model<3> {
    let arm = sample_arms::human_arm();
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
pub fn slow(n: usize) -> (Vec<Joints<f64, 3>>, Vec<Plane<f64>>) {
    let arm = sample_arms::human_arm();
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
    let arm = sample_arms::human_arm();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut noise = || (rng.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
    let states = vec![[0.0; MAX_STATES]; effects.len()];
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
        torque: Some(torques),
        ..Trial::new(RATE, angles)
    }
}

/// Viscosity and dry friction in every joint.
fn effects(values: [[f64; 3]; 2]) -> Vec<Effect<f64>> {
    let of = |kind, values: [f64; 3]| (0..3).map(move |j| Effect::new(kind, j).with(&[values[j]]));
    of(Kind::Viscous, values[0])
        .chain(of(Kind::Coulomb, values[1]))
        .collect()
}

/// The problem of the joint method: 15 unknowns and three offsets of angles.
pub fn joint(n: usize) -> (Model<3>, [Trial<3>; 1], Options) {
    let trial = fast(n, &effects([[0.2; 3], [0.1, 0.08, 0.03]]));
    let options = Options {
        cutoff: Some(5.0),
        motion: MotionSource::Measured,
        tolerance: Tolerance::default(),
        ..Options::default()
    };
    (model(effects([[0.0; 3]; 2])), [trial], options)
}
