//! The questions that a session can answer: each kind of the catalogue at each of its places, in each of its shapes.

use arm_core::effect::{
    Effect, Kind, Local, MAX_STATES, Motion, Nature, Place, Question, Values, advance_states,
    resisting_torque,
};
use arm_core::{Joints, Pose, inverse_dynamics, joint_force};
use arm_numerics::statistics::extent::extent;

use crate::GapError;
use crate::candidates::refined_shapes::{held, refined};
use crate::data::passive_law::Free;
use crate::data::prepared_session::PreparedSession;
use crate::data::session::{ComparisonMode, Session};
use crate::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use crate::sensitivity::linearization_point::{Change, LinearizationPoint};
use crate::sensitivity::response::Response;

/// Share of a joint's torque that an effect has in the change with which its response is taken.
const SHARE: f64 = 0.02;
/// What one effect must earn beyond its freedom, in units of twice the log-likelihood: about one false name in a thousand
/// sessions for a hundred candidates, at 4.4 standard deviations for one parameter.
pub const THRESHOLD: f64 = 12.0;
/// Torque below which a joint counts as unloaded \[N m\].
const UNLOADED: f64 = 0.05;

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
    /// How many shapes were tried of this question.
    pub tried: usize,
    /// Change of the free parameters with which responses are taken.
    pub step: f64,
    /// What it must earn to be named where scores scatter as the noise tells, in units of twice the log-likelihood; zero
    /// before a scan has set it.
    pub price: f64,
    /// How much more its score scatters between repeats than the noise tells.
    pub spread: f64,
    /// What is known of its numbers before the data: the sizes that an arm of this weight may have.
    pub expected: Vec<Free>,
}

impl Candidate {
    /// The kind.
    pub fn kind(&self) -> Kind {
        self.effect.kind
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.free.len() + usize::from(self.rest.is_some())
    }

    /// Refines no shape, and leaves those of which only an expected value is known, as a latency, at the default of the catalogue.
    fn keep_shapes(&mut self, question: &Question) {
        self.refined.clear();
        for &(p, _) in question.expected {
            self.effect.parameters[p] = self.effect.kind.info().parameters[p].default;
            self.expected.retain(|e| e.parameter != p);
        }
    }

    /// Number of shapes that a fit refines: of two explanations that are as good, the one with fewer is meant.
    pub fn shapes(&self) -> f64 {
        (usize::from(self.rest.is_some()) + self.refined.len()) as f64
    }

    /// Whether it is about the same kind at the same place.
    pub fn is_same_effect(&self, effect: &Effect<f64>) -> bool {
        self.effect.kind == effect.kind && self.effect.index == effect.index
    }

    /// Whether it asks the same, in whatever shape.
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

    /// The effect whose response each column is: one unit of it.
    fn unit(&self, column: usize, size: f64) -> Effect<f64> {
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

    /// The question that an effect was asked by, with its shape: its free parameters are set to zero.
    ///
    /// `None` where no question of the kind has these parameters free, or these movements do not excite it.
    ///
    pub fn again<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        mut effect: Effect<f64>,
        free: &[usize],
    ) -> Option<Self> {
        let questions = effect.kind.probe().questions;
        let number = questions.iter().position(|q| q.free == free)?;
        let question = &questions[number];
        for &p in free {
            effect.parameters[p] = 0.0;
        }
        let mut candidate = Self {
            effect,
            question: number,
            free: free.to_vec(),
            rest: question.rest,
            refined: refined(prepared.session, &effect, question),
            tried: 1,
            step: question.step,
            price: 0.0,
            spread: 1.0,
            expected: expected(prepared.session, &effect, question),
        };
        if candidate.step == 0.0 {
            candidate.step = torque_step(&motions(prepared, point), &candidate)?;
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
        let share = match effect.kind.probe().nature {
            // A frequency that is a little off is out of step at the end of a trial.
            Nature::Periodic => 0.0,
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

/// All candidates of a session with their responses; those that the movements do not excite are left out.
pub struct Library {
    /// The questions.
    pub candidates: Vec<Candidate>,
    /// Responses to the columns of each.
    pub responses: Vec<Vec<Response>>,
}

impl Library {
    /// Asks the whole catalogue, linearised at an anchor.
    ///
    /// * `periodic` - frequency \[Hz\] and phase \[rad\] of a periodic residual of the handle, where there is one
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn build<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        periodic: Option<[f64; 2]>,
    ) -> Result<Self, GapError> {
        Self::of(prepared, point, |_, _| true, periodic.as_slice())
    }

    /// Asks what may act in one joint alone.
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn of_joint<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        joint: usize,
    ) -> Result<Self, GapError> {
        let here = |kind: Kind, index| kind.info().place == Place::Joint && index == joint;
        Self::of(prepared, point, here, &[])
    }

    /// Asks what is periodic alone, in waves of the given frequencies \[Hz\] and phases \[rad\].
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn of_waves<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        waves: &[[f64; 2]],
    ) -> Result<Self, GapError> {
        let periodic = |kind: Kind, _| kind.probe().nature == Nature::Periodic;
        Self::of(prepared, point, periodic, waves)
    }

    fn of<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        is_asked: impl Fn(Kind, usize) -> bool,
        waves: &[[f64; 2]],
    ) -> Result<Self, GapError> {
        let hypothesis = &point.hypothesis;
        let motions = motions(prepared, point);
        let mut candidates = Vec::new();
        for kind in prepared.session.kinds() {
            // What the passive base has is no question any more.
            let new = |&i: &usize| is_asked(kind, i) && !prepared.has_in_base(kind, i);
            for index in places(prepared.session, kind).filter(new) {
                for asked in kind.probe().questions.iter().enumerate() {
                    let mut plain = Effect::new(kind, index);
                    hypothesis.share_rest(&mut plain);
                    let mut own = ask(prepared.session, &motions, plain, asked, waves);
                    // Without repeats nothing tells a shape from what a model gets wrong otherwise: it stays as it was asked.
                    if !prepared.repeated && kind.probe().nature != Nature::Periodic {
                        own.iter_mut().for_each(|c| c.keep_shapes(asked.1));
                    }
                    candidates.extend(own);
                }
            }
        }
        let changes = |c: &Candidate| c.changes(prepared.session, hypothesis);
        let changes: Vec<_> = candidates.iter().flat_map(changes).collect();
        let mut all = prepared.each_response(point, &changes).into_iter();
        let mut kept = Vec::new();
        let mut responses = Vec::new();
        for candidate in candidates {
            let own: Vec<_> = all.by_ref().take(candidate.width()).collect();
            let own: Vec<Response> = match own.into_iter().collect() {
                // What cannot be changed a little there cannot be asked there.
                Err(GapError::Simulation { .. }) => continue,
                other => other?,
            };
            let moves = |r: &Response| r.0.iter().flatten().flatten().any(|v| *v != 0.0);
            if own.iter().all(moves) {
                kept.push(candidate);
                responses.push(own);
            }
        }
        Ok(Self {
            candidates: kept,
            responses,
        })
    }

    /// Adds named effects in the shapes that they have; where each stands, and the coefficients of its columns.
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn add_named<const N: usize>(
        &mut self,
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        named: &[(Candidate, Effect<f64>)],
    ) -> Result<Vec<Option<Twin>>, GapError> {
        let mut places = Vec::new();
        for (own, mut effect) in named.iter().cloned() {
            let mut sizes: Vec<f64> = own.free.iter().map(|&p| effect.parameters[p]).collect();
            if let Some(rest) = own.rest {
                // With a rest angle the columns are the effect there and one unit further on, which must be possible.
                let most = effect.kind.info().parameters[rest].max;
                if effect.parameters[rest] + 1.0 > most {
                    effect.parameters[rest] -= 1.0;
                    sizes.insert(0, 0.0);
                } else {
                    sizes.push(0.0);
                }
            }
            let Some(exact) = Candidate::again(prepared, point, effect, &own.free) else {
                places.push(None);
                continue;
            };
            let changes = exact.changes(prepared.session, &point.hypothesis);
            match prepared.responses(point, &changes) {
                Ok(own) => self.responses.push(own),
                Err(GapError::Simulation { .. }) => {
                    places.push(None);
                    continue;
                }
                Err(other) => return Err(other),
            }
            let place = self.candidates.len();
            places.push(Some(Twin { place, sizes }));
            self.candidates.push(exact);
        }
        Ok(places)
    }
}

/// A named effect among the questions.
pub struct Twin {
    /// Its place.
    pub place: usize,
    /// The coefficients of its columns.
    pub sizes: Vec<f64>,
}

/// What an effect must gain to be named: the threshold, Schwarz' price of its numbers, and that of the shapes that were tried.
///
/// * `rows` - rows of data that decide it
pub fn price(width: usize, tried: usize, rows: usize) -> f64 {
    THRESHOLD + width as f64 * libm::log(rows as f64) + 2.0 * libm::log(tried as f64)
}

/// What is known of the numbers of an effect beforehand: of the first one in a joint by the weight that the joint bears, and of shapes
/// what the question says.
fn expected<const N: usize>(
    session: &Session<N>,
    effect: &Effect<f64>,
    question: &Question,
) -> Vec<Free> {
    let typical = effect.kind.probe().typical;
    let in_joint = typical != 0.0 && effect.kind.info().place == Place::Joint;
    let size = in_joint.then(|| typical * session.weight_moment(effect.index.min(N - 1)));
    let size = size.map(|sd| (0, [0.0, sd]));
    let shapes = question.expected.iter().copied();
    size.into_iter().chain(shapes).map(Free::expected).collect()
}

/// Where a kind may act in a session.
fn places<const N: usize>(session: &Session<N>, kind: Kind) -> std::ops::Range<usize> {
    let led = session.comparison == ComparisonMode::Led;
    // Where no torque acts, all masses are known up to one common factor: nothing can be said of one of them, nor of what a
    // weight or an inertia could as well be.
    let swings_freely = session.swings_freely();
    match kind.info().place {
        Place::Segment | Place::Hand | Place::Frame if swings_freely => 0..0,
        Place::Joint if swings_freely && holds_at_rest(kind) => 0..0,
        Place::Joint => usize::from(kind.crosses())..N,
        Place::Segment | Place::AngleSensor => 0..N,
        Place::Frame | Place::Hand => 0..1,
        Place::ForceSensor if led => 0..2,
        Place::Contact | Place::Sensors if led => 0..1,
        Place::ForceSensor | Place::Contact | Place::Sensors => 0..0,
    }
}

/// Whether a kind resists a joint that does not move yet: springs do, also those that fade, and rotors.
fn holds_at_rest(kind: Kind) -> bool {
    let mut effect = Effect::<f64>::new(kind, 1);
    for question in kind.probe().questions {
        for &p in question.free {
            effect.parameters[p] = 1.0;
        }
    }
    let starting = Local {
        time: 0.0,
        q: 0.7,
        qd: 0.0,
        qdd: 1.0,
        proximal_q: 0.5,
        joint_force: 1.0,
        memory: [1.0; MAX_STATES],
    };
    let gradient = effect.gradient(&starting);
    let free = kind.probe().questions.iter().flat_map(|q| q.free);
    effect.torque(&starting) != 0.0 || free.into_iter().any(|&p| gradient[p] != 0.0)
}

/// The joint motion of a group's reference, sample by sample.
struct Movement<const N: usize> {
    motion: Vec<Motion<f64, N>>,
    interval: f64,
    /// Size of the torque in each joint.
    torque: [f64; N],
}

fn motions<const N: usize>(
    prepared: &PreparedSession<N>,
    point: &LinearizationPoint<N>,
) -> Vec<Movement<N>> {
    let one = |group: usize| {
        let course = &prepared.courses[prepared.references[group]];
        let state = |i: usize| match (course.motion(), point.lines.get(group)) {
            (Some(motion), _) => (motion.q[i], motion.qd[i], motion.qdd[i]),
            (None, Some(line)) => line.state(i),
            (None, None) => (Joints::zeros(), Joints::zeros(), Joints::zeros()),
        };
        let chain = &prepared.session.chain;
        let mut square = [0.0; N];
        let count = course.seen[0].len();
        let motion = (0..count)
            .map(|i| {
                let (q, qd, qdd) = state(i);
                let pose = Pose::new(&q);
                let torque = inverse_dynamics(chain, &pose, &qd, &qdd);
                for (sum, value) in square.iter_mut().zip(torque.iter()) {
                    *sum += value * value / count as f64;
                }
                let through = joint_force(chain, &pose, (&qd, &qdd), [0.0; 2]);
                let mut at = Motion::new(i as f64 / course.rate, q, qd).with_joint_force(&through);
                at.qdd = qdd;
                at
            })
            .collect();
        Movement {
            motion,
            interval: 1.0 / course.rate,
            torque: square.map(|s| libm::sqrt(s).max(UNLOADED)),
        }
    };
    prepared.parallel(prepared.references.len(), one)
}

/// The candidates of one question about a kind at a place.
///
/// * `plain` - the effect, with what it shares with others in its place
fn ask<const N: usize>(
    session: &Session<N>,
    movements: &[Movement<N>],
    mut plain: Effect<f64>,
    (number, question): (usize, &'static Question),
    waves: &[[f64; 2]],
) -> Vec<Candidate> {
    let nature = plain.kind.probe().nature;
    if matches!(nature, Nature::Rhythm | Nature::Burst | Nature::Slip) {
        return Vec::new();
    }
    for &p in question.free {
        plain.parameters[p] = 0.0;
    }
    let mut shapes = vec![plain];
    if nature == Nature::Periodic {
        // A kind that is periodic refines its frequency and its phase.
        let shape = |wave: &[f64; 2]| {
            let mut shape = plain;
            for (&p, value) in question.refined.iter().zip(wave) {
                shape.parameters[p] = *value;
            }
            shape
        };
        shapes = waves.iter().map(shape).collect();
    }
    let joint = plain.index.min(N - 1);
    let angles = || extent(movements.iter().flat_map(|m| &m.motion).map(|m| m.q[joint]));
    for (p, values) in question.shapes {
        let (low, high) = angles();
        let values = match values {
            Values::Each(list) => list.to_vec(),
            Values::Highest => vec![high],
            Values::Lowest => vec![low],
            Values::Middle => vec![0.5 * (low + high)],
        };
        let shaped = |mut shape: Effect<f64>, value: f64| {
            shape.parameters[*p] = value;
            shape
        };
        let each = |&shape| values.iter().map(move |&value| shaped(shape, value));
        shapes = shapes.iter().flat_map(each).collect();
    }
    let tried = shapes.len();
    let candidate = |effect: Effect<f64>| {
        let mut candidate = Candidate {
            effect,
            question: number,
            free: question.free.to_vec(),
            rest: question.rest,
            refined: refined(session, &effect, question),
            tried,
            step: question.step,
            price: 0.0,
            spread: 1.0,
            expected: expected(session, &effect, question),
        };
        if candidate.step == 0.0 {
            candidate.step = torque_step(movements, &candidate)?;
        }
        Some(candidate)
    };
    shapes.into_iter().filter_map(candidate).collect()
}

/// The amplitude with which the effect's torque is a small share of what its joint carries, or the largest that the kind
/// allows; `None` where it has none.
fn torque_step<const N: usize>(movements: &[Movement<N>], candidate: &Candidate) -> Option<f64> {
    /// Share of the joint's torque that one unit of the effect must make: what less of it changes drowns in rounding.
    const LEAST: f64 = 1e-6;
    let joint = candidate.effect.index;
    let mut largest = 0.0;
    for movement in movements {
        let mut square = 0.0;
        let effect = candidate.unit(0, 1.0);
        let mut memory = [[0.0; MAX_STATES]];
        let mut before: Option<&Motion<f64, N>> = None;
        for at in &movement.motion {
            if let Some(from) = before.replace(at) {
                advance_states(&[effect], (from, at), &mut memory, movement.interval);
            }
            let torque = resisting_torque(&[effect], at, &memory)[joint];
            square += torque * torque;
        }
        let size = libm::sqrt(square / movement.motion.len().max(1) as f64);
        largest = f64::max(largest, size / movement.torque[joint]);
    }
    // A slow movement hardly feels what grows with speed: no step beyond what the parameter may be.
    let info = &candidate.effect.kind.info().parameters[candidate.free[0]];
    (largest > LEAST).then(|| f64::min(SHARE / largest, 0.5 * info.max))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One unit of viscosity makes as many newton metres as the joint has radians a second.
    #[test]
    fn a_response_is_taken_with_a_fiftieth_of_the_torque_of_the_joint() {
        let candidate = Candidate {
            effect: Effect::new(Kind::Viscous, 0).with(&[0.0]),
            question: 0,
            free: vec![0],
            rest: None,
            refined: Vec::new(),
            tried: 1,
            step: 0.0,
            price: 0.0,
            spread: 1.0,
            expected: Vec::new(),
        };
        let step = |speed: f64| {
            let motion = Motion::new(0.0, Joints::from([0.0]), Joints::from([speed]));
            let movement = Movement {
                motion: vec![motion; 3],
                interval: 0.01,
                torque: [10.0],
            };
            torque_step(&[movement], &candidate)
        };
        assert!((step(0.5).expect("a step") - 0.4).abs() < 1e-12);
        assert!(step(0.8e-5).is_none());
        // No more than half of what the parameter may be.
        let most = Kind::Viscous.info().parameters[0].max;
        assert_eq!(step(1.2e-5), Some(f64::min(0.5 * most, 0.02 / 1.2e-6)));
    }
}
