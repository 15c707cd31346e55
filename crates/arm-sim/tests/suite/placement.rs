//! A handle beside the tip: the arm must move as one whose last segment ends where the handle is.

use arm_core::effect::{Effect, Kind};
use arm_core::{Joints, Setup};
use arm_sim::{Coupling, Drive, Engine, Experiment, Integrator, Recording, Start, simulate_with};

use crate::common::{largest, smooth};

/// Along the last segment and to its left \[m\]: much, so that what is missing shows.
const BESIDE: [f64; 2] = [0.012, -0.02];

/// Three joints with effects that do not depend on the angle of the last.
pub fn placed(effects: &[Effect<f64>]) -> Experiment<3> {
    let mut experiment = smooth(1.0);
    experiment.setup.placement = BESIDE;
    experiment.effects = effects.to_vec();
    experiment.start = Start::Given {
        q: [-1.19, 0.7, 0.05].into(),
        qd: [0.1, -0.2, 0.3].into(),
    };
    experiment
}

/// The same arm with the frame of its last segment laid through the handle, and the angle between the two frames \[rad\].
fn ending_there(experiment: &Experiment<3>) -> (Experiment<3>, f64) {
    let mut same = experiment.clone();
    let hand = &mut same.setup.segments[2];
    let [along, left] = [hand.length + BESIDE[0], BESIDE[1]];
    let turned = libm::atan2(left, along);
    let (sin, cos) = libm::sincos(turned);
    hand.length = libm::hypot(along, left);
    let [y, z] = hand.com;
    hand.com = [cos * y + sin * z, cos * z - sin * y];
    same.setup = Setup {
        placement: [0.0; 2],
        ..same.setup
    };
    if let Start::Given { q, .. } = &mut same.start {
        q[2] += turned;
    }
    (same, turned)
}

fn is_the_same(experiment: &Experiment<3>, engine: Engine, bound: f64) {
    let run = |e: &Experiment<3>| -> Recording<3> { simulate_with(engine, e).expect("it runs") };
    let (other, turned) = ending_there(experiment);
    let (here, mut there) = (run(experiment), run(&other));
    for q in there.q.chunks_exact_mut(3) {
        q[2] -= turned;
    }
    let moved = largest(&here.q[..3], &here.q[here.q.len() - 3..]);
    assert!(moved > 0.01, "the arm hardly moves: {moved} rad");
    let contact: [&[f64]; 2] = [&here.torque.contact, &there.torque.contact];
    let differences = [
        largest(&here.q, &there.q),
        largest(&here.tip, &there.tip),
        1e-3 * largest(&here.force_on_arm, &there.force_on_arm),
        1e-3 * largest(contact[0], contact[1]),
        1e-3 * largest(&here.energy.potential, &there.energy.potential),
    ];
    println!("{engine:?} {differences:?}");
    assert!(differences.iter().all(|d| *d < bound), "{differences:?}");
}

#[test]
fn it_is_an_arm_that_ends_there() {
    let friction = [
        Effect::new(Kind::Viscous, 2).with(&[0.1]),
        Effect::new(Kind::Elastic, 1).with(&[0.5, 0.8]),
        Effect::new(Kind::Coulomb, 1).with(&[0.161, 0.05]),
    ];
    let feeling = [
        Effect::new(Kind::LoadFriction, 1).with(&[0.002, 0.05]),
        Effect::new(Kind::ShoulderMotion, 0).with(&[0.01, 0.02, -1.1]),
    ];
    for effects in [&friction[..], &feeling[..], &[]] {
        for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
            let mut experiment = placed(effects);
            experiment.integrator = integrator;
            is_the_same(&experiment, Engine::Native, 1e-11);
        }
    }
}

#[test]
fn a_rigid_coupling_holds_it_there() {
    let mut experiment = placed(&[Effect::new(Kind::ShoulderMotion, 0).with(&[0.01, 0.02, -1.1])]);
    if let Drive::Handle { coupling, .. } = &mut experiment.drive {
        *coupling = Coupling::Rigid;
    }
    experiment.start = Start::Equilibrium {
        near: Joints::from([-1.19, 0.7, 0.05]),
    };
    let run = |e: &Experiment<3>| arm_sim::simulate(e).expect("it runs");
    let (mut other, turned) = ending_there(&experiment);
    other.start = Start::Equilibrium {
        near: Joints::from([-1.19, 0.7, 0.05 + turned]),
    };
    let (here, there) = (run(&experiment), run(&other));
    assert!(largest(&here.tip, &here.handle) < 1e-10);
    let force = largest(&here.force_on_arm, &there.force_on_arm);
    assert!(force < 1e-8, "{force} N");
}

#[cfg(feature = "rapier")]
#[test]
fn rapier_holds_it_there_too() {
    let friction = [Effect::new(Kind::Viscous, 2).with(&[0.1])];
    is_the_same(&placed(&friction), Engine::Rapier, 1e-11);
}
