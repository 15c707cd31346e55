//! Profiles and waypoints: exact ends, limits, symmetry, derivatives, joints that move together.

use arm_core::{Invalid, Joints, Lanes, Limits, Path, Profile, Route, Sample, Scalar, Shape};

use crate::common::Random;

const SHAPES: [Shape; 2] = [Shape::Trapezoid, Shape::Smooth];
/// Rounding of a few products, relative.
const ROUNDING: f64 = 1e-14;

fn random_profiles(shape: Shape, seed: u64) -> impl Iterator<Item = (Profile<f64>, Limits<f64>)> {
    let mut random = Random(seed);
    (0..300).map(move |_| {
        let limits = Limits {
            speed: random.uniform(0.05, 2.0),
            acceleration: random.uniform(0.1, 5.0),
        };
        let distance = random.uniform(-2.0, 2.0);
        let profile = Profile::new(shape, distance, limits).expect("limits are positive");
        (profile, limits)
    })
}

/// Speed at half time.
fn peak_speed(p: &Profile<f64>) -> f64 {
    p.at(0.5 * p.duration()).velocity
}

#[test]
fn starts_and_ends_exactly() {
    for shape in SHAPES {
        for (p, _) in random_profiles(shape, 21) {
            let end = p.at(p.duration());
            assert_eq!(p.at(0.0).position, 0.0);
            assert_eq!(end.position, p.distance());
            assert_eq!((p.at(0.0).velocity, end.velocity), (0.0, 0.0));
            let before = p.at(-1.0);
            let after = p.at(p.duration() + 1.0);
            assert_eq!(
                (before.position, before.velocity, before.acceleration),
                (0.0, 0.0, 0.0)
            );
            assert_eq!(after.position, p.distance());
            assert_eq!((after.velocity, after.acceleration), (0.0, 0.0));
        }
    }
}

#[test]
fn keeps_its_limits_and_reaches_one_of_them() {
    for shape in SHAPES {
        let mut cruising = 0;
        for (p, limits) in random_profiles(shape, 22) {
            let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
            for i in 0..=2000 {
                // Half of them within the first ramp, which may be short.
                let span = if i % 2 == 0 { p.ramp() } else { p.duration() };
                let at = p.at(span * f64::from(i) / 2000.0);
                speed = speed.max(at.velocity.abs());
                acceleration = acceleration.max(at.acceleration.abs());
            }
            assert!(speed <= limits.speed * (1.0 + ROUNDING));
            assert!(acceleration <= limits.acceleration * (1.0 + ROUNDING));
            assert!(acceleration > 0.99 * limits.acceleration);
            assert!((peak_speed(&p).abs() - speed) < 1e-2 * speed);
            if 2.0 * p.ramp() < p.duration() * (1.0 - ROUNDING) {
                cruising += 1;
                assert!(speed > limits.speed * (1.0 - ROUNDING));
            }
        }
        // Both cases have been seen.
        assert!((20..280).contains(&cruising), "{cruising}");
    }
}

#[test]
fn is_symmetric_in_time() {
    for shape in SHAPES {
        for (p, _) in random_profiles(shape, 23) {
            for i in 1..50 {
                let t = p.duration() * f64::from(i) / 50.0;
                let (a, b) = (p.at(t), p.at(p.duration() - t));
                let scale = p.distance().abs() + peak_speed(&p).abs();
                assert!((a.position + b.position - p.distance()).abs() < ROUNDING * scale);
                assert!((a.velocity - b.velocity).abs() < 10.0 * ROUNDING * scale);
            }
        }
    }
}

#[test]
fn velocity_and_acceleration_are_derivatives() {
    let step = 1e-6;
    for shape in SHAPES {
        for (p, limits) in random_profiles(shape, 24) {
            for i in 1..40 {
                let t = p.duration() * (f64::from(i) + 0.37) / 41.0;
                let kinks = [p.ramp(), 0.5 * p.duration(), p.duration() - p.ramp()];
                if kinks.iter().any(|k| (t - k).abs() < 2.0 * step) {
                    continue;
                }
                let (before, at, after) = (p.at(t - step), p.at(t), p.at(t + step));
                let velocity = (after.position - before.position) / (2.0 * step);
                let acceleration = (after.velocity - before.velocity) / (2.0 * step);
                assert!((velocity - at.velocity).abs() < 1e-8);
                assert!((acceleration - at.acceleration).abs() < 1e-5 * limits.acceleration);
            }
        }
    }
}

#[test]
fn smooth_has_continuous_acceleration() {
    for (p, limits) in random_profiles(Shape::Smooth, 25) {
        // Its slope in a ramp is at most 4 times limit over ramp; a jump would show at any step.
        let n = 20_000;
        let step = p.duration() / f64::from(n);
        let allowed = 4.0 * limits.acceleration / p.ramp() * step * 1.01;
        let mut before = p.at(0.0).acceleration;
        assert_eq!(before, 0.0);
        for i in 1..=n {
            let now = p.at(step * f64::from(i)).acceleration;
            assert!((now - before).abs() <= allowed);
            before = now;
        }
    }
}

#[test]
fn arithmetic_in_the_head() {
    let limits = Limits {
        speed: 1.0,
        acceleration: 2.0,
    };
    // 0.5 s and 0.25 rad in each ramp, 1.5 s of cruise.
    let p = Profile::new(Shape::Trapezoid, 2.0, limits).expect("valid");
    assert_eq!((p.duration(), p.ramp(), peak_speed(&p)), (2.5, 0.5, 1.0));
    assert_eq!(
        p.at(0.25),
        Sample {
            position: 0.0625,
            velocity: 0.5,
            acceleration: 2.0
        }
    );
    assert_eq!(
        p.at(1.25),
        Sample {
            position: 1.0,
            velocity: 1.0,
            acceleration: 0.0
        }
    );
    assert_eq!(
        p.at(2.25),
        Sample {
            position: 1.9375,
            velocity: 0.5,
            acceleration: -2.0
        }
    );
    // Triangular: 0.125 rad up to √(0.125·2) = 0.5 rad/s in 0.25 s.
    let p = Profile::new(Shape::Trapezoid, 0.125, limits).expect("valid");
    assert_eq!((p.duration(), p.ramp(), peak_speed(&p)), (0.5, 0.25, 0.5));
    // The smooth ramp lasts 1.5 times as long: 0.75 s.
    let p = Profile::new(Shape::Smooth, 2.0, limits).expect("valid");
    assert_eq!((p.duration(), p.ramp()), (2.75, 0.75));
    assert_eq!(p.at(0.375).acceleration, 2.0);
    // The movement of the benchmark: half a run of 10 s with ramps of 1 s.
    let p = Profile::timed(Shape::Trapezoid, 9.0, 10.0, 1.0).expect("valid");
    assert_eq!((peak_speed(&p), p.at(5.0).position), (1.0, 4.5));
}

#[test]
fn no_way_takes_no_time() {
    for shape in SHAPES {
        let limits = Limits {
            speed: 1.0,
            acceleration: 1.0,
        };
        let p = Profile::new(shape, 0.0, limits).expect("valid");
        assert_eq!(p.duration(), 0.0);
        for t in [-1.0, 0.0, 1.0] {
            let at = p.at(t);
            assert_eq!((at.position, at.velocity, at.acceleration), (0.0, 0.0, 0.0));
        }
    }
}

fn limits() -> [Limits<f64>; 3] {
    [(0.3, 1.2), (0.5, 0.6), (1.0, 2.0)].map(|(speed, acceleration)| Limits {
        speed,
        acceleration,
    })
}

fn waypoints(seed: u64) -> [Joints<f64, 3>; 5] {
    let mut random = Random(seed);
    core::array::from_fn(|_| random.joints(1.5))
}

#[test]
fn path_passes_every_waypoint_at_rest() {
    for shape in SHAPES {
        let points = waypoints(26);
        let path = Path::new(shape, &points, limits(), 0.5).expect("valid");
        let mut time = 0.0;
        for pair in points.windows(2) {
            let part = (0..3).fold(0.0, |longest, i| {
                let alone = Profile::new(shape, pair[1][i] - pair[0][i], limits()[i]);
                f64::max(longest, alone.expect("valid").duration())
            });
            time += part;
            // Together they take no less than the slowest joint alone, and with one pace for all not much more.
            let arrived = (0..100)
                .map(|i| time + 0.01 * f64::from(i))
                .find(|&t| path.at(t).q == pair[1]);
            time = arrived.expect("the waypoint is met exactly");
            assert!(path.at(time + 0.2).qd.amax() == 0.0 && path.at(time + 0.2).q == pair[1]);
            time += 0.5;
        }
        assert_eq!(path.at(0.0).q, points[0]);
        assert_eq!(path.at(-1.0).q, points[0]);
        assert_eq!(path.at(path.duration()).q, points[4]);
        assert_eq!(path.at(path.duration() + 9.0).q, points[4]);
    }
}

#[test]
fn joints_move_together_within_their_limits() {
    for shape in SHAPES {
        let points = waypoints(27);
        let pair = [points[0], points[1]];
        let path = Path::new(shape, &pair, limits(), 0.0).expect("valid");
        let way = pair[1] - pair[0];
        let (mut fullest, n) = (0.0_f64, 4000);
        for i in 1..n {
            let motion = path.at(path.duration() * f64::from(i) / f64::from(n));
            for (j, limit) in limits().iter().enumerate() {
                let share = (motion.q[j] - pair[0][j]) / way[j];
                let first = (motion.q[0] - pair[0][0]) / way[0];
                assert!((share - first).abs() < 1e-13, "joints are apart");
                let speed = motion.qd[j].abs() / limit.speed;
                let acceleration = motion.qdd[j].abs() / limit.acceleration;
                assert!(speed <= 1.0 + ROUNDING && acceleration <= 1.0 + ROUNDING);
                fullest = fullest.max(speed).max(acceleration);
            }
        }
        assert!(fullest > 0.999, "the slowest joint sets the pace");
    }
}

#[test]
fn path_derivatives_by_differences() {
    let step = 1e-6;
    let points = waypoints(28);
    let path = Path::new(Shape::Smooth, &points, limits(), 0.3).expect("valid");
    for i in 1..500 {
        let t = path.duration() * f64::from(i) / 500.0;
        let (before, at, after) = (path.at(t - step), path.at(t), path.at(t + step));
        assert!(((after.q - before.q) / (2.0 * step) - at.qd).amax() < 1e-8);
        assert!(((after.qd - before.qd) / (2.0 * step) - at.qdd).amax() < 1e-4);
    }
}

#[test]
fn lanes_are_single_runs() {
    for shape in SHAPES {
        let mut random = Random(29);
        let pairs: [[Joints<f64, 3>; 3]; 4] =
            core::array::from_fn(|_| core::array::from_fn(|_| random.joints(1.0)));
        let lanes: [Joints<Lanes<4>, 3>; 3] = core::array::from_fn(|w| {
            Joints::from_fn(|i, _| Lanes(core::array::from_fn(|lane| pairs[lane][w][i])))
        });
        let wide = limits().map(|l| Limits {
            speed: Lanes::of(l.speed),
            acceleration: Lanes::of(l.acceleration),
        });
        let together = Path::new(shape, &lanes, wide, Lanes::of(0.1)).expect("valid");
        for i in 0..100 {
            let t = 0.1 * f64::from(i);
            let wide = together.at(Lanes::of(t));
            for (lane, pair) in pairs.iter().enumerate() {
                let path = Path::new(shape, pair, limits(), 0.1).expect("valid");
                let single = path.at(t);
                for j in 0..3 {
                    assert_eq!(single.q[j].to_bits(), wide.q[j].0[lane].to_bits());
                    assert_eq!(single.qd[j].to_bits(), wide.qd[j].0[lane].to_bits());
                    assert_eq!(single.qdd[j].to_bits(), wide.qdd[j].0[lane].to_bits());
                }
            }
        }
    }
}

#[test]
fn refused_motions() {
    let limit = |speed, acceleration| Limits {
        speed,
        acceleration,
    };
    let profile = |d, l| Profile::new(Shape::Smooth, d, l).map(|_| ());
    let text = |r: Result<(), Invalid>| r.unwrap_err().to_string();
    assert_eq!(profile(1.0, limit(1.0, 1.0)), Ok(()));
    assert!(text(profile(f64::NAN, limit(1.0, 1.0))).contains("distance"));
    assert!(text(profile(1.0, limit(0.0, 1.0))).contains("speed limit"));
    assert!(text(profile(1.0, limit(1.0, -1.0))).contains("acceleration limit"));
    let timed = |duration, ramp| Profile::timed(Shape::Trapezoid, 1.0, duration, ramp).map(|_| ());
    assert_eq!(timed(2.0, 1.0), Ok(()));
    assert!(text(timed(2.0, 1.1)).contains("duration of cruise"));
    assert!(text(timed(2.0, 0.0)).contains("duration of ramp"));
    assert!(text(timed(-2.0, 1.0)).contains("duration of motion"));
    let points = waypoints(30);
    let path = |points: &[Joints<f64, 3>], limits, pause| {
        Path::new(Shape::Smooth, points, limits, pause).map(|_| ())
    };
    assert_eq!(path(&points, limits(), 0.0), Ok(()));
    assert!(text(path(&[], limits(), 0.0)).contains("number of waypoints"));
    assert!(text(path(&points, limits(), -0.1)).contains("pause"));
    let mut wrong = points;
    wrong[3][1] = f64::INFINITY;
    assert!(text(path(&wrong, limits(), 0.0)).contains("waypoint 4 is not finite"));
    let mut wrong = limits();
    wrong[2].speed = 0.0;
    assert!(text(path(&points, wrong, 0.0)).contains("speed limit 3"));
}

#[test]
fn a_route_has_the_bits_of_its_path() {
    let mut random = Random(77);
    let waypoints: [Joints<f64, 3>; 5] = core::array::from_fn(|_| random.joints(1.0));
    let limits = [Limits {
        speed: 0.7,
        acceleration: 3.0,
    }; 3];
    for shape in [Shape::Trapezoid, Shape::Smooth] {
        let path = Path::new(shape, &waypoints, limits, 0.2).expect("a path");
        let route = Route::<f64, 3, 8>::new(&path).expect("room for five");
        assert_eq!(route.duration(), path.duration());
        for k in -10..1000 {
            let t = f64::from(k) * path.duration() / 900.0;
            assert_eq!(route.at(t), path.at(t), "at {t}");
        }
        assert!(Route::<f64, 3, 4>::new(&path).is_err());
    }
}
