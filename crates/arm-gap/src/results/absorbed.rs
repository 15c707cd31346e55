//! Imperfections of model and rig that were refitted, with their priors.

use arm_core::effect::Kind;
use arm_model::Effect;
use serde::Serialize;

use super::effect::sign_in_files;
use super::{SearchInput, placed};
use crate::hypothesis::{Coordinate, Hypothesis, Target};

/// A small imperfection that was refitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// What it is, in words.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// Twice its prior standard deviation: the tolerance of the data set, or the `segment_uncertainty`.
    pub promised: f64,
    /// SI unit; `of its value` for what is relative.
    pub unit: String,
}

/// Unit of relative changes.
const RELATIVE: &str = "of its value";

/// What was refitted of a model, from the unknowns of its fit.
pub(super) fn absorbed<'c, const N: usize>(
    input: &SearchInput<'_>,
    hypothesis: &Hypothesis<N>,
    unknowns: impl Iterator<Item = &'c Coordinate>,
) -> Vec<Absorbed> {
    let modelled = input.model.all_effects();
    let given = (&modelled[..], input.force_on_robot);
    let each = unknowns.filter_map(|c| absorbed_value(given, hypothesis, c));
    each.collect()
}

/// A warning of what was refitted as far as it may be, beyond what was promised of it: what it could not take up may stand in what is
/// named. `None` without any.
pub(super) fn stopped<'c, const N: usize>(
    input: &SearchInput<'_>,
    hypothesis: &Hypothesis<N>,
    unknowns: impl Iterator<Item = &'c Coordinate>,
) -> Option<String> {
    let modelled = input.model.all_effects();
    let given = (&modelled[..], input.force_on_robot);
    let far = unknowns.filter(|c| c.is_at_limit(hypothesis.get(c.target)));
    let words: Vec<String> = far
        .filter_map(|c| absorbed_value(given, hypothesis, c))
        .filter(|a| a.value.abs() > a.promised)
        .map(|a| {
            let (value, promised) = (in_unit(a.value, &a.unit), in_unit(a.promised, &a.unit));
            format!("{} by {value} (prior ± {promised}, 2 σ)", a.name)
        })
        .collect();
    (!words.is_empty()).then(|| {
        format!(
            "the calibration stopped at its limit: {}. An error beyond the limit may appear as a named effect: check these values in the \
             model and in [tolerance]",
            words.join("; ")
        )
    })
}

/// A value with its unit; a relative one in per cent.
fn in_unit(value: f64, unit: &str) -> String {
    match unit {
        RELATIVE => format!("{:.0} %", 100.0 * value),
        _ => format!("{} {unit}", two_digits(value)),
    }
}

/// A value to two digits, without an exponent from a thousandth to a thousand.
fn two_digits(value: f64) -> String {
    let size = value.abs();
    if !(1e-3..1e3).contains(&size) {
        return format!("{value:.1e}");
    }
    let decimals = (1.0 - libm::floor(libm::log10(size))).max(0.0);
    format!("{value:.*}", decimals as usize)
}

/// What was refitted of one unknown; `None` for what is each trial's own, or named.
fn absorbed_value<const N: usize>(
    (modelled, force_on_robot): (&[Effect], bool),
    hypothesis: &Hypothesis<N>,
    unknown: &Coordinate,
) -> Option<Absorbed> {
    let mut promised = 2.0 * unknown.prior.map_or(f64::INFINITY, |(_, sd)| sd);
    let mut value = hypothesis.get(unknown.target);
    let axis = |axis: usize| ["y", "z"][axis];
    let (name, unit) = match unknown.target {
        Target::Segment(k, part) => {
            let part = ["mass", "com", "inertia"][part.min(2)];
            (format!("{part} of segment {}", k + 1), RELATIVE)
        }
        Target::Contact(part, along) => {
            let part = ["compliance", "damping"][part.min(1)];
            (format!("{part} of the contact, {}", axis(along)), RELATIVE)
        }
        Target::Shift(along) => (format!("place of the robot, {}", axis(along)), "m"),
        Target::Eccentricity(j, part) => {
            let wave = ["cosine", "sine"][part];
            let name = format!("once-per-turn error of angle {}, {wave}", j + 1);
            (name, "rad")
        }
        Target::Known(e, p) => {
            // A law of the passive base is not in the model: it is named.
            let own = modelled.get(e)?;
            let parameter = &own.kind().info().parameters[p];
            let given = own.value(parameter.name)?;
            (value, promised) = (value / given - 1.0, promised / given.abs());
            let index = own.site().index();
            let name = format!("{} of {}", parameter.name, worded(own.kind(), index));
            (name, RELATIVE)
        }
        Target::Calibration(e) => {
            let effect = &hypothesis.calibration[e];
            let unit = effect.kind.info().parameters[0].unit;
            value *= sign_in_files(effect.kind, force_on_robot);
            (worded(effect.kind, effect.index), unit)
        }
        Target::Placement(_) | Target::Named(..) => return None,
    };
    Some(Absorbed {
        name,
        value,
        promised,
        unit: unit.to_owned(),
    })
}

/// An effect in words, with its place.
fn worded(kind: Kind, index: usize) -> String {
    let (name, joint, channel) = placed(kind, index);
    let name = name.replace('_', " ");
    match (joint, channel) {
        (Some(joint), _) => format!("{name} of joint {joint}"),
        (None, Some(channel)) => format!("{name} of {channel}"),
        (None, None) => name,
    }
}

#[cfg(test)]
mod tests {
    use arm_model::Model;

    use super::*;

    fn input(model: &Model, force_on_robot: bool) -> SearchInput<'_> {
        SearchInput {
            model,
            force_on_robot,
            trials: &[],
        }
    }

    /// A viscosity of 0.1 that was refitted to 0.11 with a prior of 0.005: a tenth more, where twice a twentieth is the tolerance.
    #[test]
    fn what_was_refitted_is_stated_relative_to_what_was_promised() {
        let model = "[[arm.segment]]\nlength = 0.5\nmass = 2.0\ncom = 0.2\ninertia = 0.02\n[[arm.joint]]\nviscosity = 0.1\n";
        let model = Model::from_toml(model).expect("a model");
        let mut known = model.core_effects();
        known[0].parameters[0] = 0.11;
        known.push(known[0]);
        let hypothesis = Hypothesis::<1> {
            segments: [[0.02, 0.0, 0.0]],
            contact: [[0.0; 2]; 2],
            shift: [0.0, 0.003],
            placement: [0.0; 2],
            eccentricity: [[0.0; 2]],
            known,
            calibration: Vec::new(),
            named: Vec::new(),
        };
        let coordinate = |target, sd| Coordinate {
            target,
            prior: Some((0.0, sd)),
            lower: -1.0,
            upper: 1.0,
            step: 1e-3,
        };
        let unknowns = [
            coordinate(Target::Segment(0, 0), 0.05),
            coordinate(Target::Shift(1), 0.002),
            coordinate(Target::Known(0, 0), 0.005),
            // A law of the passive base, and what is each trial's own.
            coordinate(Target::Known(1, 0), 1.0),
            coordinate(Target::Placement(0), 1.0),
        ];
        let found = absorbed(&input(&model, false), &hypothesis, unknowns.iter());
        let names: Vec<_> = found.iter().map(|a| a.name.as_str()).collect();
        let expected = [
            "mass of segment 1",
            "place of the robot, z",
            "viscosity of viscous of joint 1",
        ];
        assert_eq!(names, expected);
        assert_eq!((found[0].value, found[0].promised), (0.02, 0.1));
        assert_eq!((found[1].unit.as_str(), found[1].value), ("m", 0.003));
        assert!((found[2].value - 0.1).abs() < 1e-12 && (found[2].promised - 0.1).abs() < 1e-12);
        assert_eq!(found[2].unit, RELATIVE);

        // No value is at its limit; then the place of the robot is, and alone is reported.
        assert_eq!(
            stopped(&input(&model, false), &hypothesis, unknowns.iter()),
            None
        );
        let mut bounded = unknowns;
        (bounded[0].upper, bounded[1].upper) = (0.02, 0.003);
        // At its limit, and yet within the tolerance.
        assert_eq!(
            stopped(&input(&model, false), &hypothesis, bounded.iter()),
            None
        );
        bounded[1].prior = Some((0.0, 0.001));
        let found = stopped(&input(&model, false), &hypothesis, bounded.iter()).expect("a warning");
        assert!(
            found.contains("place of the robot, z by 0.0030 m (prior ± 0.0020 m, 2 σ)."),
            "{found}"
        );
        assert!(!found.contains("mass"), "{found}");
    }

    #[test]
    fn a_refitted_bias_has_the_sign_of_the_files() {
        let model =
            "[[arm.segment]]\nlength = 0.5\nmass = 2.0\ncom = 0.2\ninertia = 0.02\n[[arm.joint]]\n";
        let model = Model::from_toml(model).expect("a model");
        let hypothesis = Hypothesis::<1> {
            segments: [[0.0; 3]],
            contact: [[0.0; 2]; 2],
            shift: [0.0; 2],
            placement: [0.0; 2],
            eccentricity: [[0.0; 2]],
            known: Vec::new(),
            calibration: vec![arm_core::effect::Effect::new(Kind::ForceBias, 1).with(&[0.3])],
            named: Vec::new(),
        };
        let unknown = Coordinate {
            target: Target::Calibration(0),
            prior: Some((0.0, 0.1)),
            lower: -1.0,
            upper: 1.0,
            step: 1e-3,
        };
        let bias = |on_robot| {
            let found = absorbed(&input(&model, on_robot), &hypothesis, [unknown].iter());
            found[0].value
        };
        assert_eq!((bias(false), bias(true)), (0.3, -0.3));
    }

    #[test]
    fn values_have_two_digits() {
        let values = [0.8, 0.0123, 123.4, 1e-4, 0.0].map(two_digits);
        assert_eq!(values, ["0.80", "0.012", "123", "1.0e-4", "0.0e0"]);
    }
}
