//! What each kind declares, derived from what its law does: dry friction, what it depends on, sizes and shapes of its parts.

use arm_core::Plane;
use arm_core::effect::{
    Effect, Family, KINDS, Kind, Local, MAX_PARAMETERS, Part, Values, advance_states,
};

use crate::catalogue::{needed, reading, rig};
use crate::common::Random;

/// Random effects and motions for each kind: some laws act only beyond a threshold, or for a short time.
const DRAWS: usize = 200;
/// A speed so low that only dry friction resists \[rad/s\].
const CREEP: f64 = 1e-30;
/// Rounding of a torque of order one \[N m\].
const ROUNDING: f64 = 1e-9;

fn local(random: &mut Random) -> Local<f64> {
    let memory = random.states();
    random.motion::<3>().local(1, memory)
}

/// The effect with one parameter changed.
fn set(mut effect: Effect<f64>, parameter: usize, value: f64) -> Effect<f64> {
    effect.parameters[parameter] = value;
    effect
}

/// Random values for some parameters, the others at their defaults.
fn drawn(random: &mut Random, kind: Kind, parameters: &[usize]) -> Effect<f64> {
    let values = random.effect(kind, 1).parameters;
    let default = Effect::new(kind, 1);
    parameters
        .iter()
        .fold(default, |e, &i| set(e, i, values[i]))
}

/// Random values for a kind whose dry friction, if any, is not smoothed.
fn unsmoothed(random: &mut Random, kind: Kind) -> Effect<f64> {
    let effect = random.effect(kind, 1);
    kind.smoothed_by().map_or(effect, |i| set(effect, i, 0.0))
}

/// The same joint at another speed.
fn at_speed(at: &Local<f64>, qd: f64) -> Local<f64> {
    Local { qd, ..*at }
}

/// Half of the difference between the torques at a speed and at its opposite \[N m\].
fn jump(effect: &Effect<f64>, at: &Local<f64>, speed: f64) -> f64 {
    let torque = |qd| effect.torque(&at_speed(at, qd));
    0.5 * (torque(speed) - torque(-speed))
}

#[test]
fn a_torque_that_jumps_with_the_direction_is_declared_dry() {
    let mut random = Random(51);
    for &kind in KINDS {
        let may_be_zero = |i: &usize| kind.info().parameters[*i].allows(0.0);
        let mut jumps = [false; MAX_PARAMETERS];
        for _ in 0..DRAWS {
            let (effect, at) = (random.effect(kind, 1), local(&mut random));
            assert!(
                jump(&effect, &at, CREEP).abs() < ROUNDING,
                "{kind:?}: no parameter smooths its dry friction"
            );
            for i in (0..kind.info().parameters.len()).filter(may_be_zero) {
                jumps[i] |= jump(&set(effect, i, 0.0), &at, CREEP).abs() > ROUNDING;
            }
        }
        let smoothing: Vec<usize> = (0..MAX_PARAMETERS).filter(|&i| jumps[i]).collect();
        assert_eq!(smoothing, kind.smoothed_by().as_slice(), "{kind:?}");
    }
}

/// Ten times the speed does not double it, with the shapes at their defaults.
#[test]
fn friction_that_hardly_grows_with_the_speed_is_declared_dry() {
    let mut random = Random(57);
    for &kind in KINDS {
        let parameters = kind.info().parameters.iter().enumerate();
        let linear: Vec<usize> = parameters.filter(|p| p.1.linear).map(|p| p.0).collect();
        let dry = (0..DRAWS).any(|_| {
            let (effect, at) = (drawn(&mut random, kind, &linear), local(&mut random));
            let [slow, fast] = [0.1, 1.0].map(|speed| jump(&effect, &at, speed).abs());
            slow > ROUNDING && fast < 2.0 * slow
        });
        let declared = (kind.smoothed_by().is_some(), kind.family() == Family::Dry);
        assert_eq!(declared, (dry, dry), "{kind:?}: smoothing, family");
    }
}

#[test]
fn dry_friction_is_the_part_of_the_torque_that_jumps() {
    let mut random = Random(52);
    for &kind in KINDS {
        for _ in 0..DRAWS {
            let (effect, at) = (unsmoothed(&mut random, kind), local(&mut random));
            let at_rest = effect.dry(&at_speed(&at, 0.0));
            assert!(at_rest >= 0.0, "{kind:?}: {at_rest}");
            let jump = jump(&effect, &at, CREEP);
            assert!(
                (at_rest - jump).abs() < ROUNDING,
                "{kind:?} holds {at_rest:.3} at rest and jumps by {jump:.3}"
            );
            if kind.smoothed_by().is_some() {
                let sum = effect.besides_dry(&at) + effect.dry(&at) * at.qd.signum();
                let torque = effect.torque(&at);
                assert!((torque - sum).abs() < ROUNDING, "{kind:?}: {sum}");
            }
        }
    }
}

/// The share of the dry friction depends on speed/smoothing alone, and reaches one within a few times the smoothing.
#[test]
fn smoothed_friction_is_as_wide_as_its_smoothing() {
    let mut random = Random(53);
    for &kind in KINDS {
        let Some(smoothing) = kind.smoothed_by() else {
            continue;
        };
        for _ in 0..DRAWS {
            let (effect, at) = (random.effect(kind, 1), local(&mut random));
            let share = |ratio: f64, width: f64| {
                let effect = set(effect, smoothing, width);
                let at = at_speed(&at, ratio * width);
                (effect.torque(&at) - effect.besides_dry(&at)) / effect.dry(&at)
            };
            for ratio in [0.1, 1.0, 10.0] {
                let [narrow, wide] = [0.001, 0.1].map(|width| share(ratio, width));
                assert!(
                    (narrow - wide).abs() < ROUNDING,
                    "{kind:?}: {narrow} {wide}"
                );
                assert!((share(-ratio, 0.1) + wide).abs() < ROUNDING, "{kind:?}");
            }
            assert!(share(0.1, 0.1) < 0.5 && share(10.0, 0.1) > 0.9, "{kind:?}");
        }
    }
}

#[test]
fn a_law_depends_on_what_it_declares() {
    let mut random = Random(54);
    for &kind in KINDS {
        let [mut steady, mut force, mut activity] = [true, false, false];
        for _ in 0..DRAWS {
            let (effect, at) = (unsmoothed(&mut random, kind), local(&mut random));
            let torque = effect.torque(&at);
            let other = local(&mut random);
            // Another motion in the same direction.
            let qd = other.qd.abs().copysign(at.qd);
            steady &= torque != 0.0 && effect.torque(&at_speed(&other, qd)) == torque;
            let (joint_force, active) = (other.joint_force, other.activity);
            force |= effect.torque(&Local { joint_force, ..at }) != torque;
            activity |= effect.torque(&Local {
                activity: active,
                ..at
            }) != torque;
        }
        assert_eq!(steady, kind.is_rate_independent(), "{kind:?}");
        assert_eq!(force, kind.feels_force(), "{kind:?}");
        assert_eq!(activity, kind.feels_activity(), "{kind:?}");
    }
}

/// Whether two effects differ in the joints, the contact, where base and handle are, or the sensors, in some rig and motion.
fn differ(random: &mut Random, pair: impl Fn(&mut Random) -> [Effect<f64>; 2]) -> bool {
    (0..DRAWS).any(|_| {
        let effects = pair(random);
        let (rig, motion) = (rig(random), random.motion::<3>());
        let (states, reading) = (random.states(), reading(random));
        let [gap, rate] = [0.1, 1.0].map(|most| [0, 1].map(|_| random.uniform(-most, most)));
        let [one, other] = effects.map(|effect| {
            let (mut rig, mut reading, mut memory) = (rig, reading, [states]);
            // Some shapes show only in the states.
            advance_states(&[effect], (&motion, &motion), &mut memory, 0.1);
            let torque = needed(&effect, &rig, &motion, memory[0]);
            effect.alter(&mut rig);
            effect.distort(&mut reading);
            let turned = motion.q[0] - rig.base_rest;
            let moved: Plane<f64> = rig.base_motion.map(|way| way * turned);
            let swings = [rig.heave.at(motion.time), rig.displaced.at(motion.time)];
            let contact = rig.contact.force_on_arm(gap, rate);
            (torque, moved, swings, contact, rig.force_delay, reading)
        });
        one != other
    })
}

/// Positions of the parameters that a part states as shapes.
fn shapes(part: &Part) -> Vec<usize> {
    let shaped = part.shapes.iter().map(|(i, _)| *i);
    let expected = part.expected.iter().map(|(i, _)| *i);
    let others = part.varying.iter().copied().chain(part.rest);
    shaped.chain(expected).chain(others).collect()
}

#[test]
fn sizes_act_by_themselves_and_shapes_only_with_them() {
    let mut random = Random(55);
    for &kind in KINDS {
        for part in kind.prior().parts {
            let (sizes, shapes, default) = (part.sizes, shapes(part), Effect::new(kind, 1));
            for &i in sizes {
                let acts = differ(&mut random, |r| [drawn(r, kind, &[i]), default]);
                assert!(acts, "{kind:?}: parameter {i} is no size");
            }
            let act = differ(&mut random, |r| [drawn(r, kind, &shapes), default]);
            assert!(!act, "{kind:?}: a size among the shapes {shapes:?}");
            for &i in &shapes {
                let matters = differ(&mut random, |r| {
                    let effect = drawn(r, kind, &[sizes, &shapes].concat());
                    [effect, set(effect, i, r.effect(kind, 1).parameters[i])]
                });
                assert!(matters, "{kind:?}: {i} is no shape of sizes {sizes:?}");
            }
        }
    }
}

#[test]
fn values_and_rest_angles_fit_their_parameters() {
    let mut random = Random(56);
    for &kind in KINDS {
        for part in kind.prior().parts {
            for (i, values) in part.shapes {
                let parameter = &kind.info().parameters[*i];
                let fits = match values {
                    Values::Each(values) => values.iter().all(|&v| parameter.allows(v)),
                    Values::Highest | Values::Lowest | Values::Middle | Values::Across => {
                        parameter.unit == "rad"
                    }
                };
                assert!(fits, "{kind:?}: {values:?} for {}", parameter.name);
            }
            let Some(rest) = part.rest else { continue };
            for _ in 0..DRAWS {
                let (effect, at) = (random.effect(kind, 1), local(&mut random));
                let torque = |angle| set(effect, rest, angle).torque(&at);
                let curvature = torque(-1.0) - 2.0 * torque(0.0) + torque(1.0);
                assert!(curvature.abs() < ROUNDING, "{kind:?}: no rest angle");
            }
        }
    }
}
