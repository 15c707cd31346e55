//! The passive base of an arm: the laws of joints that the model leaves without one, identified from measured motion before
//! anything is simulated.
//!
//! A rigid model of literature values cannot follow a person: its free wrist falls. What every passive joint may have, springs with
//! a rest angle, viscosity and dry friction ([`arm_core::effect::Probe::passive`]), is linear in the equation of motion of the
//! measured angles, and is identified there together with the segments. The closed chain is simulated from that on. Its numbers
//! stay free with every question, and are judged last.

use arm_core::effect::{Effect, Family, KINDS, Kind, Place};
use arm_ident::inference::estimate::{Estimate, Quantity};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Role};
use arm_ident::regression::unknown::Source;
use arm_numerics::statistics::distributions::chi_square_tail;

use crate::GapError;
use crate::candidates::candidate::{Candidate, Library, Twin};
use crate::data::passive_law::{Free, Passive};
use crate::data::prepared_session::PreparedSession;
use crate::data::session::{ComparisonMode, Session};
use crate::measurement_model::hypothesis::{Hypothesis, Target};
use crate::selection::fit::{Fitted, Precision};
use crate::selection::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::selection::model_selection::{Alternative, Named};
use crate::selection::search_state::Settled;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Standard deviations from zero beyond which a law that was identified from measured motion is simulated.
const LIKELY: f64 = 2.0;
/// Square of the same beyond which a law stays once it was refitted by simulation: 2 standard deviations,
const STAYS: f64 = 4.0;
/// and what it must gain to be named, 3: with nine such laws an arm without any has a false name in one of eighty sessions.
pub(crate) const NAMED: f64 = 9.0;
/// Part of the whole arm's weight moment that each joint's typical sizes are read off at least: muscles that cross a wrist are made
/// for more than the weight of a hand.
const OF_THE_ARM: f64 = 0.3;
/// Standard deviation of a rest angle about the middle of the angles that were reached \[rad\].
const REST_SD: f64 = 1.0;
/// Distance between the two rest angles at which a spring is regressed \[rad\].
const APART: f64 = 6.0;
/// What speaks for a law that every passive joint has against one that few have, in units of twice the log-likelihood: odds of 20.
const ODDS: f64 = 6.0;
/// Times that something else may take the place of a law of the base.
const EXCHANGES: usize = 3;
/// Times that laws are dropped and the others refitted.
const TURNS: usize = 4;
/// Furthest start of a segment from its literature values, in standard deviations.
const FURTHEST_START: f64 = 3.0;

/// A law of the passive base, and how clearly it stands out.
struct Term {
    /// Its place in the base.
    base: usize,
    /// Square of its first parameter in standard deviations.
    gain: f64,
}

/// A law of the passive base that is named.
pub(crate) struct BaseLaw<const N: usize> {
    /// Its place in the base.
    pub base: usize,
    /// The question that it answers.
    pub question: Candidate,
    /// Square of its first parameter in standard deviations.
    pub gain: f64,
    /// What does as well in its joint.
    pub alternatives: Vec<Alternative>,
    /// The hypothesis in which something else takes its place, where that explains more.
    better: Option<Fitted<N>>,
}

/// What a joint law is asked with in the regression: one column, or two with a rest angle.
struct Column {
    joint: usize,
    kind: Kind,
    rest: Option<usize>,
}

impl<const N: usize> Session<N> {
    /// The same session with the passive base of joints without any law, as measured motion has it.
    ///
    /// Where the regression cannot be made the session stays as it is, and the search starts from the model as given.
    pub fn with_base(mut self) -> Self {
        let joints: Vec<usize> = (0..N).filter(|&j| !self.has_law(j)).collect();
        let forces = self.trials.iter().all(|t| t.force_on_arm.is_some());
        if joints.is_empty() || !forces || self.swings_freely() {
            return self;
        }
        let (columns, fitted) = self.columns(&joints);
        let model = Model {
            chain: self.chain,
            segment_uncertainty: self.segment_uncertainty,
            fitted,
            held: self.effects.clone(),
            contact: self.contact,
        };
        let options = Options {
            motion: MotionSource::Measured,
            tolerance: self.tolerance,
            ..Options::default()
        };
        let Ok(found) = identify(&model, &self.trials, &options) else {
            return self;
        };
        let estimate = |place: usize| {
            let own = |e: &&Estimate| e.quantity == Quantity::Unknown(Source::Effect(place, 0));
            let e = found.parameters.iter().find(own);
            e.map_or((0.0, f64::INFINITY), |e| (e.value, e.std))
        };
        let mut place = 0;
        for column in &columns {
            let (value, sd) = estimate(place);
            let effect = model.fitted[place];
            let mut passive = self.passive(effect, column);
            if let Some(smoothing) = column.kind.smoothed_by()
                && self.comparison == ComparisonMode::Led
            {
                // A joint that rests sticks, until the data say otherwise.
                passive.effect.parameters[smoothing] = 0.0;
            }
            place += 1;
            let mut size = value;
            if let Some(rest) = column.rest {
                let (second, _) = estimate(place);
                let beyond = model.fitted[place].parameters[rest] - effect.parameters[rest];
                place += 1;
                size += second;
                if size > 0.0 {
                    let moved = effect.parameters[rest] + second * beyond / size;
                    let middle = effect.parameters[rest];
                    passive.effect.parameters[rest] =
                        moved.clamp(middle - 2.0 * REST_SD, middle + 2.0 * REST_SD);
                }
            }
            passive.likely = size > 0.0 && size > LIKELY * sd;
            passive.effect.parameters[0] = if passive.likely { size } else { 0.0 };
            if self.comparison == ComparisonMode::Led && self.hardly_moves(column.joint) {
                self.hold(&mut passive);
            }
            self.base.push(passive);
        }
        let (chain, nominal) = (found.chain, self.chain);
        for k in 0..N {
            let (own, given) = (&chain.segments()[k], &nominal.segments()[k]);
            let ratio = |own: f64, given: f64| if given > 0.0 { own / given - 1.0 } else { 0.0 };
            let far = FURTHEST_START * self.segment_uncertainty;
            self.start[k] = [
                ratio(own.mass, given.mass),
                ratio(own.com[0], given.com[0]),
                ratio(own.inertia, given.inertia),
            ]
            .map(|change| change.clamp(-far, far));
        }
        self
    }

    /// Whether the model has a law of a joint.
    fn has_law(&self, joint: usize) -> bool {
        self.effects.iter().any(|e| {
            let crosses = usize::from(e.kind.crosses());
            let here = e.index == joint || e.index == joint + crosses;
            let law = !matches!(e.kind.family(), Family::Segment | Family::Muscle);
            e.kind.info().place == Place::Joint && here && law
        })
    }

    /// The columns of the regression, and the effects that they are the linear parameters of.
    fn columns(&self, joints: &[usize]) -> (Vec<Column>, Vec<Effect<f64>>) {
        let (mut columns, mut effects) = (Vec::new(), Vec::new());
        for &joint in joints {
            for &kind in KINDS.iter().filter(|k| k.probe().passive) {
                let rest = kind.probe().questions.first().and_then(|q| q.rest);
                let mut effect = Effect::<f64>::new(kind, joint);
                effect.parameters[0] = 0.0;
                if let Some(rest) = rest {
                    let middle = self.middle(joint);
                    effect.parameters[rest] = middle;
                    effects.push(effect);
                    effect.parameters[rest] += if middle > 0.0 { -APART } else { APART };
                }
                effects.push(effect);
                columns.push(Column { joint, kind, rest });
            }
        }
        (columns, effects)
    }

    /// The middle of the angles that a joint reached in the fit trials \[rad\].
    fn middle(&self, joint: usize) -> f64 {
        let trials = self.trials.iter().filter(|t| t.role == Role::Fit);
        let angles = trials.flat_map(|t| &t.q).map(|q| q[joint]);
        let (low, high) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| {
            (f64::min(a, q), f64::max(b, q))
        });
        0.5 * (low + high)
    }

    /// Whether a joint stays where it is in all fit trials but for noise. In one of them a sensor may slip.
    pub fn hardly_moves(&self, joint: usize) -> bool {
        /// Range of the angle in the common band \[rad\].
        const STILL: f64 = 0.01;
        let fit = self.fit_trials();
        let moving = fit.iter().filter(|&&trial| {
            let Ok(course) = self.course(trial) else {
                return true;
            };
            let angles = std::iter::zip(&course.seen[joint], &course.counted);
            let counted = angles.filter(|(_, counted)| **counted).map(|(q, _)| *q);
            let (low, high) = counted.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| {
                (a.min(q), b.max(q))
            });
            high - low > STILL
        });
        moving.count() <= usize::from(fit.len() > 1)
    }

    /// Makes of a law of a joint that hardly moves what holds it: friction that sticks, larger than any torque that it must hold. How
    /// large it is cannot be told, nor anything else of the joint.
    fn hold(&self, passive: &mut Passive) {
        passive.likely = passive.effect.is_dry();
        let holding = self.weight_moment(0);
        passive.effect.parameters[0] = if passive.likely { holding } else { 0.0 };
        passive.free.clear();
    }

    /// A law with what is known of its numbers beforehand.
    fn passive(&self, effect: Effect<f64>, column: &Column) -> Passive {
        /// Change of a law's size that a response is taken with, as a share of its typical size.
        const STEP: f64 = 0.01;
        let sd = column.kind.probe().typical * self.weight_moment(column.joint);
        let size = Free {
            parameter: 0,
            mean: 0.0,
            sd,
            lower: 0.0,
            step: STEP * sd,
        };
        let rest = column.rest.map(|parameter| Free {
            parameter,
            mean: effect.parameters[parameter],
            sd: REST_SD,
            lower: f64::NEG_INFINITY,
            step: 1e-3,
        });
        Passive {
            effect,
            free: std::iter::once(size).chain(rest).collect(),
            likely: false,
        }
    }

    /// The weight moment that typical sizes of a joint are read off \[N m\]: of all segments from that joint on, stretched out.
    pub fn weight_moment(&self, joint: usize) -> f64 {
        let [y, z] = self.chain.gravity();
        let g = libm::sqrt(y * y + z * z);
        let beyond = |joint: usize| {
            let mut reach = 0.0;
            let mut sum = 0.0;
            for segment in &self.chain.segments()[joint..] {
                sum += segment.mass * g * (reach + segment.com[0]);
                reach += segment.length;
            }
            sum
        };
        f64::max(beyond(joint), OF_THE_ARM * beyond(0))
    }
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// The laws of the base that are not dropped, as they stand in a fitted hypothesis.
    fn base_terms(
        &self,
        point: &LinearizationPoint<N>,
        fitted: &Fitted<N>,
    ) -> Result<Vec<Term>, GapError> {
        let precision = self.precision(point, fitted, 1.0)?;
        let first = self.session.effects.len();
        let sizes = std::iter::zip(&precision.coordinates, &precision.sd);
        Ok(sizes
            .filter_map(|(c, sd)| match c.target {
                Target::Known(e, 0) if e >= first => {
                    let ratio = fitted.hypothesis.get(c.target) / sd;
                    Some(Term {
                        base: e - first,
                        gain: ratio * ratio,
                    })
                }
                _ => None,
            })
            .collect())
    }

    /// Drops the weakest law of each joint that stands out too little; whether there was one.
    fn dropped_weak(&mut self, terms: &[Term], least: f64) -> bool {
        let joint = |t: &Term| self.session.base[t.base].effect.index;
        let mut weak = Vec::new();
        for j in 0..N {
            let own = terms.iter().filter(|t| joint(t) == j && t.gain < least);
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
    pub(crate) fn calibrate_base(&mut self) -> Result<Settled<'a, N>, GapError> {
        let mut settled = self.calibrate()?;
        for _ in 0..TURNS {
            let terms = self.base_terms(&settled.1, &settled.0)?;
            self.start = Some(settled.0.hypothesis.clone());
            if !self.dropped_weak(&terms, STAYS) {
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

    /// Asks for the laws of the base once more that were dropped before anything was named: what was named since may have hidden
    /// them. `None` where none comes back.
    pub(crate) fn with_base_revived(
        &mut self,
        current: &Fitted<N>,
    ) -> Result<Option<Settled<'a, N>>, GapError> {
        let before = self.dropped.clone();
        if !before.contains(&true) || current.asked.is_empty() {
            return Ok(None);
        }
        for (dropped, law) in self.dropped.iter_mut().zip(&self.session.base) {
            *dropped = current.asked.iter().any(|c| c.is_same_effect(&law.effect));
        }
        let mut start = current.hypothesis.clone();
        for _ in 0..TURNS {
            let Ok((fitted, point)) = self.settle(start, current.asked.clone()) else {
                break;
            };
            let terms = self.base_terms(&point, &fitted)?;
            if !self.dropped_weak(&terms, STAYS) {
                let back = std::iter::zip(&before, &self.dropped).any(|(was, is)| *was && !is);
                if back && fitted.cost < current.cost {
                    return Ok(Some((fitted, point)));
                }
                break;
            }
            start = self.without_dropped(fitted.hypothesis);
        }
        self.dropped = before;
        Ok(None)
    }

    /// Chooses the samples and reads the noise anew from where the next calibration starts.
    fn read_anew(&mut self) -> Result<(), GapError> {
        let anchor = self.linearize(&self.given())?;
        self.leave_out_rest(&anchor);
        let anchor = self.linearize(&self.given())?;
        self.measure_noise(&anchor)
    }

    /// Judges the base once everything is named: laws that do not earn their names are dropped one after the other and the rest is
    /// refitted; what stands in better for one takes its place; what does as well is its alternative.
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
            if self.dropped_weak(&terms, NAMED * scale) {
                let start = self.without_dropped(settled.0.hypothesis);
                settled = self.settle(start, settled.0.asked)?;
                continue;
            }
            let mut laws = self.base_laws(&settled, &terms, scale)?;
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
                // What can be followed but not simulated is no answer.
                Err(_) => {
                    self.dropped[base] = false;
                    return Ok((settled, laws));
                }
            }
        }
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
            let twins = library.add_named(self, point, &named)?;
            for (&l, twin) in own.iter().zip(&twins) {
                let known = first + laws[l].base;
                let held = point.holding(|t| matches!(t, Target::Known(e, _) if e == known));
                let law = &mut laws[l];
                let mut as_named = fitted.clone();
                as_named
                    .hypothesis
                    .named
                    .push(fitted.hypothesis.known[known]);
                as_named.hypothesis.known[known].parameters[0] = 0.0;
                as_named.asked.push(law.question.clone());
                self.judge_base_law(law, (&as_named, twin.as_ref()), (&held, &library), scale);
            }
        }
        Ok(laws)
    }

    /// Looks for what could stand in the place of a law of the base, which is the last of the named effects.
    fn judge_base_law(
        &self,
        law: &mut BaseLaw<N>,
        (fitted, twin): (&Fitted<N>, Option<&Twin>),
        (point, library): (&LinearizationPoint<'a, N>, &Library),
        scale: f64,
    ) {
        let slot = fitted.asked.len() - 1;
        let mut less = fitted.hypothesis.clone();
        less.named.pop();
        // Of what cannot be followed without it nothing can be said.
        let Ok(less) = self.fit(point, less, fitted.asked[..slot].to_vec()) else {
            return;
        };
        let place = (slot, &less, twin);
        let rivals = self.rivals(fitted, place, (point, library), scale);
        let mut rivals = rivals.unwrap_or_default();
        for rival in &mut rivals {
            let alternative = &mut rival.alternative;
            if !alternative.candidate.kind().probe().passive {
                alternative.worse += ODDS;
            }
        }
        let own = (&law.question, law.gain);
        law.better = rivals
            .iter()
            // A law that few joints have is asked beside the base, and does not take its place.
            .filter(|r| r.alternative.candidate.kind().probe().passive)
            .find(|r| self.takes_over(&r.alternative, own, 0.0))
            .map(|r| r.fitted.clone());
        law.alternatives = self.ties(rivals, &law.question, law.gain);
    }

    /// Names a law of the base: it stands among the named effects from here on.
    pub(crate) fn name(
        &self,
        law: BaseLaw<N>,
        amended: &mut Fitted<N>,
        precision: &mut Precision,
    ) -> Named {
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
        Named {
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
    /// Where it cannot be simulated the model as given stands for it, and what it leaves is what the laws of the base gain.
    ///
    /// * `gained` - what each of them gains, in units of twice the log-likelihood
    pub(crate) fn rigid(&self, gained: &[f64]) -> Option<(Fitted<N>, LackOfFit)> {
        if gained.is_empty() {
            return None;
        }
        let session = Session {
            base: Vec::new(),
            start: [[0.0; 3]; N],
            ..self.session.clone()
        };
        let refitted = PreparedSession::with_noise(&session, self.noise.of_others(), self.threads)
            .and_then(|study| study.settle(session.given(), Vec::new()))
            .map(|(fitted, _)| fitted.hypothesis);
        let mut hypothesis = refitted.unwrap_or_else(|_| session.given());
        hypothesis.known = self.session.given().known;
        for passive in &mut hypothesis.known[session.effects.len()..] {
            passive.parameters[0] = 0.0;
        }
        let simulated = self.linearize(&hypothesis).and_then(|anchor| {
            let fitted = self.state(&anchor, hypothesis.clone(), Vec::new())?;
            let lack = lack_of_fit(self, &anchor, &fitted);
            Ok((fitted, lack))
        });
        Some(simulated.unwrap_or_else(|_| {
            let lack = LackOfFit {
                ratio: f64::INFINITY,
                z: f64::INFINITY,
                excess: gained.iter().sum(),
            };
            let fitted = Fitted {
                hypothesis,
                asked: Vec::new(),
                cost: f64::INFINITY,
                residuals: Vec::new(),
            };
            (fitted, lack)
        }))
    }
}
