//! Detection limits of effects that were not named, and the steps of the search.

use arm_core::effect::Effect;
use serde::Serialize;

use super::{Named, placed};
use crate::candidates::candidate::Candidate;
use crate::search::first_order_screening;
use crate::selection::search_state::{self, DetectionLimit};

/// An effect that was tested and not named: the smallest size that these data would have shown, and what it would explain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// Its kind.
    pub kind: String,
    /// Joint or segment where it would act, from 1.
    pub joint: Option<usize>,
    /// Channel of the force sensor where it would act.
    pub channel: Option<String>,
    /// The parameter that is its size.
    pub parameter: String,
    /// Smallest size of the parameter that would have been named; `None` where these data show no size of it.
    pub at_least: Option<f64>,
    /// Unit of the parameter.
    pub unit: String,
    /// What it would still explain, in units of twice the log-likelihood.
    pub gain: f64,
    /// What it would have to.
    pub price: f64,
}

/// The limits of all candidates that were ruled out, one for each size, but for the effects that were named. Of several shapes of an effect that counts which
/// shows most clearly, and the most that any of them explains.
///
/// * `hidden` - laws of joints that friction holds, which no data of a joint at rest can show
pub(super) fn limits(
    detection_limits: &[DetectionLimit],
    named: &[(String, Option<usize>, Option<String>)],
    hidden: &[Effect<f64>],
) -> Vec<Limit> {
    let mut all: Vec<Limit> = Vec::new();
    for one in detection_limits {
        if named.contains(&placed(one.effect.kind, one.effect.index)) {
            continue;
        }
        for (&free, &smallest) in std::iter::zip(&one.free, &one.smallest) {
            // A size beyond what the catalogue allows is none: a joint that hardly moves shows a rotor of 1e10 kg m² at the earliest.
            let allowed = &one.effect.kind.info().parameters[free];
            let largest = allowed.max.max(-allowed.min);
            let at_least = (smallest <= largest).then_some(smallest);
            add(
                &mut all,
                Limit::new(&one.effect, free, (at_least, one.gain, one.price)),
            );
        }
    }
    for law in hidden {
        add(&mut all, Limit::new(law, 0, (None, 0.0, 0.0)));
    }
    all
}

impl Limit {
    fn new(
        effect: &Effect<f64>,
        free: usize,
        (at_least, gain, price): (Option<f64>, f64, f64),
    ) -> Self {
        let parameter = &effect.kind.info().parameters[free];
        let (kind, joint, channel) = placed(effect.kind, effect.index);
        Self {
            kind,
            joint,
            channel,
            parameter: parameter.name.to_owned(),
            at_least,
            unit: parameter.unit.to_owned(),
            gain,
            price,
        }
    }

    fn is_of(&self, other: &Self) -> bool {
        (&self.kind, self.joint, &self.channel, &self.parameter)
            == (&other.kind, other.joint, &other.channel, &other.parameter)
    }
}

/// Adds the smallest value of a free parameter that would have been named.
fn add(all: &mut Vec<Limit>, new: Limit) {
    let Some(known) = all.iter_mut().find(|l| l.is_of(&new)) else {
        all.push(new);
        return;
    };
    if known.gain - known.price <= new.gain - new.price {
        (known.gain, known.price) = (new.gain, new.price);
    }
    known.at_least = match (known.at_least, new.at_least) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
}

/// An effect alone, to first order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Suspect {
    /// Its kind.
    pub kind: String,
    /// Joint or segment where it would act, from 1.
    pub joint: Option<usize>,
    /// Channel of the force sensor where it would act.
    pub channel: Option<String>,
    /// What is free in it, as it would be.
    pub parameters: Named<f64>,
    /// Unit of the first.
    pub unit: String,
    /// What it would explain, in units of twice the log-likelihood.
    pub gain: f64,
    /// What it must explain to be named.
    pub price: f64,
    /// Smallest size of the first parameter that would be named.
    pub smallest: f64,
}

impl Suspect {
    pub(super) fn of(one: &first_order_screening::ScreenedCandidate) -> Self {
        let (kind, joint, channel) = placed(one.effect.kind, one.effect.index);
        let known = one.effect.kind.info().parameters;
        let free = &one.candidate.free;
        let named = |&p: &usize| (known[p].name.to_owned(), one.effect.parameters[p]);
        Self {
            kind,
            joint,
            channel,
            parameters: free.iter().map(named).collect(),
            unit: known[free[0]].unit.to_owned(),
            gain: one.gain,
            price: one.price,
            smallest: one.smallest,
        }
    }
}

/// Effects that were added together and converged by simulation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Kind, joint from 1, and channel of each.
    pub effects: Vec<(String, Option<usize>, Option<String>)>,
    /// What they gained, in units of twice the log-likelihood.
    pub gain: f64,
}

/// One round of the search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SearchStep {
    /// What was converged by simulation, best first.
    pub tried: Vec<Tried>,
    /// Misfit before the round.
    pub before: f64,
    /// Misfit with the best of what was tried.
    pub after: f64,
}

impl SearchStep {
    pub(super) fn of(step: &search_state::SearchRound) -> Self {
        let place = |c: &Candidate| placed(c.effect.kind, c.effect.index);
        let tried = step.tried.iter().map(|(members, gain)| Tried {
            effects: members.iter().map(place).collect(),
            gain: *gain,
        });
        Self {
            tried: tried.collect(),
            before: step.before,
            after: step.after,
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    fn detection_limit(
        kind: &str,
        index: usize,
        (gain, price, smallest): (f64, f64, f64),
    ) -> DetectionLimit {
        let kind = Kind::named(kind).expect("a kind");
        DetectionLimit {
            effect: Effect::new(kind, index),
            free: vec![0],
            gain,
            price,
            smallest: vec![smallest],
        }
    }

    /// Play that the force shows along y, and hardly along z, where it never turns over.
    #[test]
    fn each_size_has_its_own_limit() {
        let mut play = detection_limit("backlash", 0, (3.0, 20.0, 2e-5));
        play.free = vec![0, 1];
        play.smallest = vec![2e-5, 3e-3];
        let mut along_y = detection_limit("backlash", 0, (4.0, 20.0, 1e-5));
        along_y.smallest = vec![1e-5];
        let limits = limits(&[play, along_y], &[], &[]);
        let found: Vec<_> = limits
            .iter()
            .map(|l| (l.parameter.as_str(), l.at_least))
            .collect();
        assert_eq!(found, [("y", Some(1e-5)), ("z", Some(3e-3))]);
    }

    #[test]
    fn of_several_shapes_the_clearest_size_and_the_most_gain_count() {
        let all = [
            detection_limit("coulomb", 0, (3.0, 20.0, 0.05)),
            detection_limit("coulomb", 0, (8.0, 20.0, 0.04)),
            detection_limit("coulomb", 0, (5.0, 20.0, 0.03)),
            // Not seen at any size; and named.
            detection_limit("viscous", 0, (0.0, 20.0, f64::INFINITY)),
            detection_limit("viscous", 1, (90.0, 20.0, 0.02)),
            detection_limit("force_bias", 1, (1.0, 20.0, 0.3)),
            // More than the catalogue allows.
            detection_limit("motor_inertia", 2, (0.0, 20.0, 2.5e10)),
        ];
        let named = [("viscous".to_owned(), Some(2), None)];
        let limits = limits(&all, &named, &[]);
        let found: Vec<_> = limits.iter().map(|l| (l.kind.as_str(), l.joint)).collect();
        let (coulomb, viscous) = (("coulomb", Some(1)), ("viscous", Some(1)));
        let rotor = ("motor_inertia", Some(3));
        assert_eq!(found, [coulomb, viscous, ("force_bias", None), rotor]);
        let dry = &limits[0];
        assert_eq!((dry.gain, dry.price, dry.at_least), (8.0, 20.0, Some(0.03)));
        assert_eq!(
            (dry.parameter.as_str(), dry.unit.as_str()),
            ("torque", "N m")
        );
        assert_eq!(limits[1].at_least, None);
        assert_eq!(limits[2].channel.as_deref(), Some("Fz"));
        assert_eq!(limits[3].at_least, None);
    }

    #[test]
    fn a_law_of_a_joint_that_friction_holds_is_seen_at_no_size() {
        let spring = Effect::new(Kind::Elastic, 2);
        let limits = limits(
            &[detection_limit("viscous", 0, (1.0, 20.0, 0.1))],
            &[],
            &[spring],
        );
        let found: Vec<_> = limits
            .iter()
            .map(|l| (l.kind.as_str(), l.joint, l.at_least))
            .collect();
        assert_eq!(
            found,
            [("viscous", Some(1), Some(0.1)), ("elastic", Some(3), None)]
        );
    }
}
