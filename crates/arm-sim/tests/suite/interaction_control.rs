//! A compliant handle, an arm that is carried, and a loop that is stopped where it is not stable.

use arm_core::{Joints, Pose, Shape, gravity, sample_arms::mechanical_arm};
use arm_sim::{
    Controller, Experiment, Interaction, InteractionLaw, Safety, SimulationError, Support, Yielded,
    interact, sample_experiments,
};

const SAFETY: Safety = Safety {
    angle_margin: 0.6,
    speed: 4.0,
    acceleration: 60.0,
    force: 100.0,
};

/// There and back in two seconds without passive joints, then at rest.
fn experiment(rest: f64) -> Experiment<2> {
    let (from, to) = ([-60.0, 50.0], [-40.0, 80.0]);
    let mut experiment =
        sample_experiments::led(mechanical_arm(), Shape::Smooth, (from, to), 2.0, [0.0; 2])
            .expect("a possible run");
    experiment.duration += rest;
    experiment.robot = Some(sample_experiments::robot().expect("the robot of the thesis"));
    experiment
}

fn run(
    interaction: &Interaction,
    push: &[f64],
    support: Option<Support<'_, 2>>,
) -> Result<Yielded, SimulationError> {
    let device = (&Controller::default(), interaction, &SAFETY);
    interact(&experiment(2.0), device, push, (support, 50.0), 1)
}

/// Weight of the arm, as the experiment has it, and its springs.
fn weight(q: &Joints<f64, 2>) -> Joints<f64, 2> {
    gravity(&mechanical_arm(), &Pose::new(q)) + q * sample_experiments::ELASTICITY
}

fn law(law: InteractionLaw) -> Interaction {
    Interaction {
        law,
        ..Interaction::default()
    }
}

fn last(values: &[f64]) -> [f64; 2] {
    let n = values.len();
    [values[n - 2], values[n - 1]]
}

/// Root mean square of the force on the arm.
fn rms(done: &Yielded) -> f64 {
    let sum: f64 = done.force_on_arm.iter().map(|f| f * f).sum();
    (sum / done.time.len() as f64).sqrt()
}

#[test]
fn the_handle_rests_where_its_spring_holds_the_arm() {
    for of in [InteractionLaw::Impedance, InteractionLaw::Admittance] {
        let interaction = law(of);
        let done = run(&interaction, &[], None).expect("a run");
        assert_eq!(done.stop, None, "{of:?}");
        let robot = sample_experiments::robot().expect("a robot");
        let at = robot.handle(&last(&done.robot_q).into());
        let wanted = {
            let experiment = experiment(2.0);
            let arm_sim::Drive::Handle { path, .. } = &experiment.drive else {
                panic!("no handle");
            };
            path.at(4.0).position
        };
        let force = last(&done.force_on_arm);
        for axis in 0..2 {
            let held = interaction.stiffness * (wanted[axis] - at[axis]);
            // Beside the noise of the force sensor, which an admittance follows.
            assert!((held - force[axis]).abs() < 0.3, "{of:?}: {held} {force:?}");
        }
    }
}

#[test]
fn an_arm_that_is_carried_needs_no_force() {
    for of in [InteractionLaw::Impedance, InteractionLaw::Admittance] {
        let without = rms(&run(&law(of), &[], None).expect("a run"));
        let mut carry = |_: f64, q: &Joints<f64, 2>| Some(weight(q));
        let with = run(&law(of), &[], Some(&mut carry)).expect("a run");
        assert_eq!(with.stop, None, "{of:?}");
        // What is left moves the arm and its viscosity.
        assert!(
            rms(&with) < 0.2 * without,
            "{of:?}: {} {without}",
            rms(&with)
        );
        let torque = with.support.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
        assert!(torque > 1.0, "{torque}");
    }
}

#[test]
fn a_torque_that_is_not_trusted_is_none() {
    let mut carry = |_: f64, _: &Joints<f64, 2>| None;
    let with = run(&law(InteractionLaw::Impedance), &[], Some(&mut carry)).expect("a run");
    let without = run(&law(InteractionLaw::Impedance), &[], None).expect("a run");
    assert_eq!(with, without);
}

/// A support that is five times the weight pushes the arm up the faster the higher it is.
#[test]
fn a_loop_that_is_not_stable_is_stopped() {
    let mut carry = |_: f64, q: &Joints<f64, 2>| Some(weight(q) * 5.0);
    let done = run(&law(InteractionLaw::Impedance), &[], Some(&mut carry)).expect("a run");
    assert!(done.stop.is_some());
    assert_eq!(last(&done.support), [0.0; 2]);
}

#[test]
fn a_perturbation_moves_the_handle_again_and_again() {
    let interaction = law(InteractionLaw::Impedance);
    let quiet = run(&interaction, &[], None).expect("a run");
    // Half a second up, half a second down.
    let push: Vec<f64> = (0..4000)
        .flat_map(|k| [0.0, if k < 2000 { 5.0 } else { -5.0 }])
        .collect();
    let pushed = run(&interaction, &push, None).expect("a run");
    let robot = sample_experiments::robot().expect("a robot");
    let height = |done: &Yielded, k: usize| {
        robot.handle(&[done.robot_q[2 * k], done.robot_q[2 * k + 1]].into())[1]
    };
    for second in [2, 3] {
        let off = |k: usize| height(&pushed, k) - height(&quiet, k);
        let (up, down) = (off(4000 * second + 2000), off(4000 * second + 3999));
        assert!(up > 1e-3 && down < -1e-3, "{up} {down}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |change: fn(&mut Interaction)| {
        let mut interaction = Interaction::default();
        change(&mut interaction);
        run(&interaction, &[], None)
            .expect_err("a refusal")
            .to_string()
    };
    assert!(
        refused(|i| i.stiffness = -1.0)
            .contains("stiffness of the handle is -1, allowed is at least 0")
    );
    assert!(refused(|i| i.damping = f64::NAN).contains("damping of the handle is NaN"));
    assert!(refused(|i| i.mass = 0.0).contains("virtual mass is 0"));
    assert!(refused(|i| i.link_masses[1] = 0.0).contains("mass of a link of the robot is 0"));
}
