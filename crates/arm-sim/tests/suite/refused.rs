//! Every refused input: an accepted experiment with one thing broken.

use arm_core::effect::{Effect, Kind};
use arm_core::{Elbow, Robot};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Interpolation, Series, SimulationError, Start,
    simulate, simulate_partial,
};

use crate::common::smooth;

fn refusal(change: impl FnOnce(&mut Experiment<3>)) -> String {
    let mut experiment = smooth(0.1);
    change(&mut experiment);
    simulate(&experiment).expect_err("refused").to_string()
}

#[test]
fn steps_and_durations() {
    for dt in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        let text = refusal(|e| e.dt = dt);
        assert!(text.starts_with("step is"), "{text}");
    }
    for duration in [0.0, -1.0, f64::NAN, 0.1001] {
        let text = refusal(|e| e.duration = duration);
        assert!(text.starts_with("duration is"), "{text}");
    }
    for interval in [0.0, 0.3e-3, f64::NAN, -0.25e-3] {
        let text = refusal(|e| e.output_interval = Some(interval));
        assert!(text.starts_with("output interval is"), "{text}");
    }
    let text = refusal(|e| e.output_interval = Some(0.2));
    assert!(text.contains("up to the duration"), "{text}");
}

#[test]
fn values_that_are_not_finite() {
    let text = refusal(|e| e.setup.segments[1].mass = f64::NAN);
    assert!(text.contains("mass of segment 2"), "{text}");
    let text = refusal(|e| e.setup.contact.stiffness[0] = f64::NAN);
    assert!(text.contains("contact stiffness"), "{text}");
    let text = refusal(|e| {
        e.start = Start::Given {
            q: [0.0, f64::NAN, 0.0].into(),
            qd: [0.0; 3].into(),
        };
    });
    assert!(text.contains("start angle"), "{text}");
    let text = refusal(|e| e.effects.push(Effect::new(Kind::Viscous, 3)));
    assert!(text.contains("joint"), "{text}");
}

#[test]
fn a_handle_beyond_the_robot_s_reach() {
    let robot = Robot::new([0.2, 0.2], [1.05, -0.1], Elbow::Up).expect("a robot");
    let mut experiment = smooth(0.1);
    experiment.robot = Some(robot);
    match simulate(&experiment).expect_err("out of reach") {
        SimulationError::Unreachable {
            time,
            distance,
            max,
            ..
        } => {
            assert_eq!((time, max), (0.0, 0.4));
            assert!(distance > 0.4);
        }
        other => panic!("{other}"),
    }
}

#[test]
fn a_contact_too_stiff_for_the_step() {
    let text = refusal(|e| e.setup.contact.stiffness = [1e9; 2]);
    assert!(text.contains("stable for steps up to"), "{text}");
    let text = refusal(|e| e.setup.contact.damping = [1e6; 2]);
    assert!(text.contains("damping rate"), "{text}");
}

#[test]
fn a_rigid_coupling_of_one_joint() {
    let arm = arm_core::Chain::new(
        [arm_core::sample_arms::mechanical_arm().segments()[0]],
        [0.0; 2],
        [0.0, -9.81],
    )
    .expect("an arm");
    let setup = arm_core::Setup::new(&arm, arm_core::Contact::new([1e4; 2], [0.0; 2]));
    let drive = Drive::Handle {
        path: HandlePath::fixed([0.3, 0.0]).expect("a point"),
        coupling: Coupling::Rigid,
    };
    let refused = simulate(&Experiment::<1>::new(setup, drive, 1.0)).expect_err("one joint");
    assert_eq!(refused, SimulationError::RigidCoupling { joints: 1 });
}

#[test]
fn a_handle_out_of_the_arm_s_rigid_reach() {
    let text = refusal(|e| {
        e.drive = Drive::Handle {
            path: HandlePath::fixed([5.0, 0.0]).expect("a point"),
            coupling: Coupling::Rigid,
        };
        e.start = Start::Given {
            q: [-1.0, 1.0, 0.0].into(),
            qd: [0.0; 3].into(),
        };
    });
    assert!(text.contains("from the handle"), "{text}");
}

#[test]
fn a_drive_that_ends_too_early() {
    let path = HandlePath::through_points(&[0.0, 0.05], &[[0.5, 0.0], [0.5, 0.1]]).expect("a path");
    let text = refusal(|e| {
        e.drive = Drive::Handle {
            path,
            coupling: Coupling::Compliant,
        };
    });
    assert!(text.contains("0.05 s") && text.contains("0.1 s"), "{text}");
}

#[test]
fn samples_that_are_no_function_of_time() {
    let make = |times: &[f64], values: &[[f64; 1]]| {
        Series::new("torque", times, values, Interpolation::Linear)
            .expect_err("refused")
            .to_string()
    };
    assert!(make(&[0.0, 0.0], &[[1.0], [2.0]]).contains("sample 2: time does not increase"));
    assert!(make(&[0.0, 1.0], &[[1.0], [f64::NAN]]).contains("sample 2: not finite"));
    assert!(make(&[0.0], &[[1.0]]).contains("at least two"));
    assert!(make(&[0.0, 1.0], &[[1.0]]).contains("missing"));
}

/// A state that overflows stops the run with step, time and joint, and the record so far is kept.
#[test]
fn a_diverging_state_keeps_the_record() {
    let mut experiment = smooth(0.1);
    let torque = [
        [0.0; 3],
        [0.0, 0.0, 0.0],
        [0.0, 1e308, 0.0],
        [0.0, 1e308, 0.0],
    ];
    let series = Series::new(
        "torque",
        &[0.0, 0.05, 0.050_000_1, 0.2],
        &torque,
        Interpolation::Hold,
    );
    experiment.drive = Drive::Torque(Some(series.expect("a series")));
    experiment.start = Start::Given {
        q: [0.0; 3].into(),
        qd: [0.0; 3].into(),
    };
    let partial = simulate_partial(&experiment).expect("it starts");
    let Some(SimulationError::Diverged { step, time, .. }) = partial.stopped else {
        panic!("it did not diverge");
    };
    assert!((0.05..0.06).contains(&time), "{time}");
    assert_eq!(partial.recording.len(), step);
    assert!(partial.recording.q.iter().all(|q| q.is_finite()));
    assert!(simulate(&experiment).is_err());
}
