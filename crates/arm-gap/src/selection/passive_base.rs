//! Selection of the laws of the passive base: those that the simulation needs, and those that are named.
//!
//! The closed chain is simulated with the base that was identified from measured motion. Its parameters stay free with every candidate,
//! and its laws are selected last.

use std::sync::Arc;

use arm_core::effect::{Effect, Place};
use arm_numerics::statistics::distributions::chi_square_tail;

use crate::GapError;
use crate::candidates::candidate::Candidate;
use crate::candidates::library::{Library, LibraryEntry};
use crate::data::passive_law::Passive;
use crate::data::session::Session;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::fitting::precision::Precision;
use crate::hypothesis::{Hypothesis, Target};
use crate::prepared_session::PreparedSession;
use crate::selection::model_selection::{FittedAlternative, MissingEffect, TIE};
use crate::selection::passive_base_evidence::{
    LEAST_GAIN_TO_KEEP, ODDS, Term, crossed_joints, least_of,
};
use crate::selection::search_state::Settled;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Times that something else may take the place of a law of the base.
const EXCHANGES: usize = 3;
/// Times that laws are dropped and the others refitted.
const TURNS: usize = 4;

/// A law of the passive base that is named.
#[derive(Clone)]
pub(crate) struct BaseLaw<const N: usize> {
    /// Its place in the base.
    pub base: usize,
    /// Its candidate.
    pub question: Candidate,
    /// Square of its first parameter in standard deviations.
    pub gain: f64,
    /// What does as well in its joint.
    pub alternatives: Vec<FittedAlternative>,
    /// The hypothesis in which something else takes its place, where that explains more.
    better: Option<FittedHypothesis<N>>,
    /// What came clearly nearer to the data with something else in its place, whatever that is.
    nearer: Option<FittedHypothesis<N>>,
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// The laws of the base that are not dropped, as they stand in a fitted hypothesis.
    fn base_terms(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Result<Vec<Term>, GapError> {
        let mut precision = self.precision(point, fitted, 1.0)?;
        if precision.sd.iter().all(|sd| sd.is_infinite()) {
            precision = self.precision_beside_named(point, fitted);
        }
        let first = self.session.effects.len();
        let sizes = std::iter::zip(&precision.coordinates, &precision.sd);
        Ok(sizes
            .filter_map(|(c, sd)| match c.target {
                Target::Known(e, 0) if e >= first => {
                    let ratio = fitted.hypothesis.get(c.target) / sd;
                    Some(Term {
                        base: e - first,
                        sd: *sd,
                        gain: ratio * ratio,
                    })
                }
                _ => None,
            })
            .collect())
    }

    /// The laws of the base with what each explains, in units of the noise.
    pub(crate) fn gains_of_base(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Result<Vec<(Effect<f64>, f64)>, GapError> {
        if self.session.base.is_empty() {
            return Ok(Vec::new());
        }
        let terms = self.base_terms(point, fitted)?;
        let with_law = |t: Term| (self.session.base[t.base].effect, t.gain);
        Ok(terms.into_iter().map(with_law).collect())
    }

    /// The dry law of the base in a joint, with how much worse a fitted hypothesis does without it. The response of a sticking joint is far from
    /// proportional to its friction, so standard deviations do not give what it explains.
    pub(crate) fn gain_of_dry_law(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
        joint: usize,
    ) -> Option<(Effect<f64>, f64)> {
        let first = self.session.effects.len();
        let mut kept = (0..self.session.base.len()).filter(|&b| !self.dropped[b]);
        let law = |b: usize| &fitted.hypothesis.known[first + b];
        let known =
            first + kept.find(|&b| law(b).index == joint && law(b).kind.smoothed_by().is_some())?;
        let held = point.holding(|t| matches!(t, Target::Known(e, _) if e == known));
        let mut without = fitted.hypothesis.clone();
        let effect = without.known[known];
        without.known[known].parameters[0] = 0.0;
        let less = self.fit(&held, without, fitted.asked.clone()).ok()?;
        Some((effect, less.cost - fitted.cost))
    }

    /// Drops the weakest law of each joint that stands out too little; whether there was one.
    ///
    /// * `least` - what a law must gain to stay
    fn dropped_weak(&mut self, terms: &[Term], least: impl Fn(&Term, &Passive) -> f64) -> bool {
        let law = |t: &Term| &self.session.base[t.base];
        let mut weak = Vec::new();
        for j in 0..N {
            let own = terms
                .iter()
                .filter(|t| law(t).effect.index == j && t.gain < least(t, law(t)));
            weak.extend(own.min_by(|a, b| a.gain.total_cmp(&b.gain)).map(|t| t.base));
        }
        for &b in &weak {
            self.dropped[b] = true;
        }
        !weak.is_empty()
    }

    /// Calibrates with the passive base: what measured motion suggested and the simulation does not need is dropped.
    ///
    /// # Errors
    /// As [`PreparedSession::calibrate`].
    pub fn calibrate_base(&mut self) -> Result<Settled<'a, N>, GapError> {
        let calibrated = self.calibrate()?;
        let mut settled = self.with_unlikely_laws(calibrated);
        for _ in 0..TURNS {
            let terms = self.base_terms(&settled.1, &settled.0)?;
            self.start = Some(settled.0.hypothesis.clone());
            if !self.dropped_weak(&terms, |_, _| LEAST_GAIN_TO_KEEP) {
                break;
            }
            self.read_anew()?;
            settled = self.calibrate()?;
        }
        if !self.session.base.is_empty() {
            self.start = Some(settled.0.hypothesis.clone());
        }
        self.with_friction_at_rest(settled)
    }

    /// Calibrates again with the laws that measured motion does not show, where much is left; keeps that fit if it costs less. If the speed of
    /// a joint is mostly noise, its viscosity can appear as dry friction.
    fn with_unlikely_laws(&mut self, settled: Settled<'a, N>) -> Settled<'a, N> {
        if !settled.0.leaves_much() {
            return settled;
        }
        let before = self.dropped.clone();
        for (dropped, law) in self.dropped.iter_mut().zip(&self.session.base) {
            *dropped &= law.free.is_empty();
        }
        if self.dropped != before
            && let Ok(all) = self.calibrate()
            && all.0.cost + all.0.enough() < settled.0.cost
        {
            return all;
        }
        self.dropped = before;
        settled
    }

    /// Calibrates again from the laws as they were identified from measured motion, where much is left; keeps the fit with the lower misfit. A
    /// slip of the handle in one trial can lead the first fit to a wrong minimum, even after its samples are left out. Where it cannot be
    /// calibrated again, the first fit stays.
    pub fn with_base_anew(&mut self, settled: Settled<'a, N>) -> Settled<'a, N> {
        if self.session.base.is_empty() || !settled.0.leaves_much() {
            return settled;
        }
        let mut anew = self.clone();
        anew.start = None;
        anew.dropped = self.session.unlikely_laws();
        let calibrated = anew.read_anew().and_then(|()| anew.calibrate_base());
        // The two fits may have other samples and another noise.
        match calibrated {
            Ok(calibrated) if calibrated.0.misfit() < settled.0.misfit() => {
                *self = anew;
                calibrated
            }
            _ => settled,
        }
    }

    /// Tests the laws of the base again that were dropped before anything was named, as an effect named since may have hidden them. They
    /// start at their values from measured motion; so do all laws where much is left, as a sticking joint can make a fit diverge. `None`
    /// where none comes back and nothing is gained.
    pub(crate) fn with_base_revived(
        &mut self,
        current: &FittedHypothesis<N>,
    ) -> Result<Option<Settled<'a, N>>, GapError> {
        let before = self.dropped.clone();
        let is_bent = current.leaves_much();
        let is_settled = !is_bent && (current.asked.is_empty() || !before.contains(&true));
        if before.is_empty() || is_settled {
            return Ok(None);
        }
        for (dropped, law) in self.dropped.iter_mut().zip(&self.session.base) {
            *dropped = current.asked.iter().any(|c| c.is_same_effect(&law.effect));
        }
        let mut start = current.hypothesis.clone();
        let mut asked = current.asked.clone();
        let first = self.session.effects.len();
        for b in (0..before.len()).filter(|&b| (is_bent || before[b]) && !self.dropped[b]) {
            start.known[first + b] = self.session.base[b].effect;
        }
        // What the rest angle of a spring that comes back stands for is not named beside it.
        for slot in (0..asked.len()).rev() {
            let named = &start.named[slot];
            if named.is_constant() && self.has_in_base(named.kind, named.index) {
                start.named.remove(slot);
                asked.remove(slot);
            }
        }
        for _ in 0..TURNS {
            let Ok((fitted, point)) = self.settle(start, asked.clone()) else {
                break;
            };
            let terms = self.base_terms(&point, &fitted)?;
            let crossed = crossed_joints::<N>(&fitted.hypothesis.named);
            if !self.dropped_weak(&terms, |_, law| {
                least_of(&law.effect, &crossed, LEAST_GAIN_TO_KEEP)
            }) {
                let back = std::iter::zip(&before, &self.dropped).any(|(was, is)| *was && !is);
                if (back || is_bent) && fitted.cost + fitted.enough() < current.cost {
                    return Ok(Some((fitted, point)));
                }
                break;
            }
            start = self.without_dropped(fitted.hypothesis);
        }
        self.dropped = before;
        Ok(None)
    }

    /// Laws of the base that were dropped, in the place of a named effect of their joint with shapes of its own, where that shows no more
    /// than they do: a reflex without threshold and latency is a viscosity, and a spring over two joints that turns one of them alone is a
    /// spring of that one. `None` where nothing is.
    pub(crate) fn with_base_instead(
        &mut self,
        current: &FittedHypothesis<N>,
        point: &LinearizationPoint<N>,
    ) -> Result<Option<Settled<'a, N>>, GapError> {
        if current.asked.is_empty() || !self.dropped.contains(&true) {
            return Ok(None);
        }
        let (before, first) = (self.dropped.clone(), self.session.effects.len());
        let base = self.gains_of_base(point, current)?;
        for (slot, own) in current.asked.iter().enumerate() {
            let crosses = own.kind().crosses();
            let in_joint =
                own.kind().info().place == Place::Joint && (own.shapes() > 0.0 || crosses);
            let (mut start, mut asked) = (current.hypothesis.clone(), current.asked.clone());
            let instead = start.named.remove(slot);
            asked.remove(slot);
            let mut back = false;
            for (b, law) in self.session.base.iter().enumerate() {
                let here = in_joint && law.effect.index == own.effect.index;
                if self.dropped[b] && here && !law.free.is_empty() {
                    (self.dropped[b], back) = (false, true);
                    start.known[first + b] = law.effect;
                    if law.effect.kind.family() == instead.kind.family() {
                        // Of the same unit: without its shapes it would be as large.
                        start.known[first + b].parameters[0] = instead.parameters[0];
                    }
                }
            }
            if !back {
                continue;
            }
            let shapes = self.price_of_shapes(std::slice::from_ref(own));
            let price = if crosses {
                own.price * own.spread
            } else {
                shapes
            };
            // A shape may explain the error of the law of another one.
            let bent = self.mimicked_beside((current, slot, current), &base, point);
            if let Ok((fitted, point)) = self.settle(start, asked)
                && fitted.cost < current.cost + f64::max(price, bent)
            {
                return Ok(Some((fitted, point)));
            }
            self.dropped.clone_from(&before);
        }
        Ok(None)
    }

    /// Chooses the samples and reads the noise anew from where the next calibration starts.
    fn read_anew(&mut self) -> Result<(), GapError> {
        let point = self.simulate_alone(&self.given())?;
        self.leave_out_rest(&point);
        let point = self.simulate_alone(&self.given())?;
        self.measure_noise(&point)
    }

    /// Selects the laws of the base once everything is named: laws below their price are dropped one after the other and the rest is
    /// refitted; an effect that explains more replaces a law; one that explains as much is its alternative.
    ///
    /// # Errors
    /// As [`PreparedSession::settle`].
    pub(crate) fn judged_base(
        &mut self,
        mut settled: Settled<'a, N>,
        scale: f64,
    ) -> Result<(Settled<'a, N>, Vec<BaseLaw<N>>), GapError> {
        let mut exchanges = 0;
        loop {
            let terms = self.base_terms(&settled.1, &settled.0)?;
            let crossed = crossed_joints::<N>(&settled.0.hypothesis.named);
            let least = |term: &Term, law: &Passive| {
                least_of(&law.effect, &crossed, term.least_to_be_named(law) * scale)
            };
            if self.dropped_weak(&terms, least) {
                let start = self.without_dropped(settled.0.hypothesis);
                settled = self.settle(start, settled.0.asked)?;
                continue;
            }
            let mut laws = self.base_laws(&settled, &terms, scale)?;
            if exchanges < EXCHANGES
                && let Some(nearer) = self.fitted_from_nearer(&settled.0, &laws, scale)
            {
                exchanges += 1;
                settled = nearer;
                continue;
            }
            let better = laws
                .iter_mut()
                .find_map(|law| Some((law.base, law.better.take()?)));
            let Some((base, better)) = better.filter(|_| exchanges < EXCHANGES) else {
                return Ok((settled, laws));
            };
            exchanges += 1;
            self.dropped[base] = true;
            match self.settle(better.hypothesis, better.asked) {
                Ok(exchanged) => settled = exchanged,
                // A solution that can be followed but not simulated is refused.
                Err(_) => {
                    self.dropped[base] = false;
                    return Ok((settled, laws));
                }
            }
        }
    }

    /// The fit once more from where another law in the place of one came clearly nearer to the data, where that is clearly nearer with the law
    /// itself: then not the law was wrong, but the fit had stopped short.
    fn fitted_from_nearer(
        &self,
        fitted: &FittedHypothesis<N>,
        laws: &[BaseLaw<N>],
        scale: f64,
    ) -> Option<Settled<'a, N>> {
        let first = self.session.effects.len();
        laws.iter().find_map(|law| {
            let mut start = law.nearer.as_ref()?.hypothesis.clone();
            start.named.pop();
            start.known[first + law.base] = fitted.hypothesis.known[first + law.base];
            let again = self.settle(start, fitted.asked.clone()).ok()?;
            (again.0.cost + TIE * scale < fitted.cost).then_some(again)
        })
    }

    /// The laws of the base as they would be among the named effects, each with what could stand in its place in the same joint.
    fn base_laws(
        &self,
        (fitted, point): &Settled<'a, N>,
        terms: &[Term],
        scale: f64,
    ) -> Result<Vec<BaseLaw<N>>, GapError> {
        let first = self.session.effects.len();
        let rows = self.rows_of_references();
        let mut laws = Vec::new();
        for term in terms {
            let effect = fitted.hypothesis.known[first + term.base];
            let Some(question) = Candidate::again(self, point, effect, &[0]) else {
                continue;
            };
            let expected = self.session.base[term.base].free.clone();
            laws.push(BaseLaw {
                base: term.base,
                question: question.passive(expected, rows),
                gain: term.gain / scale,
                alternatives: Vec::new(),
                better: None,
                nearer: None,
            });
        }
        for joint in 0..N {
            let own: Vec<usize> = (0..laws.len())
                .filter(|&l| laws[l].question.effect.index == joint)
                .collect();
            if own.is_empty() {
                continue;
            }
            let mut library = Library::of_joint(self, point, joint)?;
            let effect = |l: usize| fitted.hypothesis.known[first + laws[l].base];
            let named: Vec<_> = own
                .iter()
                .map(|&l| (laws[l].question.clone(), effect(l)))
                .collect();
            let entries = library.add_named(self, point, &named)?;
            let judged = self.parallel(own.len(), |i| {
                let mut law = laws[own[i]].clone();
                let known = first + law.base;
                let held = point.holding(|t| matches!(t, Target::Known(e, _) if e == known));
                let mut as_named = fitted.clone();
                as_named
                    .hypothesis
                    .named
                    .push(fitted.hypothesis.known[known]);
                as_named.hypothesis.known[known].parameters[0] = 0.0;
                as_named.asked.push(law.question.clone());
                let as_named = (&as_named, entries[i].as_ref());
                self.judge_base_law(&mut law, as_named, (&held, &library), scale);
                law
            });
            for (&l, law) in own.iter().zip(judged) {
                laws[l] = law;
            }
        }
        Ok(laws)
    }

    /// Searches for effects that could replace a law of the base, which is the last of the named effects.
    fn judge_base_law(
        &self,
        law: &mut BaseLaw<N>,
        (fitted, entry): (&FittedHypothesis<N>, Option<&LibraryEntry>),
        (point, library): (&LinearizationPoint<'a, N>, &Library),
        scale: f64,
    ) {
        let slot = fitted.asked.len() - 1;
        let mut less = fitted.hypothesis.clone();
        less.named.pop();
        // Where the run cannot be followed without it, its gain is unknown.
        let Ok(less) = self.fit(point, less, fitted.asked[..slot].to_vec()) else {
            return;
        };
        let place = (slot, &less, entry);
        let most = self.most_worse(&law.question, law.gain, 0.0);
        let alternatives = self.alternatives(fitted, place, (point, library), (scale, most));
        let mut alternatives = alternatives.unwrap_or_default();
        let all = alternatives.iter().map(|r| &r.fitted);
        law.nearer = all
            .filter(|other| other.cost + TIE * scale < fitted.cost)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .cloned();
        for converged in &mut alternatives {
            let alternative = &mut converged.alternative;
            if !alternative.candidate.kind().prior().passive {
                alternative.worse += ODDS;
            }
        }
        let own = (&law.question, law.gain);
        law.better = alternatives
            .iter()
            // A law that few joints have is tested beside the base, and does not replace it.
            .filter(|r| r.alternative.candidate.kind().prior().passive)
            .find(|r| self.takes_over(&r.alternative, own, 0.0))
            .map(|r| r.fitted.clone());
        law.alternatives = self.ties(alternatives, &law.question, law.gain);
    }

    /// Names a law of the base: it stands among the named effects from here on.
    pub(crate) fn name(
        &self,
        law: BaseLaw<N>,
        amended: &mut FittedHypothesis<N>,
        precision: &mut Precision,
    ) -> MissingEffect {
        let (known, slot) = (self.session.effects.len() + law.base, amended.asked.len());
        for c in &mut precision.coordinates {
            if let Target::Known(e, p) = c.target
                && e == known
            {
                c.target = Target::Named(slot, p);
            }
        }
        let effect = amended.hypothesis.known[known];
        amended.hypothesis.named.push(effect);
        let width = law.question.width();
        amended.asked.push(law.question);
        MissingEffect {
            slot,
            p_value: chi_square_tail(law.gain, width),
            gain: law.gain,
            share: 0.0,
            alternatives: law.alternatives,
        }
    }

    /// A hypothesis in which dropped laws do nothing.
    pub(crate) fn without_dropped(&self, mut hypothesis: Hypothesis<N>) -> Hypothesis<N> {
        let first = self.session.effects.len();
        for (b, _) in self.dropped.iter().enumerate().filter(|(_, d)| **d) {
            hypothesis.known[first + b].parameters[0] = 0.0;
        }
        hypothesis
    }

    /// Where calibration starts: the model as given with its base, or where the base was calibrated.
    pub(crate) fn given(&self) -> Hypothesis<N> {
        let start = match &self.start {
            Some(start) => start.clone(),
            None => self.session.starting(),
        };
        self.without_dropped(start)
    }

    /// The model as given, refitted without its base, and what it leaves; `None` where there is no base.
    ///
    /// Where it cannot be simulated the model as given replaces it, and its residual is the gain of the laws of the base.
    ///
    /// * `gained` - what each of them gains, in units of twice the log-likelihood
    pub(crate) fn rigid(&self, gained: &[f64]) -> Option<(FittedHypothesis<N>, LackOfFit)> {
        if gained.is_empty() {
            return None;
        }
        let session = Session {
            base: Vec::new(),
            start: [[0.0; 3]; N],
            ..self.session.clone()
        };
        let refitted = PreparedSession::with_noise(&session, self.noise.of_others(), self.threads)
            .and_then(|prepared| prepared.settle(session.given(), Vec::new()))
            .map(|(fitted, _)| fitted.hypothesis);
        let mut hypothesis = refitted.unwrap_or_else(|_| session.given());
        hypothesis.known = self.session.given().known;
        for passive in &mut hypothesis.known[session.effects.len()..] {
            passive.parameters[0] = 0.0;
        }
        let simulated = self.simulate_alone(&hypothesis).and_then(|point| {
            let fitted = self.state(&point, hypothesis.clone(), Vec::new())?;
            let lack = lack_of_fit(self, &point, &fitted);
            Ok((fitted, lack))
        });
        Some(simulated.unwrap_or_else(|_| {
            let lack = LackOfFit {
                ratio: f64::INFINITY,
                z: f64::INFINITY,
                excess: gained.iter().sum(),
            };
            let fitted = FittedHypothesis {
                hypothesis,
                asked: Vec::new(),
                cost: f64::INFINITY,
                rows: 0,
                residuals: Vec::new(),
                without: Arc::default(),
            };
            (fitted, lack)
        }))
    }

    /// The model as given, with everything refitted that was never exact.
    ///
    /// # Errors
    /// As [`PreparedSession::settle`].
    pub fn calibrate(&self) -> Result<Settled<'a, N>, GapError> {
        self.settle(self.given(), Vec::new())
    }
}
