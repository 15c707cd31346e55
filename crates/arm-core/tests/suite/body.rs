//! Composition of bodies: arithmetic in the head, the thesis' handle and orthosis, and errata 8 to 10.

use arm_core::{Body, Segment, sample_arms};

use crate::common::Random;

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() < tolerance
}

fn random_body(random: &mut Random) -> Body<f64> {
    Body {
        mass: random.uniform(0.1, 3.0),
        com: [random.uniform(0.0, 0.3), random.uniform(-0.1, 0.1)],
        inertia: random.uniform(0.0, 0.02),
    }
}

#[test]
fn arithmetic_in_the_head() {
    // 1 kg and 3 kg, 4 m apart: com at 3 m, inertia 1·9 + 3·1 = 12 and its own 0.5 + 0.25.
    let one = Body {
        inertia: 0.5,
        ..Body::point(1.0, 0.0)
    };
    let three = Body {
        inertia: 0.25,
        ..Body::point(3.0, 4.0)
    };
    let both = one.with(&three);
    assert_eq!(
        both,
        Body {
            mass: 4.0,
            com: [3.0, 0.0],
            inertia: 12.75
        }
    );
}

#[test]
fn order_does_not_matter() {
    let mut random = Random(51);
    for _ in 0..1000 {
        let [a, b, c] = core::array::from_fn(|_| random_body(&mut random));
        let (one, two) = (a.with(&b).with(&c), c.with(&b.with(&a)));
        for (x, y) in [
            (one.mass, two.mass),
            (one.com[0], two.com[0]),
            (one.com[1], two.com[1]),
            (one.inertia, two.inertia),
        ] {
            assert!(close(x, y, 1e-14));
        }
    }
}

#[test]
fn moments_about_any_point_add() {
    let mut random = Random(52);
    for _ in 0..1000 {
        let [a, b] = core::array::from_fn(|_| random_body(&mut random));
        let about = |body: &Body<f64>, y: f64, z: f64| {
            let [dy, dz] = [body.com[0] - y, body.com[1] - z];
            body.inertia + body.mass * (dy * dy + dz * dz)
        };
        let (y, z) = (random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
        let sum = about(&a, y, z) + about(&b, y, z);
        assert!(close(about(&a.with(&b), y, z), sum, 1e-13));
    }
}

#[test]
fn nothing_added_is_nothing_changed() {
    let body = Body {
        mass: 0.3,
        com: [0.1, 0.02],
        inertia: 0.001,
    };
    let nothing = Body::point(0.0, 0.7);
    assert_eq!(body.with(&nothing), body);
    assert_eq!(nothing.with(&nothing), nothing);
    let segment = Segment {
        length: 0.3,
        mass: 0.7,
        com: [0.1, 0.0],
        inertia: 0.01,
    };
    assert_eq!(Body::of(&segment).segment(0.3), segment);
}

/// Erratum 10: `l_handle = 0.844 m` is 0.0844 m.
#[test]
fn handle_on_the_hand_of_equation_3_14() {
    let hand = Body::point(0.0061 * 77.0, 0.79 * 0.093);
    let held = |at| hand.with(&Body::point(0.277, at));
    assert!(close(held(0.0844).mass, 0.747, 5e-4));
    assert!(close(held(0.0844).com[0], 0.0775, 5e-5));
    assert!(
        close(held(0.844).com[0], 0.359, 5e-4),
        "beyond the hand of 0.093 m"
    );
    // Its inertia: reduced mass 0.174 kg times the square of 11 mm.
    assert!(close(held(0.0844).inertia, 2.08e-5, 2e-7));
    // Table 4.10: 78 kg, and 0.081 m from a handle at 0.0926 to 0.0953 m.
    let table = |at| Body::point(0.0061 * 78.0, 0.79 * 0.093).with(&Body::point(0.277, at));
    assert!(close(table(0.0926).mass, 0.753, 5e-4));
    assert!(close(table(0.0926).com[0], 0.0805, 5e-5) && close(table(0.0953).com[0], 0.0815, 5e-5));
}

/// Errata 8 and 9: the printed l1 mixes distances from the shoulder with one from the elbow.
#[test]
fn orthosis_of_equation_3_20() {
    let [upper_arm, forearm, _] = *sample_arms::human_arm().segments();
    let [m_ua, l_ua, a1] = [upper_arm.mass, upper_arm.com[0], upper_arm.length];
    let [upper, lower] = sample_arms::orthosis().on(&upper_arm, &forearm);
    assert!(close(upper.mass, 2.314, 1e-12) && close(lower.mass, 1.455, 1e-12));
    assert!(close(upper.com[0], 0.1899, 5e-5));
    let printed = a1 - (l_ua * m_ua + 0.091 * 0.200) / (m_ua + 0.200);
    assert!(close(printed, 0.1442, 5e-5));
    assert!(
        close((printed - upper.com[0]) * upper.mass, -0.106, 5e-4),
        "1.04 N m at q = 0"
    );
    let l2 = (0.121 * 1.264 + 0.066 * 0.191) / (1.264 + 0.191);
    assert!(close(lower.com[0], l2, 1e-15));
    assert_eq!((upper.length, lower.length), (0.322, 0.264));
}
