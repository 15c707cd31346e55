//! What holds for every kind of effect: names, bounds, gradients, the off switch.

use arm_core::effect::{
    Effect, KINDS, Kind, Local, MAX_PARAMETERS, MAX_STATES, Motion, Place, States, resisting_torque,
};
use arm_core::{Contact, Invalid, Joints, Pose, Reading, Setup, inverse_dynamics};

use crate::common::Random;

/// The stable names, as files and reports use them.
const NAMES: &str = "viscous coulomb stribeck load_friction quadratic_drag angle_viscosity \
    active_viscosity elastic active_stiffness cubic_elastic relaxation thixotropy constant_moment end_range biarticular biarticular_end_range stretch_reflex tremor voluntary \
    motor_inertia added_mass gravity_moment inertia segment_length gravity_tilt shoulder_motion shoulder_heave \
    backlash contact_compliance contact_damping robot_ripple force_bias force_drift force_gain \
    force_misalignment angle_offset time_delay handle_slip";

pub fn rig(random: &mut Random) -> Setup<f64, 3> {
    let contact = Contact {
        stiffness: [9000.0, 10000.0],
        damping: [25.0, 30.0],
        play: [0.001, 0.002],
    };
    Setup::new(&random.arm::<3>(), contact)
}

pub fn reading(random: &mut Random) -> Reading<f64, 3> {
    Reading {
        time: random.uniform(0.1, 3.0),
        q: random.joints(2.0),
        force_on_arm: [random.uniform(-20.0, 20.0), random.uniform(-20.0, 20.0)],
        moment_on_arm: random.uniform(-1.0, 1.0),
    }
}

/// Torques that a motion needs with an effect in force, by whatever way it acts.
pub fn needed(
    effect: &Effect<f64>,
    rig: &Setup<f64, 3>,
    motion: &Motion<f64, 3>,
    memory: States<f64>,
) -> Joints<f64, 3> {
    let mut setup = *rig;
    effect.alter(&mut setup);
    let chain = setup.chain().expect("a possible arm");
    inverse_dynamics(&chain, &Pose::new(&motion.q), &motion.qd, &motion.qdd)
        + resisting_torque(&[*effect], motion, &[memory])
}

fn of_place(place: Place) -> impl Iterator<Item = Kind> {
    KINDS
        .iter()
        .copied()
        .filter(move |k| k.info().place == place)
}

#[test]
fn names_are_those_of_the_interface() {
    let names: Vec<_> = KINDS.iter().map(|k| k.info().kind).collect();
    assert_eq!(names.join(" "), NAMES);
    for &kind in KINDS {
        assert_eq!(Kind::named(kind.info().kind), Ok(kind));
    }
    assert_eq!(
        Kind::named("friction"),
        Err(Invalid::Unknown {
            name: "kind of effect"
        })
    );
}

#[test]
fn entries_are_complete() {
    for kind in KINDS {
        let info = kind.info();
        for text in [info.summary, info.formula, info.reference] {
            assert!(!text.is_empty(), "{}", info.kind);
        }
        assert!(
            (1..=MAX_PARAMETERS).contains(&info.parameters.len()),
            "{}",
            info.kind
        );
        for (i, p) in info.parameters.iter().enumerate() {
            assert!(
                p.min < p.max && p.min.is_finite() && p.max.is_finite(),
                "{} {}",
                info.kind,
                p.name
            );
            assert!(
                p.min <= p.default && p.default <= p.max,
                "{} {}",
                info.kind,
                p.name
            );
            assert!(!p.unit.is_empty() && !p.name.is_empty());
            assert!(
                !info.parameters[..i]
                    .iter()
                    .any(|other| other.name == p.name)
            );
        }
    }
}

#[test]
fn addresses_are_those_of_the_interface() {
    for kind in KINDS {
        let expected = match kind.info().kind {
            "force_bias" | "force_drift" | "force_gain" => Some("channel"),
            "added_mass" | "gravity_tilt" | "shoulder_motion" | "shoulder_heave" | "backlash"
            | "contact_compliance" | "contact_damping" | "robot_ripple" | "force_misalignment"
            | "time_delay" | "handle_slip" => None,
            _ => Some("joint"),
        };
        assert_eq!(
            kind.info().place.address(),
            expected,
            "{}",
            kind.info().kind
        );
        assert!(!kind.info().place.name().is_empty());
    }
}

#[test]
fn bounds_are_kept() {
    for &kind in KINDS {
        let good = Effect::<f64>::new(kind, 1);
        assert_eq!(good.validate(3), Ok(()), "{}", kind.info().kind);
        for (i, p) in kind.info().parameters.iter().enumerate() {
            let with = |value| {
                let mut effect = good;
                effect.parameters[i] = value;
                effect.validate(3)
            };
            assert_eq!((with(p.min), with(p.max)), (Ok(()), Ok(())));
            let width = p.max - p.min;
            for found in [p.min - 1e-3 * width, p.max + 1e-3 * width] {
                assert_eq!(
                    with(found),
                    Err(Invalid::OutOfRange {
                        name: p.name,
                        index: i,
                        found,
                        min: p.min,
                        max: p.max
                    })
                );
            }
            for value in [f64::NAN, f64::INFINITY] {
                assert_eq!(
                    with(value),
                    Err(Invalid::NotFinite {
                        name: p.name,
                        index: i
                    })
                );
            }
        }
    }
}

#[test]
fn places_are_kept() {
    for &kind in KINDS {
        let at = |index| Effect::<f64>::new(kind, index).validate(2).is_ok();
        let crosses = kind.info().kind.starts_with("biarticular");
        assert_eq!(at(0), !crosses, "the first joint has none before it");
        assert!(at(1));
        match kind.info().place {
            Place::Joint | Place::Segment | Place::AngleSensor => assert!(!at(2)),
            Place::ForceSensor => assert!(at(2) && !at(3)),
            _ => assert!(at(9), "without an index"),
        }
    }
    let refused = Effect::<f64>::new(Kind::Viscous, 4)
        .validate(3)
        .unwrap_err();
    assert_eq!(refused.to_string(), "joint 1 is 5, allowed is 1 to 3");
}

#[test]
fn off_is_the_old_result_bit_for_bit() {
    let mut random = Random(31);
    for &kind in KINDS {
        let rig = rig(&mut random);
        let effect = Effect {
            on: false,
            ..random.effect(kind, 1)
        };
        let mut altered = rig;
        effect.alter(&mut altered);
        assert_eq!(bits(&altered), bits(&rig), "{}", kind.info().kind);
        let before = reading(&mut random);
        let mut after = before;
        effect.distort(&mut after);
        assert_eq!(bits(&after), bits(&before), "{}", kind.info().kind);

        let motion = random.motion::<3>();
        let others = [
            random.effect(Kind::Coulomb, 1),
            random.effect(Kind::Elastic, 0),
        ];
        let with = [others[0], effect, others[1]];
        assert_eq!(
            bits(&resisting_torque(&with, &motion, &[])),
            bits(&resisting_torque(&others, &motion, &[])),
        );
        let local = motion.local(1, [0.3; 3]);
        assert_eq!(effect.memory_rate(&local), [0.0; MAX_STATES]);
        assert_eq!(effect.proximal_share(), 0.0);
        assert_eq!(effect.gradient(&local), [0.0; MAX_PARAMETERS]);
    }
}

/// The shortest text that reads back to the same numbers: equal for equal bits only.
fn bits(value: &impl core::fmt::Debug) -> String {
    format!("{value:?}")
}

#[test]
fn defaults_do_nothing() {
    let mut random = Random(32);
    for &kind in KINDS {
        let effect = Effect::new(kind, 1);
        let rig = rig(&mut random);
        let mut altered = rig;
        effect.alter(&mut altered);
        // Frequencies and the like may change where nothing has that frequency.
        altered.displaced.ripple.frequency = rig.displaced.ripple.frequency;
        altered.heave.frequency = rig.heave.frequency;
        assert_eq!(altered, rig, "{}", kind.info().kind);
        let before = reading(&mut random);
        let mut after = before;
        effect.distort(&mut after);
        assert_eq!(after, before, "{}", kind.info().kind);
        let motion = random.motion::<3>();
        assert_eq!(
            resisting_torque(&[effect], &motion, &[[0.5; 3]]),
            Joints::<f64, 3>::zeros()
        );
    }
}

#[test]
fn every_kind_does_something() {
    let mut random = Random(33);
    for &kind in KINDS {
        let effect = random.effect(kind, 1);
        let rig = rig(&mut random);
        let mut altered = rig;
        effect.alter(&mut altered);
        let before = reading(&mut random);
        let mut after = before;
        effect.distort(&mut after);
        // Some act only beyond a threshold.
        let torque = (0..50).fold(0.0, |largest: f64, _| {
            let torque = resisting_torque(&[effect], &random.motion::<3>(), &[[0.5; 3]]);
            largest.max(torque.amax())
        });
        let acts = altered != rig || after != before || torque > 0.0;
        assert!(acts, "{} does nothing", kind.info().kind);
        // By one way only, or it would be counted twice.
        assert!(altered == rig || torque == 0.0, "{}", kind.info().kind);
    }
}

#[test]
fn gradients_are_those_of_the_needed_torque() {
    let mut random = Random(34);
    for kind in of_place(Place::Joint) {
        for _ in 0..200 {
            let (rig, motion) = (rig(&mut random), random.motion::<3>());
            let (effect, memory) = (random.effect(kind, 1), random.states());
            let gradient = effect.gradient(&motion.local(1, memory));
            for i in 0..MAX_PARAMETERS {
                let step = 1e-5;
                let at = |value: f64| {
                    let mut moved = effect;
                    moved.parameters[i] += value;
                    needed(&moved, &rig, &motion, memory)[1]
                };
                let used = i < kind.info().parameters.len();
                let slope = if used {
                    (at(step) - at(-step)) / (2.0 * step)
                } else {
                    0.0
                };
                // Third derivatives of the exponentials are of order 10³ at steps of 10⁻⁵.
                let scale = 1.0 + slope.abs();
                assert!(
                    (slope - gradient[i]).abs() < 1e-6 * scale,
                    "{} parameter {i}: {} instead of {slope}",
                    kind.info().kind,
                    gradient[i]
                );
            }
        }
    }
}

#[test]
fn torque_is_linear_in_the_parameters_that_say_so() {
    let mut random = Random(35);
    for kind in of_place(Place::Joint) {
        for _ in 0..100 {
            let (rig, motion) = (rig(&mut random), random.motion::<3>());
            let (effect, memory) = (random.effect(kind, 1), random.states());
            let without = Effect {
                on: false,
                ..effect
            };
            let torque = (needed(&effect, &rig, &motion, memory)
                - needed(&without, &rig, &motion, memory))[1];
            let gradient = effect.gradient(&motion.local(1, memory));
            let by_gradient: f64 = (0..kind.info().parameters.len())
                .filter(|&i| kind.info().parameters[i].linear)
                .map(|i| gradient[i] * effect.parameters[i])
                .sum();
            let scale = 1.0 + torque.abs();
            assert!(
                (torque - by_gradient).abs() < 1e-12 * scale,
                "{}",
                kind.info().kind
            );
        }
    }
}

#[test]
fn segments_are_linear_in_the_parameters_that_say_so() {
    let mut random = Random(36);
    for kind in of_place(Place::Segment).chain(of_place(Place::Hand)) {
        for _ in 0..100 {
            let (rig, motion) = (rig(&mut random), random.motion::<3>());
            let effect = random.effect(kind, 1).with(&[0.02]);
            let twice = effect.with(&[0.04]);
            let without = Effect {
                on: false,
                ..effect
            };
            let [none, one, two] =
                [without, effect, twice].map(|e| needed(&e, &rig, &motion, [0.0; 3]));
            let curvature = (two - one * 2.0 + none).amax();
            let second_order = if kind.info().kind == "gravity_moment" {
                // J gains moment²/mass, which turns with the segment's acceleration in space.
                let turn = motion.qdd[0] + motion.qdd[1];
                2.0 * 0.02 * 0.02 / rig.segments[1].mass * turn.abs()
            } else {
                0.0
            };
            if kind.info().parameters[0].linear {
                assert!(
                    (curvature - second_order).abs() < 1e-12,
                    "{}",
                    kind.info().kind
                );
            }
        }
    }
}

#[test]
fn memory_is_kept_by_kinds_that_say_so() {
    let mut random = Random(37);
    for &kind in KINDS {
        let effect = random.effect(kind, 1);
        let local: Local<f64> = random.motion::<3>().local(1, [0.4; 3]);
        let rates = effect.memory_rate(&local);
        let moving = rates.iter().filter(|rate| **rate != 0.0).count();
        assert_eq!(moving, kind.info().states, "{}", kind.info().kind);
        let remembers = effect.torque(&local)
            != effect.torque(&Local {
                memory: [0.1; 3],
                ..local
            });
        assert_eq!(remembers, effect.remembers(), "{}", kind.info().kind);
    }
}

#[test]
fn both_ends_of_a_shared_torque_are_counted() {
    let mut random = Random(38);
    for kind in of_place(Place::Joint) {
        let effect = random.effect(kind, 2);
        let motion = random.motion::<3>();
        let total = resisting_torque(&[effect], &motion, &[[0.5; 3]]);
        let here = effect.torque(&motion.local(2, [0.5; 3]));
        assert_eq!(total[2], here);
        assert_eq!(total[1], effect.proximal_share() * here);
        assert_eq!(total[0], 0.0);
    }
}

#[test]
fn an_index_beyond_the_arm_does_nothing() {
    let mut random = Random(39);
    for &kind in KINDS {
        let place = kind.info().place;
        let effect = random.effect(kind, 7);
        let (rig, before) = (rig(&mut random), reading(&mut random));
        let (mut altered, mut after) = (rig, before);
        effect.alter(&mut altered);
        effect.distort(&mut after);
        let torque = resisting_torque(&[effect], &random.motion::<3>(), &[]);
        assert_eq!(torque, Joints::<f64, 3>::zeros());
        if place.address().is_some() {
            assert_eq!((altered, after), (rig, before), "{}", kind.info().kind);
        }
    }
}

#[test]
fn linear_parameters_come_first() {
    for kind in KINDS {
        let linear: Vec<bool> = kind.info().parameters.iter().map(|p| p.linear).collect();
        assert!(linear.is_sorted_by(|a, b| a >= b), "{kind:?}: {linear:?}");
    }
}
