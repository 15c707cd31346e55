//! Literature values against the thesis' tables and the worked numbers of the errata.

use arm_core::anthropometry::{Axis, Grip, PARTS, Part, Sex, Subject};
use arm_core::{Body, Invalid, sample_arms};

fn man(body_mass: f64, height: f64) -> Subject {
    Subject::new(body_mass, height, Sex::Male).expect("a possible man")
}

/// Half a unit of the last printed digit.
fn printed(value: f64, digits: f64, unit: f64) -> bool {
    (value - digits).abs() <= 0.5001 * unit
}

/// Table 4.10 is for 78.0 kg (erratum 43); its hand carries a handle of 0.277 kg.
#[test]
fn masses_of_table_4_10() {
    let subject = man(78.0, 1.80);
    let mass = |part| subject.mass(part).value;
    assert!(printed(mass(Part::UpperArm), 2.114, 1e-3));
    assert!(printed(mass(Part::Forearm), 1.264, 1e-3));
    let hand = Body::point(mass(Part::Hand), 0.0).with(&Body::point(0.277, 0.0));
    assert!(printed(hand.mass, 0.753, 1e-3));
}

#[test]
fn centres_of_mass_of_table_4_10() {
    let subject = man(78.0, 1.80);
    for (part, length, com) in [
        (Part::UpperArm, 0.322, 0.186),
        (Part::Forearm, 0.264, 0.121),
    ] {
        let prior = subject
            .prior(part, Some(length), Grip::Neutral)
            .expect("valid");
        assert!(printed(prior.com.value, com, 1e-3), "{}", prior.com.value);
        assert_eq!(prior.length, length);
    }
}

/// Erratum 11: tables 4.6 to 4.8 were computed with 0.193 kg at the hand, for 77, 68 and 82 kg.
#[test]
fn hand_masses_of_tables_4_6_to_4_8() {
    for (body_mass, m2, m3) in [
        (77.0, 1.247, 0.663),
        (68.0, 1.102, 0.608),
        (82.0, 1.328, 0.693),
    ] {
        let subject = man(body_mass, 1.80);
        assert!(printed(subject.mass(Part::Forearm).value, m2, 1e-3));
        let hand = subject.mass(Part::Hand).value;
        assert!(printed(hand + 0.193, m3, 1e-3), "{}", hand + 0.193);
        assert!(!printed(hand + 0.277, m3, 1e-2));
    }
}

/// Erratum 42: the moments of table 1 in appendix D are longitudinal ones.
#[test]
fn moments_of_inertia_of_appendix_d() {
    let subject = man(77.0, 1.80);
    let by_radius = |part, length, axis| subject.inertia(part, length, axis);
    for (part, length, transverse, longitudinal) in [
        (Part::UpperArm, 0.32, 0.0155, 0.0053),
        (Part::Forearm, 0.25, 0.0055, 0.0011),
        (Part::Hand, 0.09, 0.0010, 0.0006),
    ] {
        assert!(printed(
            by_radius(part, length, Axis::Transverse),
            transverse,
            1e-4
        ));
        assert!(printed(
            by_radius(part, length, Axis::Longitudinal),
            longitudinal,
            1e-4
        ));
    }
    // The sample arm has those about the axes of the joints; that of its hand has the handle besides.
    let [upper_arm, forearm, hand] = sample_arms::human_arm().segments().map(|s| s.inertia);
    let across = |part, length| by_radius(part, length, Axis::Transverse);
    assert!(printed(across(Part::UpperArm, 0.322), upper_arm, 1e-4));
    assert!(printed(across(Part::Forearm, 0.264), forearm, 1e-4));
    assert!((0.0010..0.0010 + 0.0024).contains(&hand));
    assert!(printed(
        by_radius(Part::Hand, 0.09, Axis::Sagittal),
        0.0015,
        1e-4
    ));
    for (part, transverse, longitudinal) in [
        (Part::UpperArm, 127.0, 42.0),
        (Part::Forearm, 66.0, 13.0),
        (Part::Hand, 9.7, 5.9),
    ] {
        let unit = if part == Part::Hand { 0.1 } else { 1.0 };
        let regressed = |axis| subject.regressed_inertia(part, axis).expect("a man").value / 1e-4;
        assert!(printed(regressed(Axis::Transverse), transverse, unit));
        assert!(printed(regressed(Axis::Longitudinal), longitudinal, unit));
    }
}

/// Two ways to the same man: radii of gyration and regressions on mass and height.
#[test]
fn radii_and_regressions_agree_within_their_spread() {
    for (body_mass, height) in [(73.0, 1.741), (65.0, 1.70), (85.0, 1.85)] {
        let subject = man(body_mass, height);
        for part in PARTS {
            let prior = subject.prior(part, None, Grip::Flat).expect("valid");
            assert!(
                prior.mass.sd > 0.05 * prior.mass.value && prior.mass.sd < 0.15 * prior.mass.value
            );
            let inertia = subject
                .regressed_inertia(part, Axis::Transverse)
                .expect("a man");
            // The hand of the regressions reaches to the finger tip, de Leva's radius holds for the knuckle's length.
            let apart = (prior.inertia.value - inertia.value).abs();
            assert!(apart < 2.0 * inertia.sd, "{part:?} {apart} {}", inertia.sd);
        }
    }
}

#[test]
fn lengths_scale_with_height() {
    let mean = man(73.0, 1.741);
    assert_eq!(
        PARTS.map(|part| mean.mean_length(part)),
        [0.2817, 0.2689, 0.0862]
    );
    let woman = Subject::new(61.9, 1.735, Sex::Female).expect("valid");
    assert_eq!(
        PARTS.map(|part| woman.mean_length(part)),
        [0.2751, 0.2643, 0.0780]
    );
    assert!((man(73.0, 1.741 * 1.1).mean_length(Part::UpperArm) - 0.30987).abs() < 1e-12);
}

#[test]
fn a_woman_has_her_own_values_and_no_regression() {
    let woman = Subject::new(60.0, 1.70, Sex::Female).expect("valid");
    let prior = woman
        .prior(Part::Forearm, Some(0.25), Grip::Neutral)
        .expect("valid");
    assert!((prior.mass.value - 0.828).abs() < 1e-12);
    assert!((prior.com.value - 0.4559 * 0.25).abs() < 1e-15);
    assert_eq!(
        woman.regressed_inertia(Part::Forearm, Axis::Transverse),
        None
    );
    let segment = prior.segment();
    assert_eq!(
        (segment.length, segment.mass, segment.com[1]),
        (0.25, prior.mass.value, 0.0)
    );
}

#[test]
fn the_grip_turns_the_hand_only() {
    let subject = man(77.0, 1.80);
    let inertia = |part, grip| {
        subject
            .prior(part, None, grip)
            .expect("valid")
            .inertia
            .value
    };
    for part in [Part::UpperArm, Part::Forearm] {
        assert_eq!(inertia(part, Grip::Neutral), inertia(part, Grip::Flat));
    }
    let ratio = inertia(Part::Hand, Grip::Neutral) / inertia(Part::Hand, Grip::Flat);
    assert!((ratio - (0.628 * 0.628) / (0.513 * 0.513)).abs() < 1e-12);
}

#[test]
fn refused_subjects() {
    let text = |r: Result<Subject, Invalid>| r.unwrap_err().to_string();
    assert!(text(Subject::new(7.0, 1.8, Sex::Male)).contains("body mass"));
    assert!(text(Subject::new(f64::NAN, 1.8, Sex::Male)).contains("not finite"));
    assert!(text(Subject::new(77.0, 180.0, Sex::Male)).contains("height 1 is 180"));
    let prior = man(77.0, 1.8).prior(Part::Hand, Some(93.0), Grip::Flat);
    assert!(prior.unwrap_err().to_string().contains("segment length"));
}
