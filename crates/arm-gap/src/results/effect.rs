//! Missing effects, their alternatives, and movements that distinguish these.

use arm_core::effect::{Effect as CoreEffect, Kind, Place as ActsOn};
use arm_model::Effect;
use serde::Serialize;

use super::{Named, SearchInput, Value, at_most, placed};
use crate::hypothesis::Target;
use crate::search::conclusion::Finding;
use crate::selection::model_selection::{self, FittedAlternative};
use crate::trial_specific::component::TrialSpecific;

/// A movement that would distinguish two explanations.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Separation {
    /// Joint angles \[deg\].
    pub waypoints_deg: Vec<Vec<f64>>,
    /// Largest of any joint \[rad/s\].
    pub speed_rad_s: f64,
    /// Largest of any joint \[rad/s²\].
    pub acceleration_rad_s2: f64,
    /// `trapezoid` or `smooth`.
    pub shape: String,
    /// Distance of the two in standard deviations by the fit trials alone, everything refitted: at most the difference of their fits,
    /// even where more is expected to first order.
    pub now: f64,
    /// The same with one such trial more.
    pub then: f64,
}

/// Another effect that explains the same as a named one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    /// Its kind.
    pub kind: String,
    /// Joint or segment where it acts, from 1.
    pub joint: Option<usize>,
    /// Channel of the force sensor where it acts.
    pub channel: Option<String>,
    /// How well it explains the data.
    pub why: String,
    /// How much worse it does, in units of twice the log-likelihood; a few units decide nothing.
    pub worse: f64,
    /// Squared cosine between the responses to the two on these movements: 1 cannot be distinguished; NaN where it was not computed.
    pub likeness: f64,
    /// A movement that would distinguish the two, in words.
    pub separating_movement: Option<String>,
    /// The same as numbers.
    pub separation: Option<Separation>,
    /// The effect as it fits best.
    #[serde(skip)]
    pub simulated: Option<Effect>,
    /// Positions of the parameters that were fitted.
    #[serde(skip)]
    pub free: Vec<usize>,
}

/// Difference of twice the log-likelihood up to which two laws explain the data as well: odds of 150.
pub const TIE: f64 = model_selection::TIE;
/// An alternative explains the data as well below so many units of twice the log-likelihood, and nearly as well up to [`TIE`].
const AS_WELL: f64 = 2.0;
/// It explains them better from so many on.
const BETTER: f64 = -TIE;

/// How well an alternative explains the data that does so much worse, in words. Beyond [`TIE`] it is one only where nothing repeats a
/// movement: its disadvantage may then be an error of the named law. One that does as much better was not taken, because it is a law that
/// few joints have in the place of one that every joint has.
fn how_well(worse: f64) -> &'static str {
    match worse {
        ..BETTER => "explains these movements better, but few joints have it",
        ..AS_WELL => "explains these movements as well",
        ..=TIE => "explains these movements nearly as well",
        _ => "explains these movements to within the possible error of the named law",
    }
}

impl Alternative {
    fn of(fitted: &FittedAlternative) -> Self {
        let (worse, likeness) = (fitted.worse, fitted.likeness);
        Self {
            free: fitted.candidate.free.clone(),
            ..Self::new(&fitted.effect, how_well(worse), worse, likeness)
        }
    }

    fn new(effect: &CoreEffect<f64>, why: &str, worse: f64, likeness: f64) -> Self {
        let (kind, joint, channel) = placed(effect.kind, effect.index);
        Self {
            kind,
            joint,
            channel,
            why: why.to_owned(),
            worse,
            likeness,
            separating_movement: None,
            separation: None,
            simulated: Some(Effect::from_core(effect)),
            free: Vec::new(),
        }
    }
}

/// An effect that the model lacks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    /// Its kind.
    pub kind: String,
    /// Joint or segment where it acts, from 1.
    pub joint: Option<usize>,
    /// Channel of the force sensor where it acts.
    pub channel: Option<String>,
    /// Its parameters by name, with signs as in the files.
    pub parameters: Named<Value>,
    /// Probability of such a gain by chance, corrected for the number of candidates.
    pub p_value: f64,
    /// Share of what can be explained that is lost without it.
    pub share: f64,
    /// What else explains the data.
    pub alternatives: Vec<Alternative>,
    /// Where it was in one trial only, its file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trial: Option<String>,
    /// When it acted there \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub span: Option<(f64, f64)>,
    /// The family of effects that it belongs to.
    pub family: String,
    /// Whether no alternative explains the data as well.
    pub decided: bool,
    /// What the model would be off by without it, everything else refitted: root mean square in units of what repeats differ by. `None`
    /// without repeats, and for what was set apart.
    pub without: Option<f64>,
    /// The effect as it is simulated: its force is on the arm.
    #[serde(skip)]
    pub simulated: Option<Effect>,
}

/// Sign of a linear parameter in the files: what adds to a force channel adds to the channel as it stands there, and not to the force on the
/// arm; a gain has no unit and no sign.
pub(super) fn sign_in_files(kind: Kind, force_on_robot: bool) -> f64 {
    let info = kind.info();
    let adds = info.place == ActsOn::ForceSensor && info.parameters[0].unit != "1";
    if adds && force_on_robot { -1.0 } else { 1.0 }
}

impl Missing {
    /// A named effect of all trials.
    pub(super) fn named<const N: usize>(
        named: &model_selection::MissingEffect,
        finding: &Finding<N>,
        input: &SearchInput<'_>,
    ) -> Self {
        let effect = &finding.amended.hypothesis.named[named.slot];
        let info = effect.kind.info();
        let own = sign_in_files(effect.kind, input.force_on_robot);
        let precision = &finding.precision;
        let std = |p: usize| {
            let is_it = |c: Target| c == Target::Named(named.slot, p);
            // Of several the last.
            let mut all = std::iter::zip(&precision.coordinates, &precision.sd).rev();
            let (_, sd) = all.find(|(c, _)| is_it(c.target))?;
            sd.is_finite().then_some(*sd)
        };
        let each = info.parameters.iter().zip(effect.parameters).enumerate();
        let parameters = each
            .map(|(k, (p, value))| {
                let sign = if p.linear { own } else { 1.0 };
                let (a, b) = (sign * p.min, sign * p.max);
                let limits = if a <= b { (a, b) } else { (b, a) };
                let value = Value::of(sign * value, std(k), p.unit, limits);
                (p.name.to_owned(), value)
            })
            .collect();
        let [before, after] = finding.lack.each_ref().map(|lack| lack.ratio);
        // Its share of the squares lies between those of the two models.
        let left = after + named.share * (before - after);
        Self {
            p_value: named.p_value,
            share: named.share,
            without: (left.is_finite() && left >= 0.0).then(|| libm::sqrt(left)),
            ..Self::new(
                effect,
                parameters,
                named.alternatives.iter().map(Alternative::of).collect(),
            )
        }
    }

    /// A rhythm, or what happened in one trial.
    pub(super) fn trial_specific<const N: usize>(
        one: &TrialSpecific,
        finding: &Finding<N>,
        input: &SearchInput<'_>,
    ) -> Self {
        /// Parameters of time and speed, not of size.
        const SHAPES: [&str; 4] = ["frequency", "phase", "start", "duration"];
        let effect = &one.effect;
        let info = effect.kind.info();
        let values = || info.parameters.iter().zip(effect.parameters);
        let size = values()
            .position(|(p, value)| value != 0.0 && !SHAPES.contains(&p.name))
            .unwrap_or(0);
        let mut sd = one.sd.iter();
        let mut parameters: Named<_> = values()
            .enumerate()
            .map(|(k, (p, value))| {
                let is_size = k >= size && !SHAPES.contains(&p.name);
                let std = is_size.then(|| sd.next().copied()).flatten();
                let value = Value::of(value, std, p.unit, (p.min, p.max));
                (p.name.to_owned(), value)
            })
            .collect();
        let trial = one.trial.map(|t| &input.trials[t]);
        let (start, end) = one.span();
        if trial.is_some() {
            let start = || Value::of(start, None, "s", (0.0, 0.0));
            parameters.entry("start".to_owned()).or_insert_with(start);
        }
        let alternatives = one.alternatives.iter().map(|(effect, worse)| {
            Alternative::new(effect, "swings these channels as much", *worse, f64::NAN)
        });
        let explained = one.gain + finding.calibrated.cost - finding.amended.cost;
        Self {
            p_value: libm::exp(-f64::min(one.gain / 2.0, 700.0)),
            share: one.gain / explained,
            trial: trial.map(|t| t.file.clone()),
            span: trial.map(|t| (start, at_most(end, t.end))),
            ..Self::new(effect, parameters, alternatives.collect())
        }
    }

    fn new(
        effect: &CoreEffect<f64>,
        parameters: Named<Value>,
        alternatives: Vec<Alternative>,
    ) -> Self {
        let (kind, joint, channel) = placed(effect.kind, effect.index);
        Self {
            kind,
            joint,
            channel,
            parameters,
            p_value: 0.0,
            share: 0.0,
            trial: None,
            span: None,
            family: effect.kind.family().name().to_owned(),
            decided: alternatives.is_empty(),
            without: None,
            alternatives,
            simulated: Some(Effect::from_core(effect)),
        }
    }

    /// The effect without intervals: they hold only where the structure of the model is right.
    pub(super) fn without_intervals(mut self) -> Self {
        for value in self.parameters.values_mut() {
            (value.std, value.interval) = (None, None);
        }
        self
    }
}

/// Somewhere that simulation and data disagree.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// File of the trial.
    pub trial: String,
    /// Channel.
    pub channel: String,
    /// Start \[s\].
    pub t_start: f64,
    /// End \[s\].
    pub t_end: f64,
    /// Joint, from 1.
    pub joint: Option<usize>,
    /// Region of movement: `dq2 > 0`, `dq2 < 0`, `dq2 = 0`.
    pub condition: String,
    /// Mean difference there, in the unit of the channel.
    pub mean: f64,
    /// The mean in its standard deviations; the correlation of residuals in time is taken into account.
    pub z: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_much_worse_does_not_explain_nearly_as_well() {
        assert!(how_well(-729.0).starts_with("explains these movements better"));
        assert_eq!(how_well(-9.0), how_well(0.0));
        let nearly = |worse| how_well(worse).ends_with("nearly as well");
        assert_eq!(
            [1.9, 2.0, 10.0, 10.1, 170.0].map(nearly),
            [false, true, true, false, false]
        );
        assert!(how_well(1.9).ends_with("movements as well") && how_well(170.0).contains("error"));
    }

    #[test]
    fn what_adds_to_a_channel_changes_its_sign_with_the_body_that_the_force_is_on() {
        let sign = |name| sign_in_files(Kind::named(name).expect("a kind"), true);
        assert_eq!([sign("force_bias"), sign("force_drift")], [-1.0; 2]);
        assert_eq!([sign("force_gain"), sign("viscous")], [1.0; 2]);
        assert_eq!(sign_in_files(Kind::ForceBias, false), 1.0);
    }
}
