//! Forecasts and plans: what follows from more trials, less noise and wider limits, and what no plan may do.

use arm_core::effect::{Effect, Kind};
use arm_core::{Contact, Elbow, Joints, Robot, Shape, sample_arms};
use arm_ident::IdentError;
use arm_ident::experiment_design::design::{Allowed, design};
use arm_ident::experiment_design::forecast::{Accuracy, Question, Task, forecast};
use arm_ident::movement_limits::{Excess, Limit};
use arm_ident::regression::trial::{Model, Tolerance};

fn question(tolerance: Tolerance) -> Question<2> {
    Question {
        model: Model {
            chain: sample_arms::mechanical_arm(),
            segment_uncertainty: 0.1,
            fitted: vec![
                Effect::new(Kind::Coulomb, 0).with(&[0.139]),
                Effect::new(Kind::Coulomb, 1).with(&[0.161]),
            ],
            held: Vec::new(),
            contact: Contact::new([1e4; 2], [25.0; 2]),
        },
        robot: None,
        tolerance,
        accuracy: Accuracy {
            rate: 50.0,
            cutoff: 5.0,
            force: 0.2,
            angle: 0.1_f64.to_radians(),
        },
    }
}

const EXACT: Tolerance = Tolerance {
    angle_offset_deg: 0.0,
    force_bias: 0.0,
    force_gain: 0.0,
    time_delay: 0.0,
    handle_placement: 0.0,
};

fn task(repeats: usize) -> Task<2> {
    let at = |a: f64, b: f64| Joints::<f64, 2>::new(a.to_radians(), b.to_radians());
    Task {
        waypoints: vec![at(-60.0, 50.0), at(-30.0, 90.0), at(-60.0, 50.0)],
        speed: 1.0,
        acceleration: 4.0,
        shape: Shape::Smooth,
        pause: 0.0,
        repeats,
    }
}

fn allowed(evaluations: usize) -> Allowed<2> {
    Allowed {
        angle: [[-1.4, -0.2], [0.4, 1.9]],
        speed: 2.0,
        acceleration: 8.0,
        robot_speed: f64::INFINITY,
        robot_acceleration: f64::INFINITY,
        force: 60.0,
        duration: 15.0,
        speeds: vec![1.0, 0.3],
        waypoints: 4,
        repeats: 5,
        evaluations,
        seed: 3,
    }
}

#[test]
fn four_times_the_trials_halve_what_noise_leaves() {
    let question = question(EXACT);
    let of = |repeats| forecast(&question, &[task(repeats)]).expect("a forecast");
    let (few, many) = (of(3), of(12));
    assert_eq!(few.predicted.len(), 6);
    for (a, b) in few.predicted.iter().zip(&many.predicted) {
        let ratio = a.std_of_data / b.std_of_data;
        assert!((ratio - 2.0).abs() < 1e-3, "{}: {ratio}", a.name);
        // What is known beforehand never hurts.
        assert!(a.std <= a.std_of_data * (1.0 + 1e-9), "{}", a.name);
    }
    assert!((many.duration / few.duration - 4.0).abs() < 1e-9);
}

#[test]
fn deviations_grow_with_the_noise_and_stay_above_the_calibration() {
    let mut noisy = question(EXACT);
    noisy.accuracy.force = 0.4;
    noisy.accuracy.angle *= 2.0;
    let plain = forecast(&question(EXACT), &[task(5)]).expect("a forecast");
    let twice = forecast(&noisy, &[task(5)]).expect("a forecast");
    let promised = forecast(&question(Tolerance::default()), &[task(5)]).expect("a forecast");
    for ((a, b), c) in plain
        .predicted
        .iter()
        .zip(&twice.predicted)
        .zip(&promised.predicted)
    {
        assert!(
            (b.std_of_data / a.std_of_data - 2.0).abs() < 1e-3,
            "{}",
            a.name
        );
        assert!(c.std_of_data >= a.std_of_data, "{}", a.name);
    }
    // A gain of 1 % in either axis: no first moment is known better than to 0.7 %.
    let elbow = &promised.predicted[1];
    assert!(elbow.std_of_data / elbow.value > 0.007);
}

#[test]
fn a_longer_search_is_no_worse_and_the_same_seed_gives_the_same_plan() {
    let question = question(Tolerance::default());
    let mut calls = 0;
    let plan = design(&question, &allowed(12), || calls += 1).expect("a plan");
    assert_eq!(calls, 12);
    let again = design(&question, &allowed(12), || {}).expect("a plan");
    assert_eq!(plan, again);
    let (tasks, first) = (plan.tasks, plan.forecast);
    let longer = design(&question, &allowed(40), || {})
        .expect("a plan")
        .forecast;
    assert!(longer.worst() <= 1.05 * first.worst());
    for (task, speed) in tasks.iter().zip([2.0, 0.6]) {
        assert_eq!(task.waypoints.len(), 5);
        assert_eq!(task.waypoints[0], task.waypoints[4]);
        assert!((task.speed - speed).abs() < 1e-12);
        for q in &task.waypoints {
            assert!((-1.4..=-0.2).contains(&q[0]) && (0.4..=1.9).contains(&q[1]));
        }
    }
    assert!(first.force <= 60.0 && first.speed <= 2.2);
}

#[test]
fn a_plan_respects_the_speed_and_the_acceleration_of_the_robot() {
    let mut question = question(Tolerance::default());
    question.robot = Some(Robot::new([0.45, 0.45], [1.0, -0.1], Elbow::Up).expect("valid"));
    let free = design(&question, &allowed(15), || {})
        .expect("a plan")
        .forecast;
    let limit = 0.7 * free.robot_speed;
    assert!(limit > 0.0);
    let slow = Allowed {
        robot_speed: limit,
        ..allowed(15)
    };
    let held = design(&question, &slow, || {}).expect("a plan").forecast;
    assert!(held.robot_speed <= limit);
    let free = design(&question, &allowed(60), || {})
        .expect("a plan")
        .forecast;
    let limit = 0.8 * free.robot_acceleration;
    assert!(limit > 0.0);
    let gentle = Allowed {
        robot_acceleration: limit,
        ..allowed(60)
    };
    let held = design(&question, &gentle, || {}).expect("a plan").forecast;
    assert!(held.robot_acceleration <= limit);
    // Without a robot there is neither.
    question.robot = None;
    let none = forecast(&question, &[task(1)]).expect("a forecast");
    assert_eq!(none.robot_speed.to_bits(), 0.0_f64.to_bits());
    assert_eq!(none.robot_acceleration.to_bits(), 0.0_f64.to_bits());
}

/// One movement whose forces are those of inertia.
fn quick() -> Allowed<2> {
    Allowed {
        speed: 5.0,
        acceleration: 60.0,
        force: f64::INFINITY,
        speeds: vec![1.0],
        ..allowed(1)
    }
}

#[test]
fn a_movement_that_asks_too_much_is_slowed_along_its_own_path() {
    let mut question = question(Tolerance::default());
    question.robot = Some(Robot::new([0.45, 0.45], [1.0, -0.1], Elbow::Up).expect("valid"));
    // One movement is tried: without slowing there would be no plan.
    let of = |bounds: &Allowed<2>| design(&question, bounds, || {}).expect("a slower plan");
    let fast = quick();
    let free = of(&fast);
    let force = 0.8 * free.forecast.force;
    let held = of(&Allowed { force, ..fast });
    let excess = held.slowed_for[0].expect("slowed");
    assert_eq!((excess.limit, excess.pace), (Limit::Force, 1.0));
    assert_eq!((excess.found, excess.allowed), (free.forecast.force, force));
    assert!(held.forecast.force <= force && held.forecast.force > 0.9 * force);
    let free = of(&allowed(1));
    assert_eq!(free.slowed_for, [None, None]);
    let acceleration = 0.5 * free.forecast.robot_acceleration;
    let held = of(&Allowed {
        robot_acceleration: acceleration,
        ..allowed(1)
    });
    let limits = [0, 1].map(|k| held.slowed_for[k].map(|e: Excess| e.limit));
    assert_eq!(limits, [Some(Limit::RobotAcceleration), None]);
    assert!(held.forecast.robot_acceleration <= acceleration);
    let (fast, slow) = (&free.tasks[0], &held.tasks[0]);
    assert_eq!(fast.waypoints, slow.waypoints);
    // Slower by a factor in time: half the acceleration at 1/√2 of the speed.
    let pace = slow.speed / fast.speed;
    assert_eq!(held.paces, [pace, 1.0]);
    assert!((pace - 0.5_f64.sqrt()).abs() < 0.05, "{pace}");
    assert!((slow.acceleration / fast.acceleration - pace * pace).abs() < 1e-12);
    assert_eq!(free.tasks[1], held.tasks[1]);
}

#[test]
fn limits_that_nothing_respects_are_an_error() {
    let tight = Allowed {
        force: 0.5,
        ..allowed(5)
    };
    let error = design(&question(Tolerance::default()), &tight, || {}).expect_err("no plan");
    let IdentError::NoPlan { nearest, .. } = error else {
        panic!("{error}");
    };
    // Dry friction alone takes more.
    assert_eq!((nearest.limit, nearest.allowed), (Limit::Force, 0.5));
    assert!(nearest.found > 0.5 && nearest.pace < 1.0);
    assert!(error.to_string().contains("none of 5 movements"));
    // What is left at the slowest pace is measured there: with a newton more there is a plan, and shorter trials leave none.
    let one = |force, duration| {
        let allowed = Allowed {
            force,
            duration,
            ..quick()
        };
        design(&question(Tolerance::default()), &allowed, || {})
    };
    let free = one(f64::INFINITY, 15.0).expect("a plan").forecast;
    let Err(IdentError::NoPlan { nearest, .. }) = one(0.5, 15.0) else {
        panic!("a plan")
    };
    assert!(nearest.found + 1.0 < free.force);
    let plan = one(nearest.found + 1.0, 15.0).expect("a plan");
    assert!(plan.paces[0] < 1.0 && plan.forecast.force <= nearest.found + 1.0);
    assert!(plan.forecast.durations[0] > free.durations[0] && plan.forecast.durations[0] <= 15.0);
    let longest = free.durations[0];
    let error = one(f64::INFINITY, 0.9 * longest).expect_err("too long");
    let text = format!("duration of a trial: found {longest:.3} s, allowed");
    assert!(error.to_string().contains(&text), "{error}");
    // Trials that may be hardly longer leave no room to slow.
    let error = one(nearest.found + 1.0, 1.05 * longest).expect_err("too much");
    assert!(
        matches!(&error, IdentError::NoPlan { nearest, .. } if nearest.limit == Limit::Force && nearest.pace > 0.9),
        "{error}"
    );
}
