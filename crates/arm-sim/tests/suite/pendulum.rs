//! One joint: the period of a pendulum against the elliptic integral.

use arm_core::{Chain, Contact, Joints, Segment, Setup};
use arm_sim::{Drive, Experiment, Start};

use crate::common::{most, run};

const MASS: f64 = 1.5;
const COM: f64 = 0.2;
const INERTIA: f64 = 0.012;
const GRAVITY: f64 = 9.81;

fn pendulum(swing: f64, duration: f64) -> Experiment<1> {
    let segment = Segment {
        length: 0.4,
        mass: MASS,
        com: [COM, 0.0],
        inertia: INERTIA,
    };
    let arm = Chain::new([segment], [0.0; 2], [0.0, -GRAVITY]).expect("a pendulum");
    let setup = Setup::new(&arm, Contact::new([0.0; 2], [0.0; 2]));
    let mut experiment = Experiment::new(setup, Drive::Torque(None), duration);
    experiment.start = Start::Given {
        q: Joints::from([swing - core::f64::consts::FRAC_PI_2]),
        qd: Joints::zeros(),
    };
    experiment
}

/// `T = 2π √(J/mgl) / AGM(1, cos(swing/2))`, by Gauss.
fn period(swing: f64) -> f64 {
    let (mut a, mut b) = (1.0, libm::cos(0.5 * swing));
    while (a - b).abs() > 1e-15 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let about_joint = INERTIA + MASS * COM * COM;
    core::f64::consts::TAU * (about_joint / (MASS * GRAVITY * COM)).sqrt() / a
}

#[test]
fn the_period_of_a_pendulum_is_the_elliptic_integral() {
    for swing in [0.1, 1.0, 2.5] {
        let r = run(&pendulum(swing, 5.0));
        // The speed returns to zero from below after each whole period but the first sample.
        let turn = |i: usize| r.qd[i] > 0.0 && r.qd[i + 1] <= 0.0;
        let last = (1..r.len() - 1)
            .rev()
            .find(|&i| turn(i))
            .expect("several periods");
        let at = r.time[last] - r.qd[last] / r.qdd[last];
        let turns = (at / period(swing)).round();
        let error = (at / turns - period(swing)).abs();
        assert!(error < 1e-9, "swing {swing} rad: {error:e} s in a period");
        let energy = most(r.energy_error());
        assert!(energy < 1e-10, "swing {swing} rad: {energy:e} J");
    }
}

/// A horizontal pendulum starts to fall with m g l / J, and its bearing carries nothing else.
#[test]
fn the_first_acceleration_is_arithmetic() {
    let r = run(&pendulum(core::f64::consts::FRAC_PI_2, 0.01));
    let expected = -MASS * GRAVITY * COM / (INERTIA + MASS * COM * COM);
    assert!((r.qdd[0] - expected).abs() < 1e-12);
}
