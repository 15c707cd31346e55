//! Refused arms: one thing of an accepted arm broken at a time.

use arm_core::{Chain, Invalid, Lanes, Scalar, Segment, sample_arms};

const SEGMENT: Segment<f64> = Segment {
    length: 0.3,
    mass: 1.0,
    com: [0.15, 0.0],
    inertia: 0.01,
};

fn arm(break_it: impl Fn(&mut [Segment<f64>; 3], &mut [f64; 2], &mut [f64; 2])) -> Option<String> {
    let (mut segments, mut base, mut gravity) = ([SEGMENT; 3], [0.0, 0.0], [0.0, -9.81]);
    break_it(&mut segments, &mut base, &mut gravity);
    Chain::new(segments, base, gravity)
        .err()
        .map(|e| e.to_string())
}

#[test]
fn one_broken_value_at_a_time() {
    assert_eq!(arm(|_, _, _| ()), None);
    // A weightless gravity and a point mass are physical.
    assert_eq!(arm(|_, _, gravity| *gravity = [0.0, 0.0]), None);
    assert_eq!(arm(|s, _, _| s[1].inertia = 0.0), None);
    type Break = fn(&mut [Segment<f64>; 3], &mut [f64; 2], &mut [f64; 2]);
    let broken: [(Break, &str); 11] = [
        (|s, _, _| s[0].length = 0.0, "length of segment 1 is 0"),
        (|s, _, _| s[1].length = -0.3, "length of segment 2 is -0.3"),
        (
            |s, _, _| s[2].length = f64::NAN,
            "length of segment 3 is not finite",
        ),
        (|s, _, _| s[0].mass = 0.0, "mass of segment 1 is 0"),
        (
            |s, _, _| s[1].mass = f64::INFINITY,
            "mass of segment 2 is not finite",
        ),
        (
            |s, _, _| s[2].inertia = -1e-9,
            "inertia of segment 3 is -1e-9",
        ),
        (
            |s, _, _| s[0].inertia = f64::NAN,
            "inertia of segment 1 is not finite",
        ),
        (
            |s, _, _| s[1].com[0] = f64::NAN,
            "centre of mass of segment 2 is not finite",
        ),
        (
            |s, _, _| s[2].com[1] = f64::INFINITY,
            "centre of mass of segment 3 is not finite",
        ),
        (
            |_, base, _| base[1] = f64::NAN,
            "base coordinate 2 is not finite",
        ),
        (
            |_, _, gravity| gravity[0] = f64::NAN,
            "gravity component 1 is not finite",
        ),
    ];
    for (break_it, message) in broken {
        let text = arm(break_it).expect("must be refused");
        assert!(text.starts_with(message), "{text}");
    }
}

#[test]
fn broken_rotors() {
    let arm = sample_arms::mechanical_arm();
    assert!(arm.with_rotor_inertia([0.0, 0.1]).is_ok());
    for (rotor, message) in [
        ([0.0, -0.1], "rotor inertia of joint 2 is -0.1"),
        ([f64::NAN, 0.1], "rotor inertia of joint 1 is not finite"),
    ] {
        let text = arm.with_rotor_inertia(rotor).unwrap_err().to_string();
        assert!(text.starts_with(message), "{text}");
    }
}

#[test]
fn one_lane_is_enough_to_be_refused() {
    let wide = |v| Lanes::<4>::of(v);
    let segment = Segment {
        length: Lanes([0.3, 0.3, -0.2, 0.3]),
        mass: wide(1.0),
        com: [wide(0.1), wide(0.0)],
        inertia: wide(0.01),
    };
    let refused = Chain::new([segment], [wide(0.0); 2], [wide(0.0), wide(-9.81)]);
    assert!(
        matches!(refused, Err(Invalid::OutOfRange { name: "length of segment", found, .. }) if found == -0.2)
    );
}

#[test]
fn a_cast_arm_is_the_same_arm() {
    let arm = sample_arms::human_arm();
    assert_eq!(arm.cast::<f64>(), arm);
    let wide = arm.cast::<Lanes<4>>();
    assert_eq!(wide.first_moments().map(|x| x.0[3]), *arm.first_moments());
    let single = arm.cast::<f32>();
    assert!((f64::from(single.first_moments()[0]) - arm.first_moments()[0]).abs() < 3e-7);
}
