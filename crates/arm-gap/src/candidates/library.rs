//! All candidates of a session: each kind of the catalogue at each of its places, in each of its shapes.

use std::sync::OnceLock;

use arm_core::effect::{Effect, Kind, Local, MAX_STATES, Nature, Part, Place, Values};
use arm_core::{Contact, Setup, sample_arms};
use arm_numerics::statistics::extent::extent;

use crate::GapError;
use crate::candidates::candidate::{Candidate, expected};
use crate::candidates::refined_shapes::refined;
use crate::candidates::torque_step::{Movement, motions, torque_step};
use crate::data::session::{ComparisonMode, Session};
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::rows::{Columns, WhitenedRows};

/// All candidates of a session with their responses; those that the movements do not excite are left out.
pub struct Library {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// Responses to the columns of each.
    pub responses: Vec<Vec<Response>>,
    /// The same, whitened at the first use.
    pub(crate) columns: OnceLock<Columns>,
}

impl Library {
    /// The candidates of the whole catalogue, linearised at a linearization point.
    ///
    /// * `periodic` - frequency \[Hz\] and phase \[rad\] of an oscillation with one phase in all trials, if there is one
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

    /// The candidates in one joint.
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

    /// The oscillating candidates, in waves of the given frequencies \[Hz\] and phases \[rad\].
    ///
    /// # Errors
    /// As [`PreparedSession::responses`].
    pub fn of_waves<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        waves: &[[f64; 2]],
    ) -> Result<Self, GapError> {
        let swings = |kind: Kind, _| kind.prior().nature.swings();
        Self::of(prepared, point, swings, waves)
    }

    fn of<const N: usize>(
        prepared: &PreparedSession<N>,
        point: &LinearizationPoint<N>,
        is_tested: impl Fn(Kind, usize) -> bool,
        waves: &[[f64; 2]],
    ) -> Result<Self, GapError> {
        let hypothesis = &point.hypothesis;
        let motions = motions(prepared, point);
        let mut candidates = Vec::new();
        for kind in prepared.session.kinds() {
            // What the passive base has is no question any more.
            let new = |&i: &usize| is_tested(kind, i) && !prepared.has_in_base(kind, i);
            for index in places(prepared.session, kind).filter(new) {
                for part in kind.prior().parts.iter().enumerate() {
                    let mut plain = Effect::new(kind, index);
                    hypothesis.share_rest(&mut plain);
                    let mut own =
                        candidates_of_part(prepared.session, &motions, plain, part, waves);
                    // Without repeats a shape cannot be distinguished from other errors of the model: it stays at its initial value.
                    if !prepared.repeated && !kind.prior().nature.swings() {
                        own.iter_mut().for_each(|c| c.keep_shapes(part.1));
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
                // A candidate without a small change at this point is left out.
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
            columns: OnceLock::new(),
        })
    }

    /// The responses in the rows of the linearization point, whitened once for all uses there.
    pub(crate) fn columns<const N: usize>(
        &self,
        prepared: &PreparedSession<N>,
        rows: &WhitenedRows,
    ) -> &Columns {
        let all = || self.responses.iter().flatten().collect::<Vec<_>>();
        self.columns.get_or_init(|| rows.columns(prepared, &all()))
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
    ) -> Result<Vec<Option<LibraryEntry>>, GapError> {
        let mut places = Vec::new();
        self.columns = OnceLock::new();
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
            places.push(Some(LibraryEntry { place, sizes }));
            self.candidates.push(exact);
        }
        Ok(places)
    }
}

/// A named effect among the questions.
pub struct LibraryEntry {
    /// Its place.
    pub place: usize,
    /// The coefficients of its columns.
    pub sizes: Vec<f64>,
}

/// Where a kind may act in a session.
fn places<const N: usize>(session: &Session<N>, kind: Kind) -> std::ops::Range<usize> {
    let led = session.comparison == ComparisonMode::Led;
    // Where no torque acts, all masses are known up to one common factor: neither a single mass nor an effect that is equivalent
    // to a weight or an inertia can be determined.
    let swings_freely = session.swings_freely();
    // Torques of a contact depend on the lengths: without the path of a robot, a wrong length is equivalent to a wrong weight.
    let lengths_tell = !session.compares_contact_torques();
    match kind.info().place {
        Place::Segment if !lengths_tell && lengthens(kind) => 0..0,
        Place::Segment | Place::Hand | Place::Frame | Place::Base if swings_freely => 0..0,
        Place::Joint if swings_freely && holds_at_rest(kind) => 0..0,
        Place::Joint => usize::from(kind.crosses())..N,
        Place::Segment | Place::AngleSensor => 0..N,
        Place::Frame | Place::Base | Place::Hand => 0..1,
        Place::ForceSensor if session.reads_contact() => 0..2,
        Place::Sensors if session.reads_contact() => 0..1,
        Place::Contact if led => 0..1,
        Place::ForceSensor | Place::Contact | Place::Sensors => 0..0,
    }
}

/// Whether a kind changes the length of a segment.
fn lengthens(kind: Kind) -> bool {
    let mut setup = Setup::new(
        &sample_arms::mechanical_arm(),
        Contact::new([1.0; 2], [0.0; 2]),
    );
    let before = setup.segments[0].length;
    let mut effect = Effect::<f64>::new(kind, 0);
    effect.parameters[0] = 0.5;
    effect.alter(&mut setup);
    setup.segments[0].length != before
}

/// Whether a kind resists a joint that does not move yet: springs do, also those that fade, and rotors.
fn holds_at_rest(kind: Kind) -> bool {
    let mut effect = Effect::<f64>::new(kind, 1);
    for part in kind.prior().parts {
        for &p in part.sizes {
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
        activity: 1.0,
        memory: [1.0; MAX_STATES],
    };
    let gradient = effect.gradient(&starting);
    let sizes = kind.prior().parts.iter().flat_map(|part| part.sizes);
    effect.torque(&starting) != 0.0 || sizes.into_iter().any(|&p| gradient[p] != 0.0)
}

/// The candidates of one question: a part of a kind at a place.
///
/// * `plain` - the effect, with what it shares with others in its place
fn candidates_of_part<const N: usize>(
    session: &Session<N>,
    movements: &[Movement<N>],
    mut plain: Effect<f64>,
    (number, part): (usize, &'static Part),
    waves: &[[f64; 2]],
) -> Vec<Candidate> {
    let nature = plain.kind.prior().nature;
    if matches!(nature, Nature::Burst | Nature::Slip) {
        return Vec::new();
    }
    for &p in part.sizes {
        plain.parameters[p] = 0.0;
    }
    let mut shapes = vec![plain];
    if nature.swings() {
        // A kind that swings refines its frequency and its phase.
        let shape = |wave: &[f64; 2]| {
            let mut shape = plain;
            for (&p, value) in part.varying.iter().zip(wave) {
                shape.parameters[p] = *value;
            }
            shape
        };
        let occurs = |wave: &&[f64; 2]| plain.kind.prior().has_frequency(wave[0]);
        shapes = waves.iter().filter(occurs).map(shape).collect();
    }
    let joint = plain.index.min(N - 1);
    let angles = || extent(movements.iter().flat_map(|m| &m.motion).map(|m| m.q[joint]));
    for (p, values) in part.shapes {
        let (low, high) = angles();
        let values = match values {
            Values::Each(list) => list.to_vec(),
            Values::Highest => vec![high],
            Values::Lowest => vec![low],
            Values::Middle => vec![0.5 * (low + high)],
            Values::Across => vec![low, 0.5 * (low + high), high],
        };
        let shaped = |mut shape: Effect<f64>, value: f64| {
            shape.parameters[*p] = value;
            shape
        };
        let each = |&shape| values.iter().map(move |&value| shaped(shape, value));
        shapes = shapes.iter().flat_map(each).collect();
    }
    let tried = shapes.len();
    // The same for every shape: none of them changes whether friction sticks.
    let refined = refined(session, &plain, part);
    let candidate = |effect: Effect<f64>| {
        let mut candidate = Candidate {
            effect,
            question: number,
            free: part.sizes.to_vec(),
            rest: part.rest,
            refined: refined.clone(),
            tried,
            step: part.small,
            price: 0.0,
            spread: 1.0,
            gained: f64::INFINITY,
            expected: expected(session, &effect, part),
        };
        if candidate.step == 0.0 {
            candidate.step = torque_step(movements, candidate.unit(0, 1.0), candidate.free[0])?;
        }
        Some(candidate)
    };
    shapes.into_iter().filter_map(candidate).collect()
}
