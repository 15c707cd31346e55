//! Functions of time from samples, and paths from robot angles and points.

use arm_core::{Limits, Shape, sample_arms};
use arm_sim::{HandlePath, Interpolation, Movement, Series};

#[test]
fn a_cubic_through_samples_of_a_cubic_is_that_cubic() {
    let cubic = |t: f64| [1.0 - 2.0 * t + 3.0 * t * t - 0.5 * t * t * t];
    for times in [
        vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
        vec![-1.0, 0.2, 0.5, 1.7, 2.0],
    ] {
        let values: Vec<_> = times.iter().map(|&t| cubic(t)).collect();
        let s = Series::new("x", &times, &values, Interpolation::Cubic).expect("samples");
        for i in 0..=50 {
            let t = s.start() + (s.end() - s.start()) * f64::from(i) / 50.0;
            let jet = s.at(t);
            assert!((jet.value[0] - cubic(t)[0]).abs() < 1e-13, "value at {t}");
            assert!(
                (jet.rate[0] - (-2.0 + 6.0 * t - 1.5 * t * t)).abs() < 1e-12,
                "rate at {t}"
            );
            assert!(
                (jet.curvature[0] - (6.0 - 3.0 * t)).abs() < 1e-10,
                "curvature at {t}"
            );
        }
    }
}

#[test]
fn few_samples_give_a_line_and_a_parabola() {
    let line = Series::new("x", &[0.0, 2.0], &[[1.0], [5.0]], Interpolation::Cubic).expect("two");
    assert!((line.at(0.5).value[0] - 2.0).abs() < 1e-15);
    let values = [[0.0], [1.0], [9.0]];
    let parabola =
        Series::new("x", &[0.0, 1.0, 3.0], &values, Interpolation::Cubic).expect("three");
    assert!((parabola.at(2.0).value[0] - 4.0).abs() < 1e-14);
}

#[test]
fn hold_and_linear_are_what_they_say() {
    let (times, values) = ([0.0, 1.0, 2.0], [[0.0], [10.0], [20.0]]);
    let hold = Series::new("x", &times, &values, Interpolation::Hold).expect("samples");
    let linear = Series::new("x", &times, &values, Interpolation::Linear).expect("samples");
    assert_eq!((hold.at(0.9).value[0], hold.at(1.0).value[0]), (0.0, 10.0));
    assert_eq!(
        (linear.at(0.5).value[0], linear.at(1.0).value[0]),
        (5.0, 10.0)
    );
}

/// The spline through samples of a smooth path converges to it with the fourth order.
#[test]
fn paths_from_the_robot_and_from_points_agree_with_the_arm_path() {
    let arm = sample_arms::human_arm();
    let waypoints =
        [[-68.0f64, 40.0, 0.0], [-56.0, 80.0, 5.0]].map(|q| q.map(f64::to_radians).into());
    let movement = Movement::timed(Shape::Smooth, &waypoints, &[2.0], 0.5).expect("a movement");
    let path = HandlePath::of_arm(arm, movement);
    let robot = arm_sim::sample_experiments::robot().expect("a robot");
    let times: Vec<f64> = (0..=200).map(|i| 0.01 * f64::from(i)).collect();
    let points: Vec<_> = times.iter().map(|&t| path.at(t).position).collect();
    let angles: Vec<_> = times
        .iter()
        .map(|&t| path.robot_motion(&robot, t).expect("in reach").q.into())
        .collect();
    let by_points = HandlePath::<3>::through_points(&times, &points).expect("a path");
    let by_robot = HandlePath::<3>::of_robot(robot, &times, &angles).expect("a path");
    for i in 0..400 {
        let t = 0.005 * f64::from(i);
        let exact = path.at(t);
        for other in [by_points.at(t), by_robot.at(t)] {
            for axis in 0..2 {
                assert!(
                    (exact.position[axis] - other.position[axis]).abs() < 1e-7,
                    "at {t}"
                );
                assert!(
                    (exact.velocity[axis] - other.velocity[axis]).abs() < 1e-5,
                    "at {t}"
                );
            }
        }
    }
}

/// Velocity and acceleration are the derivatives of the position.
#[test]
fn the_path_of_an_arm_is_consistent() {
    let waypoints = [[-1.2, 0.7], [-0.9, 1.4], [-1.0, 1.0]].map(Into::into);
    let limit = Limits {
        speed: 0.5,
        acceleration: 1.0,
    };
    let movement =
        Movement::within(Shape::Smooth, &waypoints, &[limit; 2], 0.3).expect("a movement");
    let path = HandlePath::of_arm(sample_arms::mechanical_arm(), movement.clone());
    let h = 1e-5;
    for i in 1..100 {
        let t = movement.duration() * f64::from(i) / 100.0 + 1e-3;
        let (before, now, after) = (path.at(t - h), path.at(t), path.at(t + h));
        for axis in 0..2 {
            let v = (after.position[axis] - before.position[axis]) / (2.0 * h);
            let a = (after.velocity[axis] - before.velocity[axis]) / (2.0 * h);
            assert!((v - now.velocity[axis]).abs() < 1e-8, "velocity at {t}");
            assert!(
                (a - now.acceleration[axis]).abs() < 2e-4,
                "acceleration at {t}"
            );
        }
    }
}
