//! The laws of joints that the model leaves without one, as measured motion has them.
//!
//! A rigid model of literature values cannot follow a person: its free wrist falls. What every passive joint may have, springs with
//! a rest angle, viscosity and dry friction ([`arm_core::effect::Probe::passive`]), is linear in the equation of motion of the
//! measured angles, and is identified there together with the segments.

use arm_core::effect::{Effect, Family, KINDS, Kind, Place};
use arm_ident::inference::estimate::{Estimate, Quantity};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Role};
use arm_ident::regression::unknown::Source;

use crate::data::passive_law::{Free, Passive};
use crate::data::session::{ComparisonMode, Session};
use crate::extent::extent;

/// Standard deviations from zero beyond which a law that was identified from measured motion is simulated.
const LIKELY: f64 = 2.0;
/// Part of the whole arm's weight moment that each joint's typical sizes are read off at least: muscles that cross a wrist are made
/// for more than the weight of a hand.
const OF_THE_ARM: f64 = 0.3;
/// Standard deviation of a rest angle about the middle of the angles that were reached \[rad\].
const REST_SD: f64 = 1.0;
/// Distance between the two rest angles at which a spring is regressed \[rad\].
const APART: f64 = 6.0;
/// Furthest start of a segment from its literature values, in standard deviations.
const FURTHEST_START: f64 = 3.0;

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
        let still = match self.comparison {
            ComparisonMode::Led => self.hardly_moving(),
            ComparisonMode::Torque => [false; N],
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
            if still[column.joint] {
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
        let (low, high) = extent(trials.flat_map(|t| &t.q).map(|q| q[joint]));
        0.5 * (low + high)
    }

    /// Which joints stay where they are in all fit trials but for noise. In one of them a sensor may slip.
    fn hardly_moving(&self) -> [bool; N] {
        /// Range of the angle in the common band \[rad\].
        const STILL: f64 = 0.01;
        let fit = self.fit_trials();
        let mut moving = [0; N];
        for &trial in &fit {
            let course = self.course(trial);
            for (joint, count) in moving.iter_mut().enumerate() {
                let range = course.as_ref().map_or(f64::INFINITY, |course| {
                    let angles = std::iter::zip(&course.seen[joint], &course.counted);
                    let counted = angles.filter(|(_, counted)| **counted);
                    let (low, high) = extent(counted.map(|(q, _)| *q));
                    high - low
                });
                *count += usize::from(range > STILL);
            }
        }
        moving.map(|count| count <= usize::from(fit.len() > 1))
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
