//! Kernels, steps and a session to count the instructions of: `counts WHAT HOW_MANY`; `scripts/counts.py` runs it.

use arm_core::effect::{Effect, Kind};
use arm_core::{
    Joints, Load, Pose, Scalar, forward_dynamics, inverse_dynamics, sample_arms as arms,
};
use arm_gap::prepared_session::PreparedSession;
use arm_sim::{Experiment, Integrator, sample_experiments, simulate};
use std::hint::black_box;

#[path = "../../../crates/arm-gap/tests/suite/sessions.rs"]
mod sessions;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let what = arguments.next().unwrap_or_default();
    let amount: u32 = arguments
        .next()
        .and_then(|text| text.parse().ok())
        .expect("how many");
    let arm = black_box(arms::human_arm());
    match what.as_str() {
        "sine_and_cosine" => kernel(amount, |[q, ..]| Scalar::sin_cos(q[0]).0),
        "inverse_dynamics" => kernel(amount, |[q, qd, qdd]| {
            inverse_dynamics(&arm, &Pose::new(q), qd, qdd)[0]
        }),
        "forward_dynamics" => kernel(amount, |[q, qd, torque]| {
            let load = Load {
                torque: *torque,
                ..Load::none()
            };
            forward_dynamics(&arm, &Pose::new(q), qd, &load)[0]
        }),
        "step_euler" => run(amount, Integrator::SemiImplicitEuler, &[]),
        "step_fourth_order" => run(amount, Integrator::Rk4, &[]),
        "step_friction" => run(amount, Integrator::Rk4, &friction(0.0)),
        "step_smooth_friction" => run(amount, Integrator::Rk4, &friction(0.01)),
        "gap_session" => gap(amount),
        other => panic!("{other}: nothing that is counted"),
    }
}

fn kernel(calls: u32, call: impl Fn(&[Joints<f64, 3>; 3]) -> f64) {
    for i in 0..calls {
        let wave = |part: u32, size: f64| {
            Joints::<f64, 3>::from_fn(|j, _| {
                size * f64::from((i + 7 * part + 3 * j as u32) % 16) / 16.0
            })
        };
        black_box(call(black_box(&[wave(0, 1.5), wave(1, 1.0), wave(2, 3.0)])));
    }
}

/// Dry friction in every joint with a smoothing \[rad/s\], for 0 set-valued.
fn friction(smoothing: f64) -> Vec<Effect<f64>> {
    let coulomb = |joint| Effect::new(Kind::Coulomb, joint).with(&[0.1, smoothing]);
    (0..3).map(coulomb).collect()
}

/// A session with one hidden effect, searched so many times in one thread; it is made in any case.
fn gap(searches: u32) {
    let elastic = Kind::named("elastic").expect("known");
    let hidden = Effect::new(elastic, 1).with(&[1.5, 1.0]);
    let session = sessions::session(&[hidden], (1e-3, 0.1));
    for _ in 0..searches {
        let mut prepared = PreparedSession::new(&session, 1).expect("a sound session");
        let finding = prepared.search(&|_, _| Ok(())).expect("a finding");
        assert_eq!(finding.amended.hypothesis.named.len(), 1);
    }
}

/// The arm of table 4.10 led for some steps of 0.25 ms within a movement of 20 s.
fn run(steps: u32, integrator: Integrator, further: &[Effect<f64>]) {
    let mut experiment: Experiment<3> =
        sample_experiments::human_experiment(20.0, [0.0; 3]).expect("a sample experiment");
    experiment.integrator = integrator;
    experiment.duration = f64::from(steps) * experiment.dt;
    experiment.output_interval = Some(experiment.duration);
    experiment.effects.extend_from_slice(further);
    black_box(simulate(black_box(&experiment)).expect("a run"));
}
