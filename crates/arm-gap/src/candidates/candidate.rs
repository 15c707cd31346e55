//! A candidate of the search: a kind of the catalogue at a place in a shape, and its free parameters.

use arm_core::effect::{Effect, Kind, Nature, Part, Place};

use crate::candidates::refined_shapes::{held, is_plainer, refined};
use crate::candidates::torque_step::{motions, torque_step};
use crate::data::passive_law::Free;
use crate::data::session::Session;
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::linearization::linear_response::Change;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Gain needed by one effect beyond its degrees of freedom, in units of twice the log-likelihood: about one false name in a thousand
/// sessions for a hundred candidates, at 4.4 standard deviations for one parameter.
pub const THRESHOLD: f64 = 12.0;
/// One question: a kind at a place in a shape, with what is free in it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The effect with its free parameters at zero.
    pub effect: Effect<f64>,
    /// Which of the kind's questions.
    pub question: usize,
    /// Positions of the parameters that are free.
    pub free: Vec<usize>,
    /// Position of a rest angle that is free with them.
    pub rest: Option<usize>,
    /// Shapes that are refined once it is named: their positions and limits.
    pub refined: Vec<(usize, (f64, f64))>,
    /// Number of shapes that were tried.
    pub tried: usize,
    /// Change of the free parameters with which responses are taken.
    pub step: f64,
    /// Gain needed to be named, in units of twice the log-likelihood, where scores scatter as the noise model predicts; zero
    /// before a score test has set it.
    pub price: f64,
    /// Scatter of its score between repeats, relative to that of the noise model.
    pub spread: f64,
    /// Its gain in the last comparison with the other named effects, in units of cost; infinite before.
    pub gained: f64,
    /// Priors of its parameters: the sizes that are usual for an arm of this weight.
    pub expected: Vec<Free>,
}

impl Candidate {
    /// The kind.
    pub fn kind(&self) -> Kind {
        self.effect.kind
    }

    /// Whether it is about dry friction.
    pub fn is_dry_friction(&self) -> bool {
        self.kind().smoothed_by().is_some()
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.free.len() + usize::from(self.rest.is_some())
    }

    /// Refines no shape, and leaves those of which only an expected value is known, as a latency, at the default of the catalogue.
    pub(super) fn keep_shapes(&mut self, part: &Part) {
        self.refined.clear();
        for &(p, _) in part.expected {
            self.effect.parameters[p] = self.effect.kind.info().parameters[p].default;
            self.expected.retain(|e| e.parameter != p);
        }
    }

    /// Number of shapes that a fit refines: of two explanations that are as good, the one with fewer is meant.
    pub fn shapes(&self) -> f64 {
        (usize::from(self.rest.is_some()) + self.refined.len()) as f64
    }

    /// Whether it fits best in a shape in which it is another, plainer law.
    pub fn is_plainer(&self, effect: &Effect<f64>) -> bool {
        is_plainer(&self.refined, effect)
    }

    /// Whether all its free parameters are zero in an effect.
    pub fn is_nothing(&self, effect: &Effect<f64>) -> bool {
        self.free.iter().all(|&p| effect.parameters[p] == 0.0)
    }

    /// Whether it is about the same kind at the same place.
    pub fn is_same_effect(&self, effect: &Effect<f64>) -> bool {
        self.effect.kind == effect.kind && self.effect.index == effect.index
    }

    /// Whether it is a law of the same family in the same joint.
    pub fn is_of_family_in_joint(&self, effect: &Effect<f64>) -> bool {
        let own = &self.effect;
        own.kind.info().place == Place::Joint
            && (own.kind.family(), own.index, own.kind.crosses())
                == (effect.kind.family(), effect.index, effect.kind.crosses())
    }

    /// Whether it is the same candidate, in any shape.
    pub fn is_same_question(&self, other: &Self) -> bool {
        self.is_same_effect(&other.effect) && self.question == other.question
    }

    /// Smallest and largest value that each column's coefficient may have.
    pub fn bounds(&self, column: usize) -> (f64, f64) {
        if self.rest.is_some() {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let parameter = &self.effect.kind.info().parameters[self.free[column]];
        (parameter.min, parameter.max)
    }

    /// The least that its two columns with a rest angle may be together: a spring of less than no stiffness is none. `None` without one.
    pub fn least_of_sum(&self) -> Option<f64> {
        let parameters = self.effect.kind.info().parameters;
        self.rest.map(|_| parameters[self.free[0]].min)
    }

    /// The effect whose response each column is: one unit of it.
    pub(super) fn unit(&self, column: usize, size: f64) -> Effect<f64> {
        let mut effect = self.effect;
        match self.rest {
            Some(rest) => {
                effect.parameters[self.free[0]] = size;
                effect.parameters[rest] += column as f64;
            }
            None => effect.parameters[self.free[column]] = size,
        }
        effect
    }

    /// The changes of a hypothesis whose responses are its columns.
    pub fn changes<const N: usize>(
        &self,
        session: &Session<N>,
        hypothesis: &Hypothesis<N>,
    ) -> Vec<Change<N>> {
        let one = |column: usize| {
            let mut changed = hypothesis.clone();
            changed.named.push(self.unit(column, self.step));
            let target = Target::Named(changed.named.len() - 1, 0);
            let sensing = session.is_sensing(&changed, target);
            Change {
                changed,
                size: self.step,
                sensing,
                moves_handle: false,
            }
        };
        (0..self.width()).map(one).collect()
    }

    /// The candidate of an effect, with its shape: its free parameters are set to zero.
    ///
    /// `None` where no candidate of the kind has these parameters free, or these movements do not excite it.
    ///
    pub fn again<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        mut effect: Effect<f64>,
        free: &[usize],
    ) -> Option<Self> {
        let parts = effect.kind.prior().parts;
        let number = parts.iter().position(|part| part.sizes == free)?;
        let part = &parts[number];
        for &p in free {
            effect.parameters[p] = 0.0;
        }
        let mut candidate = Self {
            effect,
            question: number,
            free: free.to_vec(),
            rest: part.rest,
            refined: refined(prepared.session, &effect, part),
            tried: 1,
            step: part.small,
            price: 0.0,
            spread: 1.0,
            gained: f64::INFINITY,
            expected: expected(prepared.session, &effect, part),
        };
        if candidate.step == 0.0 {
            candidate.step = torque_step(
                &motions(prepared, point),
                candidate.unit(0, 1.0),
                candidate.free[0],
            )?;
        }
        Some(candidate)
    }

    /// The same as a law of the passive base, which is fitted as it was there.
    ///
    /// * `rows` - rows of data that decide it
    pub fn passive(self, expected: Vec<Free>, rows: usize) -> Self {
        Self {
            refined: Vec::new(),
            price: price(self.width(), 1, rows),
            expected,
            ..self
        }
    }

    /// The same about an effect that sticks or creeps at rest as another one of its kind.
    pub fn at_rest_as(mut self, effect: &Effect<f64>) -> Self {
        if let Some(smoothing) = effect.kind.smoothed_by() {
            self.effect.parameters[smoothing] = effect.parameters[smoothing];
            self.refined.retain(|(p, _)| Some(*p) != held(effect));
        }
        self
    }

    /// The effect with the coefficients of its columns.
    ///
    /// With a rest angle the two columns are the effect at two rest angles: together they are one effect at another rest.
    pub fn found(&self, coefficients: &[f64]) -> Effect<f64> {
        let mut effect = self.effect;
        match self.rest {
            Some(rest) => {
                let amplitude = coefficients[0] + coefficients[1];
                let parameter = &effect.kind.info().parameters[rest];
                effect.parameters[self.free[0]] = amplitude;
                if amplitude != 0.0 {
                    let moved = effect.parameters[rest] + coefficients[1] / amplitude;
                    effect.parameters[rest] = moved.clamp(parameter.min, parameter.max);
                }
            }
            None => {
                for (&p, &value) in self.free.iter().zip(coefficients) {
                    let parameter = &effect.kind.info().parameters[p];
                    effect.parameters[p] = value.clamp(parameter.min, parameter.max);
                }
            }
        }
        effect
    }

    /// The numbers that a fit may change once the effect stands at a place in the list of named ones.
    pub fn coordinates(&self, slot: usize, effect: &Effect<f64>) -> Vec<Coordinate> {
        let info = effect.kind.info();
        let whole = |p: usize| (info.parameters[p].min, info.parameters[p].max);
        let free = self.free.iter().map(|&p| (p, whole(p), self.step));
        let rest = self.rest.map(|p| (p, whole(p)));
        let share = match effect.kind.prior().nature {
            // A frequency that is a little off is out of step at the end of a trial.
            Nature::Periodic | Nature::Rhythm => 0.0,
            _ => 0.05,
        };
        let shapes = rest.iter().chain(&self.refined).map(|&(p, limits)| {
            let size = (share * effect.parameters[p].abs()).max(1e-3);
            (p, limits, size)
        });
        free.chain(shapes)
            .map(|(p, (lower, upper), step)| Coordinate {
                target: Target::Named(slot, p),
                prior: self
                    .expected
                    .iter()
                    .find(|e| e.parameter == p)
                    .map(|e| (e.mean, e.sd)),
                lower,
                upper,
                step,
            })
            .collect()
    }
}

#[cfg(test)]
impl Candidate {
    /// A candidate for the first parameter of an effect, before a score test.
    pub(crate) fn about(effect: Effect<f64>) -> Self {
        Self {
            effect,
            question: 0,
            free: vec![0],
            rest: None,
            refined: Vec::new(),
            tried: 1,
            step: 1.0,
            price: 0.0,
            spread: 1.0,
            gained: f64::INFINITY,
            expected: Vec::new(),
        }
    }
}

/// What an effect must gain to be named: the threshold, Schwarz' price of its numbers, and that of the shapes that were tried.
///
/// * `rows` - rows of data that decide it
pub fn price(width: usize, tried: usize, rows: usize) -> f64 {
    THRESHOLD + width as f64 * libm::log(rows as f64) + 2.0 * libm::log(tried as f64)
}

/// Priors of the parameters of an effect: of the first one in a joint from the weight that the joint bears, and of shapes
/// from the kind.
pub(super) fn expected<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    part: &Part,
) -> Vec<Free> {
    let typical = effect.kind.prior().typical;
    let in_joint = typical != 0.0 && effect.kind.info().place == Place::Joint;
    let size = in_joint.then(|| typical * session.weight_moment(effect.index.min(N - 1)));
    let size = size.map(|sd| (0, [0.0, sd]));
    let shapes = part.expected.iter().copied();
    size.into_iter().chain(shapes).map(Free::expected).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_in_one_direction_is_something_and_a_spring_without_stiffness_nothing() {
        let of = |kind, free: &[usize]| Candidate {
            free: free.to_vec(),
            ..Candidate::about(Effect::new(kind, 0))
        };
        let slip = of(Kind::HandleSlip, &[0, 1]);
        assert!(!slip.is_nothing(&Effect::new(Kind::HandleSlip, 0).with(&[0.0, 0.002])));
        let spring = of(Kind::Relaxation, &[0]);
        assert!(spring.is_nothing(&Effect::new(Kind::Relaxation, 0).with(&[0.0, 2.4])));
        assert!(!spring.is_nothing(&Effect::new(Kind::Relaxation, 0).with(&[0.1, 2.4])));
    }

    #[test]
    fn two_laws_of_a_family_in_one_joint_are_kin() {
        let end = Candidate::about(Effect::new(Kind::EndRange, 1));
        let is_kin = |kind, index| end.is_of_family_in_joint(&Effect::new(kind, index));
        assert!(is_kin(Kind::CubicElastic, 1) && is_kin(Kind::EndRange, 1));
        assert!(!is_kin(Kind::CubicElastic, 0) && !is_kin(Kind::Coulomb, 1));
        // A sensor is no joint, whatever its channel's number is.
        let bias = Candidate::about(Effect::new(Kind::ForceBias, 1));
        assert!(!bias.is_of_family_in_joint(&Effect::new(Kind::ForceBias, 1)));
    }
}
