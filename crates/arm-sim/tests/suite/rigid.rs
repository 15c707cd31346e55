//! A tip that follows the handle exactly.

use arm_core::{Joints, Pose, inverse_dynamics, sample_arms, static_torque};
use arm_sim::{Coupling, Drive, Experiment, Integrator, Recording, Start};

use crate::common::{largest, run, several_effects, smooth};

fn rigid<const N: usize>(mut experiment: Experiment<N>) -> Experiment<N> {
    if let Drive::Handle { coupling, .. } = &mut experiment.drive {
        *coupling = Coupling::Rigid;
    }
    experiment
}

fn mechanical(duration: f64) -> Experiment<2> {
    let poses = ([-60.0, 50.0], [-40.0, 80.0]);
    arm_sim::sample_experiments::led(
        sample_arms::mechanical_arm(),
        arm_core::Shape::Smooth,
        poses,
        duration,
        [0.0; 2],
    )
    .expect("a sample")
}

/// Largest distance of the tip from the handle \[m\].
fn gap<const N: usize>(r: &Recording<N>) -> f64 {
    largest(&r.tip, &r.handle)
}

#[test]
fn the_tip_stays_on_the_handle() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut two = rigid(mechanical(2.0));
        let mut three = rigid(smooth(2.0));
        three.effects = several_effects();
        (two.integrator, three.integrator) = (integrator, integrator);
        let gaps = [gap(&run(&two)), gap(&run(&three))];
        println!("{integrator:?} {gaps:?}");
        assert!(gaps.iter().all(|&g| g < 1e-10), "{gaps:?} m");
    }
}

/// Two joints have no freedom left: the motion is the desired movement, whatever acts.
#[test]
fn two_joints_follow_the_desired_movement() {
    let experiment = rigid(mechanical(2.0));
    let r = run(&experiment);
    let from = [-60f64, 50.0].map(f64::to_radians);
    let to = [-40f64, 80.0].map(f64::to_radians);
    let middle = r.len() / 2;
    let at = |i: usize| [r.q[2 * i], r.q[2 * i + 1]];
    for (i, expected) in [(0, from), (middle, to), (r.len() - 1, from)] {
        assert!(largest(&at(i), &expected) < 1e-9, "sample {i}: {:?}", at(i));
    }
}

/// The multiplier is the force that inverse dynamics requires.
#[test]
fn the_force_is_that_of_inverse_dynamics() {
    let r = run(&rigid(smooth(1.0)));
    let arm = sample_arms::human_arm();
    for i in (0..r.len()).step_by(37) {
        let joints = |column: &[f64]| Joints::<f64, 3>::from_fn(|j, _| column[3 * i + j]);
        let (q, qd, qdd) = (joints(&r.q), joints(&r.qd), joints(&r.qdd));
        let pose = Pose::new(&q);
        let needed = inverse_dynamics(&arm, &pose, &qd, &qdd) + joints(&r.torque.resisting);
        let force = [r.force_on_arm[2 * i], r.force_on_arm[2 * i + 1]];
        let given = static_torque(&arm, &pose, force, 0.0);
        assert!(
            largest(needed.as_slice(), given.as_slice()) < 1e-9,
            "sample {i}"
        );
    }
}

#[test]
fn a_stiff_spring_converges_to_the_rigid_coupling() {
    let mut experiment = mechanical(1.0);
    experiment.effects = several_effects().into_iter().take(2).collect();
    experiment.output_interval = Some(0.01);
    let reference = run(&rigid(experiment.clone()));
    let mut apart = Vec::new();
    for stiffness in [1e5, 1e6, 1e7] {
        experiment.setup.contact.stiffness = [stiffness; 2];
        // Damped near critically, so that the start does not ring.
        experiment.setup.contact.damping = [libm::sqrt(stiffness); 2];
        experiment.dt = 0.25e-4;
        apart.push(largest(&run(&experiment).q, &reference.q));
    }
    println!("{apart:?}");
    assert!(
        apart[1] < 0.2 * apart[0] && apart[2] < 0.2 * apart[1],
        "{apart:?} rad"
    );
    assert!(apart[2] < 2e-5, "{apart:?} rad");
}

#[test]
fn a_start_beside_the_handle_is_projected() {
    let mut experiment = rigid(smooth(0.1));
    experiment.start = Start::Given {
        q: [-65f64, 42.0, 3.0].map(f64::to_radians).into(),
        qd: [0.0; 3].into(),
    };
    assert!(gap(&run(&experiment)) < 1e-10);
}
