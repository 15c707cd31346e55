//! The two-link robot: round trips, derivatives, sides of the elbow, and the limits of its reach.

use arm_core::{Elbow, Invalid, Joints, Lanes, Plane, Robot, Scalar};

use crate::common::Random;

const SIDES: [Elbow; 2] = [Elbow::Up, Elbow::Down];
/// Rounding of a few products of order one.
const ROUNDING: f64 = 1e-14;

fn random_robot(random: &mut Random, elbow: Elbow) -> Robot<f64> {
    let lengths = [random.uniform(0.2, 0.6), random.uniform(0.2, 0.6)];
    let base = [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)];
    Robot::new(lengths, base, elbow).expect("lengths are positive")
}

/// A point within reach, at least a fraction `margin` of the span away from full stretch and full fold.
fn reachable(robot: &Robot<f64>, random: &mut Random, margin: f64) -> Plane<f64> {
    let [min, max] = robot.reach();
    let distance = min + (max - min) * random.uniform(margin, 1.0 - margin);
    let (sin, cos) = Scalar::sin_cos(random.uniform(-3.2, 3.2));
    let [y, z] = robot.base();
    [y + distance * cos, z + distance * sin]
}

fn apart(a: Plane<f64>, b: Plane<f64>) -> f64 {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
}

#[test]
fn handle_of_angles_is_the_point() {
    let mut random = Random(11);
    for elbow in SIDES {
        for _ in 0..1000 {
            let robot = random_robot(&mut random, elbow);
            let point = reachable(&robot, &mut random, 0.0);
            let q = robot.angles(point).expect("the point is within reach");
            assert!(apart(robot.handle(&q), point) < ROUNDING);
        }
    }
}

#[test]
fn angles_of_handle_are_the_angles() {
    let mut random = Random(12);
    for _ in 0..1000 {
        let robot = random_robot(&mut random, Elbow::Up);
        // Up, in front of the base: the second angle is negative, and the handle is at greater y.
        let bend = random.uniform(0.05, 3.1);
        let ahead = random.uniform(-1.5, 1.5);
        let [a, b] = robot.lengths();
        let (sin, cos) = Scalar::sin_cos(bend);
        let q = Joints::<f64, 2>::new(ahead + libm::atan2(b * sin, a + b * cos), -bend);
        let back = robot.angles(robot.handle(&q)).expect("it is there");
        // Near a fold onto the base the direction is lost with the distance.
        let near = robot.reach()[1] / (apart(robot.handle(&q), robot.base()) + 1e-9);
        assert!((back - q).amax() < 1e-13 * near, "{q} {back}");
    }
}

#[test]
fn elbow_is_above_or_below_the_line() {
    let mut random = Random(13);
    for elbow in SIDES {
        for _ in 0..1000 {
            let robot = random_robot(&mut random, elbow);
            let point = reachable(&robot, &mut random, 0.01);
            let q = robot.angles(point).expect("the point is within reach");
            let [y, z] = [point[0] - robot.base()[0], point[1] - robot.base()[1]];
            let (sin, cos) = Scalar::sin_cos(q[0]);
            let [ey, ez] = [robot.lengths()[0] * cos, robot.lengths()[0] * sin];
            // Height of the elbow over the line through base and handle, at the elbow's y.
            let over = ez - z / y * ey;
            assert_eq!(over > 0.0, elbow == Elbow::Up, "{point:?}");
            assert_eq!(q[1] < 0.0, (elbow == Elbow::Up) == (y > 0.0));
        }
    }
}

#[test]
fn angles_are_continuous_on_each_side_of_the_base() {
    let robot = Robot::new([0.45, 0.45], [1.05, -0.1], Elbow::Up).expect("valid");
    for side in [-1.0, 1.0] {
        let mut before: Option<Joints<f64, 2>> = None;
        for i in 0..=1000 {
            let (sin, cos) = Scalar::sin_cos(1.57 * (f64::from(i) / 500.0 - 1.0));
            let point = [1.05 + side * 0.6 * cos, -0.1 + 0.6 * sin];
            let q = robot.angles(point).expect("within reach");
            if let Some(before) = before {
                assert!((q - before).amax() < 0.004, "step {i}: {before} {q}");
            }
            before = Some(q);
        }
    }
}

#[test]
fn arithmetic_in_the_head() {
    let robot = Robot::new([3.0, 4.0], [1.0, 2.0], Elbow::Up).expect("valid");
    assert_eq!(robot.reach(), [1.0, 7.0]);
    assert_eq!(robot.handle(&Joints::<f64, 2>::new(0.0, 0.0)), [8.0, 2.0]);
    // A right angle at the elbow: the handle is 5 m away, straight ahead.
    let q = robot.angles([6.0, 2.0]).expect("within reach");
    assert!((q[1] + core::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert!((q[0] - libm::atan2(4.0, 3.0)).abs() < 1e-15);
    // Link one along y, link two along z: each joint moves one axis.
    let q = Joints::<f64, 2>::new(0.0, core::f64::consts::FRAC_PI_2);
    let qd = robot.speeds(&q, [-4.0, 3.0]);
    assert!((qd - Joints::<f64, 2>::new(1.0, 0.0)).amax() < ROUNDING);
    // Turning as a whole at 1 rad/s: only the centripetal acceleration, 5 m/s² towards the base.
    let acceleration = robot.handle_acceleration(&q, &qd, &Joints::zeros());
    assert!(apart(acceleration, [-3.0, -4.0]) < ROUNDING);
}

#[test]
fn speeds_and_accelerations_by_differences() {
    let mut random = Random(14);
    let step = 1e-4;
    for elbow in SIDES {
        for _ in 0..200 {
            let robot = random_robot(&mut random, elbow);
            let point = reachable(&robot, &mut random, 0.2);
            if (point[0] - robot.base()[0]).abs() < 0.01 {
                continue; // The elbow changes sides here.
            }
            let velocity = [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)];
            let acceleration = [random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0)];
            let at = |t: f64| {
                let p = core::array::from_fn(|i| {
                    point[i] + velocity[i] * t + 0.5 * acceleration[i] * t * t
                });
                robot.angles(p).expect("a small step stays within reach")
            };
            let (q, before, after) = (at(0.0), at(-step), at(step));
            let qd = robot.speeds(&q, velocity);
            let qdd = robot.accelerations(&q, &qd, acceleration);
            let scale = 1.0 + qd.amax();
            let by_differences = (after - before) / (2.0 * step);
            assert!((by_differences - qd).amax() < 2e-5 * scale * scale * scale);
            let twice = (after - q * 2.0 + before) / (step * step);
            assert!((twice - qdd).amax() < 1e-3 * scale.powi_4());
            // Exactly back through the Jacobian.
            let j = robot.jacobian(&q) * qd;
            assert!(apart([j[0], j[1]], velocity) < 1e-12);
            assert!(apart(robot.handle_velocity(&q, &qd), velocity) < 1e-12);
            assert!(apart(robot.handle_acceleration(&q, &qd, &qdd), acceleration) < 1e-11 * scale);
        }
    }
}

trait FourthPower {
    fn powi_4(self) -> f64;
}
impl FourthPower for f64 {
    fn powi_4(self) -> f64 {
        let square = self * self;
        square * square
    }
}

#[test]
fn full_stretch_is_reached_and_singular() {
    for elbow in SIDES {
        let robot = Robot::new([0.5, 0.25], [0.0, 0.0], elbow).expect("valid");
        let straight = robot.angles([0.75, 0.0]).expect("just reached");
        assert_eq!((straight[0], straight[1]), (0.0, 0.0));
        let folded = robot.angles([0.25, 0.0]).expect("just reached");
        assert_eq!(folded[1].abs(), core::f64::consts::PI);
        assert!(apart(robot.handle(&folded), [0.25, 0.0]) < ROUNDING);
        // Along the links the handle cannot move.
        let qd = robot.speeds(&straight, [1.0, 0.0]);
        assert!(!qd[0].is_finite() && !qd[1].is_finite());
        // Close to it the speeds grow as one over the sine of the bend.
        for bend in [1e-2, 1e-4, 1e-6] {
            let q = Joints::<f64, 2>::new(0.0, bend);
            let qd = robot.speeds(&q, [1.0, 0.0]);
            let expected = 1.0 / (0.5 * Scalar::sin_cos(bend).0);
            assert!((qd[0] * Scalar::sin_cos(bend).1.recip() / expected - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn angles_are_accurate_near_full_stretch() {
    let robot = Robot::new([0.45, 0.45], [0.0, 0.0], Elbow::Down).expect("valid");
    for bend in [1e-3, 1e-5, 1e-7] {
        // The distance is 0.9 cos(bend/2): its rounding of 1e-16 is worth 1e-16/(0.225 bend) in the bend.
        let q = Joints::<f64, 2>::new(-0.5 * bend, bend);
        let back = robot.angles(robot.handle(&q)).expect("within reach");
        assert!((back[1] - bend).abs() < 2e-15 / bend, "{bend} {}", back[1]);
    }
}

#[test]
fn points_out_of_reach_are_named() {
    let robot = Robot::new([0.5, 0.25], [1.0, 1.0], Elbow::Up).expect("valid");
    let far = robot.angles([1.0, 1.8]);
    assert!(
        matches!(far, Err(Invalid::OutOfReach { distance, min, max })
            if (distance - 0.8).abs() < 1e-15 && min == 0.25 && max == 0.75)
    );
    let near = robot.angles([1.0, 1.1]);
    assert!(
        matches!(near, Err(Invalid::OutOfReach { distance, .. }) if (distance - 0.1).abs() < 1e-15)
    );
    assert_eq!(
        robot.angles([f64::NAN, 0.0]),
        Err(Invalid::NotFinite {
            name: "handle coordinate",
            index: 0
        })
    );
    assert!(
        far.unwrap_err()
            .to_string()
            .contains("its reach is 0.25 m to 0.75 m")
    );
    // Rounding of a point at the edge is not refused.
    assert!(robot.angles([1.0 + 0.75 * (1.0 + 1e-15), 1.0]).is_ok());
}

#[test]
fn refused_robots() {
    let new = |a, b, y| Robot::new([a, b], [y, 0.0], Elbow::Up).map(|_| ());
    assert_eq!(new(0.45, 0.45, 1.0), Ok(()));
    for (result, name) in [
        (new(0.0, 0.45, 1.0), "length of robot link"),
        (new(0.45, -0.1, 1.0), "length of robot link"),
        (new(f64::INFINITY, 0.45, 1.0), "length of robot link"),
        (new(0.45, 0.45, f64::NAN), "robot base coordinate"),
    ] {
        let text = result.unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
    }
}

#[test]
fn lanes_are_single_runs() {
    let mut random = Random(15);
    for elbow in SIDES {
        let single = random_robot(&mut random, elbow);
        let of = Lanes::<4>::of;
        let [a, b] = single.lengths();
        let [y, z] = single.base();
        let robot = Robot::new([of(a), of(b)], [of(y), of(z)], elbow).expect("valid");
        let points: [Plane<f64>; 4] =
            core::array::from_fn(|_| reachable(&single, &mut random, 0.1));
        let lanes = robot
            .angles([Lanes(points.map(|p| p[0])), Lanes(points.map(|p| p[1]))])
            .expect("within reach");
        for (lane, &point) in points.iter().enumerate() {
            let q = single.angles(point).expect("within reach");
            for i in 0..2 {
                assert_eq!(q[i].to_bits(), lanes[i].0[lane].to_bits());
            }
        }
        let one_far = [Lanes([y + a, y + a, y + 9.0, y + a]), of(z)];
        assert!(
            matches!(robot.angles(one_far), Err(Invalid::OutOfReach { distance, .. }) if (distance - 9.0).abs() < 1e-12)
        );
    }
}
