//! The result of a search, and of a first-order screening.

use std::sync::Arc;

use arm_model::{Effect, Model, Refused};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use super::absorbed::{absorbed, stopped};
use super::channel_gap::channel_gaps;
use super::detection_limit::limits;
use super::{
    Absorbed, ChannelGap, Evidence, Fitted, Limit, Missing, Named, Open, Place, SearchInput,
    SearchStep, SimulatedTrial, Suspect, Verdict, Version, at_least, at_most, placed,
};
use crate::data::session::{ComparisonMode, FURTHEST, Session};
use crate::fitting::lack_of_fit::LackOfFit;
use crate::prepared_session::PreparedSession;
use crate::search::conclusion::Finding;
use crate::search::first_order_screening::FirstOrderScreening;

/// Lack of fit of a model on the fit trials; not a number without repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lack {
    /// Variance of what repeats have in common to that of what they differ in.
    pub ratio: f64,
    /// The ratio less one in its standard deviations.
    pub z: f64,
}

impl From<&LackOfFit> for Lack {
    fn from(of: &LackOfFit) -> Self {
        Self {
            ratio: of.ratio,
            z: of.z,
        }
    }
}

/// What the gap workflow came to.
#[derive(Clone, Debug, PartialEq)]
pub struct GapResult {
    /// The verdict.
    pub verdict: Verdict,
    /// What the model lacks, that which explains most first.
    pub effects: Vec<Missing>,
    /// Where the calibrated model and the fit trials disagree, the clearest first.
    pub places: Vec<Place>,
    /// The gap of each channel on the test trials.
    pub gap: Named<ChannelGap>,
    /// Candidates that were not named.
    pub would_have_seen: Vec<Limit>,
    /// Share of what the calibrated model left beyond noise that is still there.
    pub unexplained: f64,
    /// Shape of what is left, in words.
    pub looks_like: Option<String>,
    /// Small imperfections that were refitted.
    pub absorbed: Vec<Absorbed>,
    /// Lack of fit of the calibrated and of the amended model.
    pub lack: [Lack; 2],
    /// Rounds of the search.
    pub search_trace: Vec<SearchStep>,
    /// Remarks on the data.
    pub warnings: Vec<String>,
    /// The model with the named effects, everything refitted.
    pub model: Model,
    /// The calibrated model as it was fitted.
    pub calibrated: Fitted,
    /// The amended model as it was fitted.
    pub amended: Fitted,
    /// Rhythms that were set apart; those with the same phase in every trial are in `model`.
    pub rhythms: Vec<Effect>,
    /// Number of rhythms in `model`: its last effects.
    pub locked: usize,
    /// Misfit for each degree of freedom.
    pub scale: f64,
    /// Every trial, measured and simulated.
    pub trials: Vec<Arc<SimulatedTrial>>,
}

impl GapResult {
    /// What a search found, in the terms of the files.
    ///
    /// # Errors
    /// [`Refused`] where a refitted value is none that a model may have.
    pub fn of<const N: usize>(
        prepared: &PreparedSession<'_, N>,
        finding: &Finding<N>,
        input: &SearchInput<'_>,
    ) -> Result<Self, Refused> {
        let [calibrated, amended] = finding.in_trials.each_ref().map(Vec::as_slice);
        let plays = [
            (Version::Calibrated, calibrated),
            (Version::Amended, amended),
        ];
        let trials = SimulatedTrial::played(prepared, input, &plays);
        let [before, after] = &finding.lack;
        let share = if before.excess.is_finite() && before.excess > 0.0 {
            at_least(after.excess, 0.0) / before.excess
        } else {
            0.0
        };
        let led = prepared.session.comparison == ComparisonMode::Led;
        let gap = channel_gaps(&trials, (N, led), Version::Amended);
        let mut effects = effects(finding, input);
        let verdict = Verdict::of(&Evidence {
            named: !effects.is_empty(),
            is_open: gap.values().any(|gap| gap.open.is_some()),
            z: after.z,
            ratio: after.ratio,
            share,
        });
        if verdict == Verdict::Unexplained {
            effects = effects
                .into_iter()
                .map(Missing::without_intervals)
                .collect();
        }
        let named: Vec<_> = finding
            .named
            .iter()
            .map(|n| &finding.amended.hypothesis.named[n.slot])
            .map(|e| placed(e.kind, e.index))
            .collect();
        let rhythms = || finding.trial_specific.iter().filter(|a| a.trial.is_none());
        let locked: Vec<_> = rhythms()
            .filter(|a| a.locked)
            .map(|a| Effect::from_core(&a.effect))
            .collect();
        let amended = Fitted::of(&finding.amended.hypothesis);
        let unknowns = finding.precision.coordinates.iter();
        let refitted_far = stopped(input, &finding.amended.hypothesis, unknowns.clone());
        Ok(Self {
            verdict,
            places: Vec::new(),
            gap,
            would_have_seen: limits(
                &finding.detection_limits,
                &named,
                &prepared.session.hidden_laws(),
            ),
            unexplained: if verdict == Verdict::Unexplained || !effects.is_empty() {
                at_most(share, 1.0)
            } else {
                0.0
            },
            effects,
            looks_like: None,
            absorbed: absorbed(input, &finding.amended.hypothesis, unknowns),
            lack: finding.lack.each_ref().map(Lack::from),
            search_trace: finding.search_trace.iter().map(SearchStep::of).collect(),
            warnings: held_in_motion(prepared.session)
                .into_iter()
                .chain(withheld(&finding.withheld))
                .chain(refitted_far)
                .collect(),
            model: amended.amended(input.model, &locked)?,
            calibrated: Fitted::of(&finding.calibrated.hypothesis),
            amended,
            rhythms: rhythms().map(|a| Effect::from_core(&a.effect)).collect(),
            locked: locked.len(),
            scale: finding.scale,
            trials: trials.into_iter().map(Arc::new).collect(),
        })
    }

    /// The amended model without rhythms, which are set apart from what is fitted.
    ///
    /// # Errors
    /// [`Refused`] never: it is part of a valid model.
    pub fn lasting(&self) -> Result<Model, Refused> {
        self.model.change(|parts| {
            let kept = parts.effects.len() - self.locked;
            parts.effects.truncate(kept);
        })
    }
}

/// Every named effect, that which explains most first.
fn effects<const N: usize>(finding: &Finding<N>, input: &SearchInput<'_>) -> Vec<Missing> {
    let together = finding.named.iter();
    let together = together.map(|n| Missing::named(n, finding, input));
    let apart = finding.trial_specific.iter();
    let apart = apart.map(|a| Missing::trial_specific(a, finding, input));
    let mut all: Vec<_> = together.chain(apart).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

/// A warning for each joint that moves and is held.
fn held_in_motion<const N: usize>(session: &Session<N>) -> Vec<String> {
    let line = |joint: usize| {
        let j = joint + 1;
        format!(
            "friction holds joint {j} nearly all the time: expressed as a viscosity, it is more than {FURTHEST} times the expected one. The \
             simulation fixes the joint at its initial angle; its laws cannot be identified, and amended.toml has none for it"
        )
    };
    session.held_in_motion().into_iter().map(line).collect()
}

/// A warning about the joints in which names are withheld; `None` for none.
fn withheld(joints: &[usize]) -> Option<String> {
    let numbers: Vec<String> = joints.iter().map(|j| (j + 1).to_string()).collect();
    let (last, others) = numbers.split_last()?;
    let place = match others {
        [] => format!("joint {last}"),
        _ => format!("joints {} and {last}", others.join(", ")),
    };
    Some(format!(
        "{place}: more is missing than spring, viscosity and dry friction, but it is not named, because no effect of the catalogue closes \
         the torque gap without robot angles"
    ))
}

/// An open channel as a row of a list.
#[derive(Serialize)]
struct OpenRow<'a> {
    channel: &'a str,
    #[serde(flatten)]
    open: &'a Open,
}

#[derive(Serialize)]
struct Unexplained<'a> {
    share: f64,
    looks_like: Option<&'a str>,
}

#[derive(Serialize)]
struct LackRows {
    calibrated: Lack,
    amended: Lack,
}

/// The file beside `gap.json` that has the model.
const MODEL_FILE: &str = "amended.toml";

impl Serialize for GapResult {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut out = to.serialize_struct("GapResult", 12)?;
        let open = |(channel, gap)| {
            Some(OpenRow {
                channel,
                open: Option::as_ref(gap)?,
            })
        };
        let rows = self
            .gap
            .iter()
            .map(|(name, gap)| (name.as_str(), &gap.open));
        let [calibrated, amended] = self.lack;
        out.serialize_field("verdict", &self.verdict)?;
        out.serialize_field("effects", &self.effects)?;
        out.serialize_field("where", &self.places)?;
        out.serialize_field("gap", &self.gap)?;
        out.serialize_field("open", &rows.filter_map(open).collect::<Vec<_>>())?;
        out.serialize_field("would_have_seen", &self.would_have_seen)?;
        let left = Unexplained {
            share: self.unexplained,
            looks_like: self.looks_like.as_deref(),
        };
        out.serialize_field("unexplained", &left)?;
        out.serialize_field("calibration", &self.absorbed)?;
        let lack = LackRows {
            calibrated,
            amended,
        };
        out.serialize_field("lack_of_fit", &lack)?;
        out.serialize_field("search_trace", &self.search_trace)?;
        out.serialize_field("warnings", &self.warnings)?;
        out.serialize_field("model", MODEL_FILE)?;
        out.end()
    }
}

/// Result of the first-order screening, in the terms of the files.
#[derive(Clone, Debug, PartialEq)]
pub struct Screening {
    /// Segments, contact and known effects refitted.
    pub model: Model,
    /// Small imperfections that were refitted.
    pub absorbed: Vec<Absorbed>,
    /// The gap of each channel on the test trials; `after` is `None`.
    pub gap: Named<ChannelGap>,
    /// Lack of fit of the calibrated model.
    pub lack: Lack,
    /// Every effect that was tested, alone and to first order, the likeliest first.
    pub suspects: Vec<Suspect>,
}

impl Screening {
    /// Converts the result of the first-order screening to the terms of the files.
    ///
    /// # Errors
    /// [`Refused`] where a refitted value is none that a model may have.
    pub fn of<const N: usize>(
        prepared: &PreparedSession<'_, N>,
        look: &FirstOrderScreening<N>,
        input: &SearchInput<'_>,
    ) -> Result<Self, Refused> {
        let plays = [(Version::Calibrated, look.in_trials.as_slice())];
        let trials = SimulatedTrial::played(prepared, input, &plays);
        let hypothesis = &look.calibrated.hypothesis;
        let led = prepared.session.comparison == ComparisonMode::Led;
        let nuisances = prepared.session.nuisances();
        Ok(Self {
            model: Fitted::of(hypothesis).amended(input.model, &[])?,
            absorbed: absorbed(input, hypothesis, nuisances.iter()),
            gap: channel_gaps(&trials, (N, led), Version::Calibrated),
            lack: Lack::from(&look.lack),
            suspects: look.suspects.iter().map(Suspect::of).collect(),
        })
    }
}

/// The lack of fit of the one model that there is.
#[derive(Serialize)]
struct LackRow {
    calibrated: Lack,
}

impl Serialize for Screening {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut out = to.serialize_struct("Screening", 4)?;
        out.serialize_field("gap", &self.gap)?;
        out.serialize_field("suspects", &self.suspects)?;
        out.serialize_field("calibration", &self.absorbed)?;
        let calibrated = self.lack;
        out.serialize_field("lack_of_fit", &LackRow { calibrated })?;
        out.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_with_withheld_names_stand_in_one_warning() {
        assert_eq!(withheld(&[]), None);
        let place = |joints: &[usize]| {
            let line = withheld(joints)?;
            line.split(':').next().map(str::to_owned)
        };
        assert_eq!(place(&[2]).as_deref(), Some("joint 3"));
        assert_eq!(place(&[0, 1, 2]).as_deref(), Some("joints 1, 2 and 3"));
    }
}
