//! A session made ready: every trial's course, which trials repeat each other, and the noise.

use std::sync::Arc;

use arm_core::effect::{Local, Place};
use arm_core::{Pose, jacobian};
use nalgebra::{DMatrix, DVector};

use crate::GapError;
use crate::data::noise::{Noise, dot};
use crate::data::repeats::groups;
use crate::data::session::{ComparisonMode, Session};
use crate::data::valid_segments::{ObservableForce, ValidSegments, widened};
use crate::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use crate::measurement_model::prediction::{Channels, Course};
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::factor;
use crate::threads;

/// Share of the samples that must be left when those at which joints with dry friction rest are left out.
const LEAST_LEFT: f64 = 0.15;

/// What rest takes from the comparison of a movement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rest {
    /// Samples that are left out.
    left_out: Vec<bool>,
    /// What the force tells where it does not tell both components.
    told: Arc<Vec<ObservableForce>>,
}

/// A session made ready.
pub struct PreparedSession<'a, const N: usize> {
    /// What is challenged and by what.
    pub session: &'a Session<N>,
    /// Every trial, in their order.
    pub courses: Vec<Arc<Course<N>>>,
    /// The samples of each that are compared.
    pub valid_segments: Vec<ValidSegments>,
    /// The group of repeats that each trial belongs to.
    pub group_of: Vec<usize>,
    /// One trial of each group, in whose motion responses are computed.
    pub references: Vec<usize>,
    /// What makes rows white.
    pub noise: Noise,
    /// Whether the noise was read off repeats.
    pub repeated: bool,
    /// Trials that are fitted.
    pub fitted: Vec<usize>,
    /// Joints with dry friction: where they rest, less is compared.
    pub dry: [bool; N],
    /// At every sample of each group.
    pub(crate) resting: Vec<Rest>,
    /// What disturbances have touched: trial, start and end \[s\].
    touched: Vec<(usize, f64, f64)>,
    /// Which laws of the passive base are dropped.
    pub(crate) dropped: Vec<bool>,
    /// Where calibration starts, once the base was calibrated.
    pub(crate) start: Option<Hypothesis<N>>,
    /// Threads.
    pub threads: usize,
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Makes a session ready; the noise is read off the repeats of the fit trials against the model as given.
    ///
    /// # Errors
    /// [`GapError`] for data that cannot be judged, or a model that cannot be simulated.
    pub fn new(session: &'a Session<N>, threads: usize) -> Result<Self, GapError> {
        let noise = Noise::unknown(session.channels())?;
        let mut prepared = Self::with_noise(session, noise, threads)?;
        let mut given = prepared.linearize(&session.starting())?;
        let all = prepared.fitted.clone();
        prepared.leave_out_rest(&given);
        if prepared.fitted != all {
            // A trial in which nothing is left to compare has no place among the residuals either.
            given = prepared.linearize(&session.starting())?;
        }
        prepared.measure_noise(&given)?;
        Ok(prepared)
    }

    /// Makes a session ready whose noise is known from another one.
    ///
    /// # Errors
    /// [`GapError`] for data that cannot be judged.
    pub fn with_noise(
        session: &'a Session<N>,
        noise: Noise,
        threads: usize,
    ) -> Result<Self, GapError> {
        session.check()?;
        let courses = (0..session.trials.len())
            .map(|i| Ok(Arc::new(session.course(i)?)))
            .collect::<Result<Vec<_>, GapError>>()?;
        let valid_segments: Vec<_> = std::iter::zip(&session.trials, &courses)
            .map(|(trial, course)| ValidSegments::of(trial, course, &[], Arc::default()))
            .collect();
        let fitted: Vec<usize> = session
            .fit_trials()
            .into_iter()
            .filter(|&i| !valid_segments[i].is_empty())
            .collect();
        if fitted.is_empty() {
            return Err(GapError::Data {
                what: "samples of the fit trials",
                found: "no stretch long enough".into(),
                allowed: "a second without a gap",
            });
        }
        let (group_of, references) = groups(&session.trials, &courses);
        Ok(Self {
            session,
            courses,
            valid_segments,
            group_of,
            references,
            noise,
            repeated: false,
            fitted,
            dry: [false; N],
            resting: Vec::new(),
            touched: Vec::new(),
            dropped: session.base.iter().map(|law| !law.likely).collect(),
            start: None,
            threads,
        })
    }

    /// Reads the noise anew: what repeats differ in, or without repeats what a hypothesis leaves.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for series that no noise can be read off.
    pub fn measure_noise(&mut self, point: &LinearizationPoint<N>) -> Result<(), GapError> {
        let channels = self.session.channels();
        let observed_share = self.observed_share();
        let mut deviations = Vec::new();
        // For each deviation what a trial may differ by without noise.
        let mut shifts: Vec<Arc<Vec<Vec<Vec<f64>>>>> = Vec::new();
        for repeats in self.repeats(point) {
            let own = point.own.iter();
            let columns = own.map(|r| flat(&r.0[repeats.group], &repeats.samples));
            let columns = Arc::new(columns.collect::<Vec<_>>());
            for deviation in repeats.deviations() {
                deviations.push(deviation);
                shifts.push(Arc::clone(&columns));
            }
        }
        self.repeated = !deviations.is_empty();
        let range: Vec<f64> = (0..channels)
            .map(|c| {
                // An arm that swings freely has no torque to show, but its inertia has.
                let seen = self.fitted.iter().flat_map(|&t| &self.courses[t].seen[c]);
                let all = seen.chain(point.residuals.iter().flat_map(|r| &r[c]));
                let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(*v), b.max(*v))
                });
                (high - low).max(0.0)
            })
            .collect();
        self.noise = if self.repeated {
            self.noise_of(&deviations, &shifts, (&range, &observed_share))?
        } else {
            self.noise_of_residuals(point, (&range, &observed_share))?
        };
        Ok(())
    }

    /// The most of some fitted trials, by their places among them, that have the same samples, and these samples.
    pub(crate) fn agreeing(&self, members: &[usize]) -> Option<(Vec<usize>, ValidSegments)> {
        let all: Vec<_> = members
            .iter()
            .map(|&m| &self.valid_segments[self.fitted[m]])
            .collect();
        let (agreeing, samples) = ValidSegments::agreeing(&all)?;
        Some((agreeing.into_iter().map(|i| members[i]).collect(), samples))
    }

    /// The share of the samples of each channel that tell anything.
    fn observed_share(&self) -> Vec<f64> {
        let channels = self.session.channels();
        let all: usize = self
            .fitted
            .iter()
            .map(|&t| self.valid_segments[t].len())
            .sum();
        let told = self
            .fitted
            .iter()
            .map(|&t| self.valid_segments[t].rows_per_channel(channels));
        let sum = told.fold(vec![0; channels], |sum, own| {
            std::iter::zip(sum, own).map(|(a, b)| a + b).collect()
        });
        sum.into_iter()
            .map(|n: usize| n as f64 / all.max(1) as f64)
            .collect()
    }

    /// The noise of deviations, and how far each is shifted, found in turns: as much is taken for a shift as the noise and
    /// what is known of shifts allow.
    fn noise_of(
        &self,
        deviations: &[Vec<Vec<f64>>],
        shifts: &[Arc<Vec<Vec<Vec<f64>>>>],
        (range, told): (&[f64], &[f64]),
    ) -> Result<Noise, GapError> {
        const TURNS: usize = 3;
        let known: Vec<f64> = self
            .session
            .by_trial()
            .iter()
            .map(|c| c.prior.map_or(f64::INFINITY, |(_, sd)| sd))
            .collect();
        let mut noise = Noise::of(deviations, &[], range, told)?;
        for _ in 0..TURNS {
            if known.is_empty() {
                break;
            }
            let mut clean = deviations.to_vec();
            let mut taken = Vec::new();
            for (deviation, columns) in clean.iter_mut().zip(shifts) {
                let row = noise.whiten_thinned(deviation);
                let each = columns.iter().map(|c| noise.whiten_thinned(c));
                let whitened: Vec<Vec<f64>> = each.collect();
                let k = known.len();
                let gram = DMatrix::from_fn(k, k, |a, b| {
                    let own = if a == b {
                        1.0 / (known[a] * known[a])
                    } else {
                        0.0
                    };
                    dot(&whitened[a], &whitened[b]) + own
                });
                let score = DVector::from_fn(k, |a, _| dot(&whitened[a], &row));
                let Some(solver) = factor(gram) else { continue };
                add(deviation, columns, (-solver.solve(&score)).as_slice());
                taken.extend(solver.spread().iter().map(|shares| {
                    let mut series: Vec<Vec<f64>> =
                        deviation.iter().map(|c| vec![0.0; c.len()]).collect();
                    add(&mut series, columns, shares.as_slice());
                    series
                }));
            }
            noise = Noise::of(&clean, &taken, range, told)?;
        }
        Ok(noise)
    }

    /// Leaves out what dry friction makes unknowable where its joint rests or reverses: there friction is whatever holds it.
    ///
    /// Whether anything changed since the last time; then anchors are to be made anew. The samples of repeats stay the same:
    /// they rest together.
    pub fn leave_out_rest(&mut self, point: &LinearizationPoint<N>) -> bool {
        let dry = dry_joints(&point.hypothesis);
        if dry == self.dry {
            return false;
        }
        self.dry = dry;
        let one = |group: usize| self.rest(point, group);
        self.resting = (0..self.references.len()).map(one).collect();
        let compared = |prepared: &Self| -> usize {
            prepared.valid_segments.iter().map(ValidSegments::len).sum()
        };
        let before = compared(self);
        self.cut();
        if (compared(self) as f64) < LEAST_LEFT * before as f64 {
            // Then some joint rests at any time, and imperfect samples are better than none.
            self.resting.clear();
            self.cut();
        }
        true
    }

    /// Leaves out what a disturbance has touched in one trial.
    pub fn leave_out(&mut self, trial: usize, (start, end): (f64, f64)) {
        self.touched.push((trial, start, end));
        self.cut();
    }

    /// Whether a disturbance has touched a trial.
    pub fn is_touched(&self, trial: usize) -> bool {
        self.touched.iter().any(|(touched, _, _)| *touched == trial)
    }

    /// Takes everything that disturbances have touched back in.
    pub fn take_back(&mut self) {
        self.touched.clear();
        self.cut();
    }

    /// Chooses the samples that are compared, and the trials that have any.
    pub(crate) fn cut(&mut self) {
        /// How long a disturbance is felt before and after, the low-pass included \[s\].
        const AROUND: (f64, f64) = (0.2, 0.5);
        for i in 0..self.courses.len() {
            let trial = &self.session.trials[i];
            let rest = self.resting.get(self.group_of[i]).cloned();
            let Rest { mut left_out, told } = rest.unwrap_or_default();
            left_out.resize(trial.len(), false);
            for (_, start, end) in self.touched.iter().filter(|(t, _, _)| *t == i) {
                for (k, flag) in left_out.iter_mut().enumerate() {
                    let time = k as f64 / trial.rate;
                    *flag |= time >= start - AROUND.0 && time <= end + AROUND.1;
                }
            }
            self.valid_segments[i] = ValidSegments::of(trial, &self.courses[i], &left_out, told);
        }
        let kept: Vec<usize> = self
            .session
            .fit_trials()
            .into_iter()
            .filter(|&i| !self.valid_segments[i].is_empty())
            .collect();
        if !kept.is_empty() {
            self.fitted = kept;
        }
    }

    /// What the rest of joints with dry friction takes from the comparison of a movement.
    ///
    /// The contact alone places an arm of one or two joints: what holds a resting joint shows in one component of the force
    /// and nowhere else. A longer arm gives way to it, and nothing is known then.
    fn rest(&self, point: &LinearizationPoint<N>, group: usize) -> Rest {
        let course = &self.courses[self.references[group]];
        let joints: Vec<Vec<bool>> = (0..N)
            .map(|j| match self.dry[j] {
                true => widened(&self.resting_joint(point, (group, j)), course),
                false => vec![false; course.seen[0].len()],
            })
            .collect();
        let held = |i: usize| -> Vec<usize> { (0..N).filter(|&j| joints[j][i]).collect() };
        let count = course.seen[0].len();
        match point.lines.get(group) {
            Some(line) if N <= 2 && self.session.comparison == ComparisonMode::Led => {
                let told = |i: usize| match held(i)[..] {
                    [] => ObservableForce::Both,
                    // The torque of the other joint, as a component of the force.
                    [j] if N == 2 => {
                        let moves = jacobian(&self.session.chain, &Pose::new(&line.state(i).0));
                        let column = moves.column(1 - j);
                        match column.norm() {
                            size if size > 0.0 => {
                                ObservableForce::Along([column[0] / size, column[1] / size])
                            }
                            _ => ObservableForce::Neither,
                        }
                    }
                    _ => ObservableForce::Neither,
                };
                Rest {
                    left_out: Vec::new(),
                    told: Arc::new((0..count).map(told).collect()),
                }
            }
            _ => Rest {
                left_out: (0..count).map(|i| !held(i).is_empty()).collect(),
                told: Arc::default(),
            },
        }
    }

    /// The samples of a movement at which a joint rests.
    fn resting_joint(
        &self,
        point: &LinearizationPoint<N>,
        (group, j): (usize, usize),
    ) -> Vec<bool> {
        /// Share of its fastest speed below which a joint rests, the speed below which it always does, and the one above
        /// which it never does \[rad/s\].
        const SLOW: (f64, f64, f64) = (0.25, 0.005, 0.03);
        let course = &self.courses[self.references[group]];
        let speed = |i: usize| match (course.motion(), point.lines.get(group)) {
            (Some(motion), _) => motion.qd[i][j].abs(),
            (None, Some(line)) => line.state(i).1[j].abs(),
            (None, None) => f64::INFINITY,
        };
        let speeds: Vec<f64> = (0..course.seen[0].len()).map(speed).collect();
        let fastest = speeds.iter().copied().fold(0.0, f64::max);
        let limit = (SLOW.0 * fastest).clamp(SLOW.1, SLOW.2);
        let mut rest: Vec<bool> = speeds.into_iter().map(|v| v <= limit).collect();
        if self.session.comparison == ComparisonMode::Torque {
            // A joint that reverses on the way does not rest: the law of its friction holds through zero.
            let shortest = (course.rate / course.band) as usize;
            for run in rest.chunk_by_mut(|a, b| a == b) {
                if run.len() < shortest {
                    run.fill(false);
                }
            }
        }
        rest
    }

    /// What is refitted with every question; see [`Session::nuisances`]. Dropped laws of the base are not.
    pub fn nuisances(&self) -> Vec<Coordinate> {
        let first = self.session.effects.len();
        let mut all = self.session.nuisances();
        all.retain(|c| match c.target {
            Target::Known(e, _) if e >= first => !self.dropped[e - first],
            _ => true,
        });
        all
    }

    /// Results of jobs in their order, whatever the number of threads.
    pub fn parallel<R: Send>(&self, jobs: usize, one: impl Fn(usize) -> R + Sync) -> Vec<R> {
        threads::parallel(self.threads, jobs, one)
    }
}

/// Joints in which something resists as much at a crawl as in motion.
fn dry_joints<const N: usize>(hypothesis: &Hypothesis<N>) -> [bool; N] {
    const CRAWL: f64 = 0.03;
    const MOTION: f64 = 0.3;
    let mut dry = [false; N];
    for effect in hypothesis.known.iter().chain(&hypothesis.named) {
        if effect.kind.info().place != Place::Joint || effect.index >= N {
            continue;
        }
        let at = |speed: f64| {
            let local = Local {
                time: 0.0,
                q: 0.0,
                qd: speed,
                qdd: 0.0,
                proximal_q: 0.0,
                joint_force: 1.0,
                memory: 0.0,
            };
            0.5 * (effect.torque(&local)
                - effect.torque(&Local {
                    qd: -speed,
                    ..local
                }))
        };
        dry[effect.index] |= at(CRAWL) > 0.5 * at(MOTION).abs() && at(CRAWL) > 0.0;
    }
    dry
}

/// Thinned channels with their stretches joined.
pub fn flat(channels: &Channels, valid_segments: &ValidSegments) -> Vec<Vec<f64>> {
    let picked = valid_segments.pick(channels).into_iter();
    picked.map(|pieces| pieces.concat()).collect()
}

/// Adds shares of columns, each with its channels, to a series.
fn add(series: &mut [Vec<f64>], columns: &[Vec<Vec<f64>>], shares: &[f64]) {
    for (share, column) in shares.iter().zip(columns) {
        for (value, part) in series.iter_mut().flatten().zip(column.iter().flatten()) {
            *value += share * part;
        }
    }
}
