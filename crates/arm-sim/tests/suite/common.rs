//! Experiments and comparisons that several tests use.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Joints, Segment, Setup, Shape, sample_arms};
use arm_sim::{Drive, Experiment, Recording, Start, simulate};

/// The human arm led by a handle whose path is smooth enough for a fourth-order method.
pub fn smooth(duration: f64) -> Experiment<3> {
    let (from, to) = ([-68.0, 40.0, 0.0], [-56.0, 80.0, 5.0]);
    let mut experiment = arm_sim::sample_experiments::led(
        sample_arms::human_arm(),
        Shape::Smooth,
        (from, to),
        duration,
        [0.0; 3],
    )
    .expect("a sample experiment");
    experiment.setup.contact.damping = [25.0; 2];
    experiment
}

/// Effects of every kind of place that a run of three joints can have.
pub fn several_effects() -> Vec<Effect<f64>> {
    vec![
        Effect::new(Kind::Viscous, 0).with(&[0.2]),
        Effect::new(Kind::Elastic, 1).with(&[0.5, 0.8]),
        Effect::new(Kind::Viscous, 2).with(&[0.1]),
        Effect::new(Kind::Coulomb, 1).with(&[0.161, 0.05]),
        Effect::new(Kind::Relaxation, 0).with(&[2.0, 0.5]),
        Effect::new(Kind::LoadFriction, 1).with(&[0.002, 0.05]),
        Effect::new(Kind::Biarticular, 2),
        Effect::new(Kind::AddedMass, 0).with(&[0.3]),
        Effect::new(Kind::RobotRipple, 0).with(&[0.0005, 0.0003, 2.0, 0.4]),
        Effect::new(Kind::ShoulderMotion, 0).with(&[0.01, 0.02, -1.1]),
        Effect::new(Kind::ShoulderHeave, 0).with(&[0.002, 0.006, 0.4, 0.3]),
    ]
}

/// Mass, distance of its centre, inertia about that, gravity; and the free pendulum that has them, let go at -1.2 rad.
pub fn swinging() -> ([f64; 4], Experiment<1>) {
    let (mass, com, inertia, gravity) = (1.3, 0.21, 0.02, 9.81);
    let segment = Segment {
        length: 0.4,
        mass,
        com: [com, 0.0],
        inertia,
    };
    let chain = Chain::new([segment], [0.0; 2], [0.0, -gravity]).expect("a chain");
    let setup = Setup::new(&chain, Contact::new([0.0; 2], [0.0; 2]));
    let mut experiment = Experiment::new(setup, Drive::Torque(None), 2.0);
    experiment.start = Start::Given {
        q: Joints::<f64, 1>::repeat(-1.2),
        qd: Joints::zeros(),
    };
    ([mass, com, inertia, gravity], experiment)
}

pub fn run<const N: usize>(experiment: &Experiment<N>) -> Recording<N> {
    simulate(experiment).expect("the experiment runs")
}

/// Largest of some sizes; one that is not a number is the result, so that no bound holds.
pub fn most(values: impl IntoIterator<Item = f64>) -> f64 {
    let sizes = values.into_iter().map(f64::abs);
    sizes.fold(0.0, |m, d| if d <= m || m.is_nan() { m } else { d })
}

/// Largest difference of two columns.
pub fn largest(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    most(a.iter().zip(b).map(|(a, b)| a - b))
}
