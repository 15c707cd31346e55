//! Springs and dampers that pull an arm which the robot leads towards given angles.

use arm_core::effect::{Effect, Kind};
use arm_sim::{
    Assistance, Experiment, Interpolation, Series, Springs, digest, simulate, simulate_batch,
};

use crate::common::{largest, run, smooth};

const STIFFNESS: [f64; 3] = [4.0, 2.0, 0.5];
const DAMPING: [f64; 3] = [0.3, 0.2, 0.05];

fn helped(times: &[f64], towards: &[[f64; 3]]) -> Experiment<3> {
    let mut experiment = smooth(0.5);
    let series = Series::new("assistance", times, towards, Interpolation::Linear);
    experiment.assistance = Some(Assistance {
        towards: series.expect("a series"),
        springs: Springs {
            stiffness: STIFFNESS,
            damping: DAMPING,
        },
    });
    experiment
}

#[test]
fn towards_angles_at_rest_it_is_a_spring_and_a_damper_in_every_joint() {
    let rest = [0.3, -0.2, 0.4];
    let held = run(&helped(&[0.0, 0.5], &[rest; 2]));
    let mut experiment = smooth(0.5);
    experiment.effects.extend((0..3).flat_map(|j| {
        let spring = Effect::new(Kind::Elastic, j).with(&[STIFFNESS[j], rest[j]]);
        [spring, Effect::new(Kind::Viscous, j).with(&[DAMPING[j]])]
    }));
    let springs = run(&experiment);
    assert!(largest(&held.q, &springs.q) < 1e-10);
    assert!(largest(&held.force_on_arm, &springs.force_on_arm) < 1e-7);
    assert!(largest(&held.q, &run(&smooth(0.5)).q) > 1e-4, "it acts");
}

#[test]
fn a_speed_to_pull_towards_is_a_torque_of_the_dampers() {
    // From rest 0 at 1 rad/s: K t − K q and D − D q̇.
    let moving = run(&helped(&[0.0, 0.5], &[[0.0; 3], [0.5; 3]]));
    let mut still = helped(&[0.0, 0.5], &[[0.0; 3]; 2]);
    let moment = |j: usize| Effect::new(Kind::ConstantMoment, j).with(&[-DAMPING[j]]);
    still.effects.extend((0..3).map(moment));
    let mut sprung = still.clone();
    if let Some(assistance) = &mut sprung.assistance {
        let ends = [[0.0; 3], [0.5; 3]];
        let series = Series::new("assistance", &[0.0, 0.5], &ends, Interpolation::Linear);
        assistance.towards = series.expect("a series");
        assistance.springs.damping = [0.0; 3];
    }
    let damper = |j: usize| Effect::new(Kind::Viscous, j).with(&[DAMPING[j]]);
    sprung.effects.extend((0..3).map(damper));
    assert!(largest(&moving.q, &run(&sprung).q) < 1e-10);
    assert!(
        largest(&moving.q, &run(&still).q) > 1e-4,
        "the angle counts too"
    );
}

#[test]
fn runs_side_by_side_have_the_bits_of_each_by_itself() {
    let helped = [0.0, 0.5, 1.0].map(|end| helped(&[0.0, 0.5], &[[0.0; 3], [end; 3]]));
    let mut softer = helped[1].clone();
    if let Some(assistance) = &mut softer.assistance {
        assistance.springs.stiffness[1] *= 0.5;
    }
    let all = [helped.as_slice(), &[softer, smooth(0.5)]].concat();
    for (one, together) in all.iter().zip(simulate_batch(&all, 1)) {
        let together = together.expect("a run");
        assert_eq!(digest(&run(one)), digest(&together));
    }
}

#[test]
fn angles_that_end_before_the_run_are_refused() {
    let error = simulate(&helped(&[0.0, 0.4], &[[0.0; 3]; 2])).expect_err("too short");
    assert!(error.to_string().contains("the assistance"), "{error}");
}
