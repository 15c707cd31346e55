//! A session made ready: every trial's course, which trials repeat each other, the noise; and the two things that are
//! asked of it again and again, residuals and responses.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use arm_core::effect::{Local, Place};
use arm_ident::trial::Trial;

use crate::GapError;
use crate::candidate::Library;
use crate::fit::priors;
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::noise::{Noise, Stretches};
use crate::normal::{Cluster, Normal, solve};
use crate::predict::{Channels, Course, Run};
use crate::response::Linear;
use crate::session::{Session, Sight};

/// Root mean square distance between the paths of two trials that are the same movement \[m, rad\].
const SAME_PATH: f64 = 0.01;

/// A session made ready.
pub struct Study<'a, const N: usize> {
    /// What is challenged and by what.
    pub session: &'a Session<N>,
    /// Every trial, in their order.
    pub courses: Vec<Course<N>>,
    /// The samples of each that are compared.
    pub stretches: Vec<Stretches>,
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
    /// Joints with dry friction: where they rest, nothing is compared.
    pub dry: [bool; N],
    /// Threads.
    pub threads: usize,
}

/// Response of the channels to one unit of a number: by group, `None` where it could not be simulated.
#[derive(Clone, Debug)]
pub struct Response(pub Vec<Option<Channels>>);

/// A change of a hypothesis whose response is asked.
#[derive(Clone, Debug)]
pub struct Change<const N: usize> {
    /// The hypothesis with the change made.
    pub changed: Hypothesis<N>,
    /// Its size.
    pub size: f64,
    /// Whether it reaches the sensors alone.
    pub sensing: bool,
    /// Whether it moves the handle's path.
    pub moves_handle: bool,
}

/// A group's reference under a hypothesis: linearised, and as simulated.
struct Base<'a, const N: usize> {
    linear: Option<Linear<'a, N>>,
    played: OnceLock<Option<(Run<N>, Channels)>>,
}

impl<'a, const N: usize> Study<'a, N> {
    /// Makes a session ready; the noise is read off the repeats of the fit trials against `hypothesis`.
    ///
    /// # Errors
    /// [`GapError`] for data that cannot be judged, or a model that cannot be simulated.
    pub fn new(session: &'a Session<N>, threads: usize) -> Result<Self, GapError> {
        session.check()?;
        let courses = (0..session.trials.len())
            .map(|i| session.course(i))
            .collect::<Result<Vec<_>, _>>()?;
        let stretches: Vec<_> = std::iter::zip(&session.trials, &courses)
            .map(|(trial, course)| Stretches::of(trial, course, &[]))
            .collect();
        let fitted: Vec<usize> = session
            .fit_trials()
            .into_iter()
            .filter(|&i| !stretches[i].is_empty())
            .collect();
        if fitted.is_empty() {
            return Err(GapError::Data {
                what: "samples of the fit trials",
                found: "no stretch long enough".into(),
                allowed: "a second without a gap",
            });
        }
        let (group_of, references) = groups(&session.trials, &courses);
        let mut study = Self {
            session,
            courses,
            stretches,
            group_of,
            references,
            noise: Noise::unknown(session.channels())?,
            repeated: false,
            fitted,
            dry: [false; N],
            threads,
        };
        study.measure_noise(&session.given())?;
        study.leave_out_rest(&session.given())?;
        Ok(study)
    }

    /// Reads the noise anew: what repeats differ in, or without repeats what a hypothesis leaves.
    ///
    /// # Errors
    /// [`GapError`] where the hypothesis cannot be simulated.
    pub fn measure_noise(&mut self, hypothesis: &Hypothesis<N>) -> Result<(), GapError> {
        let residuals = self.residuals(hypothesis, &self.fitted)?;
        let own = self.own_responses(hypothesis)?;
        let channels = self.session.channels();
        let mut deviations = Vec::new();
        for group in 0..self.references.len() {
            let members: Vec<usize> = (0..self.fitted.len())
                .filter(|&m| self.group_of[self.fitted[m]] == group)
                .collect();
            let n = members.len();
            let same = |m: &&usize| {
                self.stretches[self.fitted[**m]] == self.stretches[self.fitted[members[0]]]
            };
            if n < 2 || members.iter().filter(same).count() < n {
                continue;
            }
            let scale = libm::sqrt(n as f64 / (n as f64 - 1.0));
            let stretches = &self.stretches[self.fitted[members[0]]];
            let picked: Vec<Vec<Vec<f64>>> = members
                .iter()
                .map(|&m| flat(&residuals[m], stretches))
                .collect();
            let columns: Vec<Vec<Vec<f64>>> = own
                .iter()
                .filter_map(|r| r.0[group].as_ref())
                .map(|c| flat(c, stretches))
                .collect();
            for one in &picked {
                let mut deviation: Vec<Vec<f64>> = (0..channels)
                    .map(|c| {
                        let mean =
                            |i: usize| picked.iter().map(|p| p[c][i]).sum::<f64>() / n as f64;
                        (0..one[c].len())
                            .map(|i| scale * (one[c][i] - mean(i)))
                            .collect()
                    })
                    .collect();
                remove(&mut deviation, &columns);
                deviations.push(deviation);
            }
        }
        self.repeated = !deviations.is_empty();
        if !self.repeated {
            deviations = self.unexplained(hypothesis, &residuals)?;
        }
        let range: Vec<f64> = (0..channels)
            .map(|c| {
                // An arm that swings freely has no torque to show, but its inertia has.
                let seen = self.fitted.iter().flat_map(|&t| &self.courses[t].seen[c]);
                let all = seen.chain(residuals.iter().flat_map(|r| &r[c]));
                let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(*v), b.max(*v))
                });
                (high - low).max(0.0)
            })
            .collect();
        self.noise = if self.repeated {
            Noise::of(&deviations, &range)?
        } else {
            Noise::without_repeats(&deviations, &range)?
        };
        Ok(())
    }

    /// What is left of residuals when everything that the catalogue could explain is taken out, to first order.
    ///
    /// Without repeats this is all that tells of the noise: a residual that still holds what is missing would make the
    /// missing look like noise.
    fn unexplained(
        &self,
        hypothesis: &Hypothesis<N>,
        residuals: &[Channels],
    ) -> Result<Vec<Vec<Vec<f64>>>, GapError> {
        let coordinates = self.session.nuisances();
        let library = Library::build(self, hypothesis, None)?;
        let nuisances = self.responses_to(hypothesis, &coordinates)?;
        let columns: Vec<&Response> = nuisances
            .iter()
            .chain(library.responses.iter().flatten())
            .collect();
        let channels = self.session.channels();
        let size: Vec<f64> = (0..channels)
            .map(|c| {
                let all = residuals.iter().flat_map(|r| &r[c]);
                let (sum, count) = all.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
                libm::sqrt(sum / f64::max(count, 1.0)).max(1e-12)
            })
            .collect();
        let rows = |channels: &Channels, trial: usize| -> Vec<f64> {
            let picked = flat(channels, &self.stretches[trial]);
            std::iter::zip(picked, &size)
                .flat_map(|(values, size)| values.into_iter().map(move |v| v / size))
                .collect()
        };
        let matrices = self.parallel(self.fitted.len(), |i| {
            let trial = self.fitted[i];
            let length = self.session.trials[trial].len();
            let list: Vec<Vec<f64>> = columns
                .iter()
                .filter_map(|r| r.0[self.group_of[trial]].as_ref())
                .map(|c| rows(&fitted_to(c, length), trial))
                .collect();
            (list, rows(&residuals[i], trial))
        });
        let clusters: Vec<Cluster> = matrices
            .iter()
            .map(|(list, residual)| Cluster::new(0, list, residual, &[]))
            .collect();
        let list: Vec<&Cluster> = clusters.iter().collect();
        let mut known = priors(hypothesis, &coordinates);
        known.resize(columns.len(), None);
        let mut normal = Normal::new(&list, &known);
        // Columns repeat each other: a little of the diagonal settles how they share.
        for i in 0..columns.len() {
            normal.gram[(i, i)] *= 1.0 + 1e-4;
        }
        let usable: Vec<usize> = (0..columns.len())
            .filter(|&i| normal.gram[(i, i)] > 0.0)
            .collect();
        let free = |_: usize| (f64::NEG_INFINITY, f64::INFINITY);
        let steps = solve(&normal.gram, &normal.score, &usable, &free).map(|(steps, _)| steps);
        let mut out = Vec::with_capacity(matrices.len());
        for (list, mut residual) in matrices {
            for (&i, step) in usable.iter().zip(steps.iter().flatten()) {
                for (r, c) in residual.iter_mut().zip(&list[i]) {
                    *r -= step * c;
                }
            }
            let count = residual.len() / channels;
            out.push(
                (0..channels)
                    .map(|c| {
                        let own = &residual[c * count..(c + 1) * count];
                        own.iter().map(|v| v * size[c]).collect()
                    })
                    .collect(),
            );
        }
        Ok(out)
    }

    /// Leaves out the samples at which a joint with dry friction rests, or reverses: there friction is whatever holds it.
    ///
    /// Whether anything changed since the last time. The samples of repeats stay the same: they rest together.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis cannot be simulated.
    pub fn leave_out_rest(&mut self, hypothesis: &Hypothesis<N>) -> Result<bool, GapError> {
        let dry = dry_joints(hypothesis);
        if dry == self.dry {
            return Ok(false);
        }
        self.dry = dry;
        let resting: Vec<Vec<bool>> = {
            let one = |group: usize| {
                let trial = self.references[group];
                let run = self
                    .session
                    .run(hypothesis, &self.courses[trial])
                    .map_err(|source| GapError::Simulation { trial, source })?;
                Ok(self.resting(trial, &run))
            };
            let outcomes = self.parallel(self.references.len(), one);
            outcomes.into_iter().collect::<Result<_, GapError>>()?
        };
        for i in 0..self.courses.len() {
            let trial = &self.session.trials[i];
            let rest = &resting[self.group_of[i]];
            self.stretches[i] = Stretches::of(trial, &self.courses[i], rest);
        }
        let kept: Vec<usize> = self
            .session
            .fit_trials()
            .into_iter()
            .filter(|&i| !self.stretches[i].is_empty())
            .collect();
        if !kept.is_empty() {
            self.fitted = kept;
        }
        Ok(true)
    }

    /// The samples of a trial at which a joint with dry friction rests.
    fn resting(&self, trial: usize, run: &Run<N>) -> Vec<bool> {
        /// Share of its fastest speed below which a joint rests, and the speed above which it never does \[rad/s\].
        const SLOW: (f64, f64) = (0.25, 0.03);
        let course = &self.courses[trial];
        let count = self.session.trials[trial].len();
        let speed = |i: usize, j: usize| match course.motion() {
            Some(motion) => motion.qd[i][j].abs(),
            None => {
                let recorded = &run.recording().qd;
                recorded.get(i * N + j).map_or(0.0, |v| v.abs())
            }
        };
        let mut rest = vec![false; count];
        for j in (0..N).filter(|&j| self.dry[j]) {
            let fastest = (0..count).map(|i| speed(i, j)).fold(0.0, f64::max);
            let limit = f64::min(SLOW.0 * fastest, SLOW.1);
            for (i, flag) in rest.iter_mut().enumerate() {
                *flag |= speed(i, j) <= limit;
            }
        }
        rest
    }

    /// Measured less predicted channels of trials.
    ///
    /// # Errors
    /// [`GapError::Simulation`] names the first trial that the hypothesis cannot be simulated on.
    pub fn residuals(
        &self,
        hypothesis: &Hypothesis<N>,
        trials: &[usize],
    ) -> Result<Vec<Channels>, GapError> {
        let one = |i: usize| {
            let course = &self.courses[trials[i]];
            let run = self.session.run(hypothesis, course)?;
            let predicted = self.session.read(hypothesis, course, &run)?;
            Ok(difference(&course.seen, &predicted))
        };
        let outcomes = self.parallel(trials.len(), one);
        std::iter::zip(outcomes, trials)
            .map(|(outcome, &trial)| {
                outcome.map_err(|source| GapError::Simulation { trial, source })
            })
            .collect()
    }

    /// How hypotheses change what the channels of each group's reference read, for one unit of a number.
    ///
    /// Led arms are linearised along the run; what that form does not know is simulated.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis itself cannot be simulated.
    pub fn responses(
        &self,
        hypothesis: &Hypothesis<N>,
        changes: &[Change<N>],
    ) -> Result<Vec<Response>, GapError> {
        if changes.is_empty() {
            return Ok(Vec::new());
        }
        let groups = self.references.len();
        let base = self.parallel(groups, |g| self.along(hypothesis, g));
        let mut bases = Vec::with_capacity(groups);
        for (group, outcome) in base.into_iter().enumerate() {
            let trial = self.references[group];
            bases.push(outcome.map_err(|source| GapError::Simulation { trial, source })?);
        }
        let one = |job: usize| {
            let change = &changes[job / groups];
            let group = job % groups;
            if let Some(linear) = &bases[group].linear
                && let Some(response) = linear.response(
                    &change.changed,
                    change.size,
                    (change.sensing, change.moves_handle),
                )
            {
                return Some(response);
            }
            let played = || self.play(hypothesis, group).ok();
            let (run, base) = bases[group].played.get_or_init(played).as_ref()?;
            let course = &self.courses[self.references[group]];
            let predicted = if change.sensing {
                self.session.read(&change.changed, course, run)
            } else {
                self.play(&change.changed, group)
                    .map(|(_, channels)| channels)
            };
            let mut response = difference(&predicted.ok()?, base);
            for value in response.iter_mut().flatten() {
                *value /= change.size;
            }
            Some(response)
        };
        let mut all = self.parallel(changes.len() * groups, one).into_iter();
        Ok((0..changes.len())
            .map(|_| Response(all.by_ref().take(groups).collect()))
            .collect())
    }

    /// Responses to numbers of a hypothesis.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn responses_to(
        &self,
        hypothesis: &Hypothesis<N>,
        coordinates: &[Coordinate],
    ) -> Result<Vec<Response>, GapError> {
        let changes: Vec<_> = coordinates
            .iter()
            .map(|c| {
                let value = hypothesis.get(c.target);
                let step = if value + c.step > c.upper {
                    -c.step
                } else {
                    c.step
                };
                Change {
                    changed: hypothesis.clone().with(c.target, value + step),
                    size: step,
                    sensing: self.session.is_sensing(hypothesis, c.target),
                    moves_handle: matches!(c.target, Target::Shift(_) | Target::Placement(_)),
                }
            })
            .collect();
        self.responses(hypothesis, &changes)
    }

    /// Responses to what differs from trial to trial.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn own_responses(&self, hypothesis: &Hypothesis<N>) -> Result<Vec<Response>, GapError> {
        self.responses_to(hypothesis, &self.session.by_trial())
    }

    /// Condenses trials to normal equations.
    ///
    /// * `residuals` - of the trials, in the same order
    /// * `columns` - responses to the unknowns
    /// * `own` - responses to what differs from trial to trial
    pub fn clusters(
        &self,
        trials: &[usize],
        residuals: &[Channels],
        columns: &[&Response],
        own: &[Response],
    ) -> Vec<Cluster> {
        let by_trial = self.session.by_trial();
        self.parallel(trials.len(), |i| {
            let trial = trials[i];
            let (group, stretches) = (self.group_of[trial], &self.stretches[trial]);
            let rows = |response: &Response| match &response.0[group] {
                Some(channels) => self.noise.whiten(
                    &fitted_to(channels, self.session.trials[trial].len()),
                    stretches,
                ),
                None => vec![0.0; stretches.len() * self.session.channels()],
            };
            let columns: Vec<Vec<f64>> = columns.iter().map(|r| rows(r)).collect();
            let own: Vec<(Vec<f64>, f64)> = std::iter::zip(own, &by_trial)
                .map(|(r, c)| (rows(r), c.prior.map_or(f64::INFINITY, |p| p.1)))
                .collect();
            let residual = self.noise.whiten(&residuals[i], stretches);
            Cluster::new(group, &columns, &residual, &own)
        })
    }

    /// A group's reference ready for responses.
    fn along(
        &self,
        hypothesis: &Hypothesis<N>,
        group: usize,
    ) -> Result<Base<'_, N>, arm_sim::SimulationError> {
        let course = &self.courses[self.references[group]];
        let linear = match self.session.sight {
            Sight::Led => Linear::along(self.session, hypothesis, course)?,
            Sight::Torque => None,
        };
        Ok(Base {
            linear,
            played: OnceLock::new(),
        })
    }

    /// A hypothesis on the reference of a group.
    fn play(
        &self,
        hypothesis: &Hypothesis<N>,
        group: usize,
    ) -> Result<(Run<N>, Channels), arm_sim::SimulationError> {
        let course = &self.courses[self.references[group]];
        let run = self.session.run(hypothesis, course)?;
        let channels = self.session.read(hypothesis, course, &run)?;
        Ok((run, channels))
    }

    /// Results of jobs in their order, whatever the number of threads.
    pub fn parallel<R: Send>(&self, jobs: usize, one: impl Fn(usize) -> R + Sync) -> Vec<R> {
        if self.threads <= 1 || jobs <= 1 {
            return (0..jobs).map(one).collect();
        }
        let next = AtomicUsize::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let job = next.fetch_add(1, Ordering::Relaxed);
                if job >= jobs {
                    return done;
                }
                done.push((job, one(job)));
            }
        };
        let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..self.threads.min(jobs))
                .map(|_| scope.spawn(work))
                .collect();
            let joined = workers.into_iter().map(|worker| worker.join());
            joined
                .flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect()
        });
        all.sort_by_key(|(job, _)| *job);
        all.into_iter().map(|(_, result)| result).collect()
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

/// Whether two sampling rates are one: time stamps are rounded.
pub fn same_rate(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-3 * b
}

/// Channels of a group's reference, cut or held at the end for a member of another length.
pub fn fitted_to(channels: &Channels, length: usize) -> Channels {
    let cut = |c: &Vec<f64>| {
        let mut out = c.clone();
        let last = out.last().copied().unwrap_or(0.0);
        out.resize(length, last);
        out
    };
    channels.iter().map(cut).collect()
}

/// Channels less channels.
pub fn difference(a: &Channels, b: &Channels) -> Channels {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| std::iter::zip(a, b).map(|(a, b)| a - b).collect();
    std::iter::zip(a, b).map(one).collect()
}

/// Thinned channels with their stretches joined.
fn flat(channels: &Channels, stretches: &Stretches) -> Vec<Vec<f64>> {
    let one = |c: &Vec<f64>| stretches.pick(c).into_iter().flatten().collect();
    channels.iter().map(one).collect()
}

/// Takes the least-squares share of columns out of a set of channels, each channel weighed by its own size.
fn remove(channels: &mut [Vec<f64>], columns: &[Vec<Vec<f64>>]) {
    let weights: Vec<f64> = channels
        .iter()
        .map(|c| {
            let square: f64 = c.iter().map(|v| v * v).sum();
            if square > 0.0 {
                c.len() as f64 / square
            } else {
                0.0
            }
        })
        .collect();
    let product = |a: &[Vec<f64>], b: &[Vec<f64>]| -> f64 {
        (0..weights.len()).fold(0.0, |s, c| s + weights[c] * crate::noise::dot(&a[c], &b[c]))
    };
    // One after the other, each made orthogonal to those before it.
    let mut basis: Vec<Vec<Vec<f64>>> = Vec::new();
    for column in columns {
        let mut column = column.clone();
        for other in &basis {
            let share = product(&column, other) / product(other, other);
            for (c, o) in column.iter_mut().flatten().zip(other.iter().flatten()) {
                *c -= share * o;
            }
        }
        if product(&column, &column) > 0.0 {
            basis.push(column);
        }
    }
    for column in &basis {
        let share = product(channels, column) / product(column, column);
        for (v, c) in channels.iter_mut().flatten().zip(column.iter().flatten()) {
            *v -= share * c;
        }
    }
}

/// Trials that repeat one movement: the group of each, and the longest trial of every group.
fn groups<const N: usize>(trials: &[Trial<N>], courses: &[Course<N>]) -> (Vec<usize>, Vec<usize>) {
    let mut group_of = Vec::with_capacity(trials.len());
    let mut references: Vec<usize> = Vec::new();
    for (i, trial) in trials.iter().enumerate() {
        let found = references.iter().position(|&r| {
            trials[r].configuration == trial.configuration
                && same_rate(trials[r].rate, trial.rate)
                && courses[r].is_like(&courses[i], SAME_PATH)
        });
        match found {
            Some(group) => {
                group_of.push(group);
                if trial.len() > trials[references[group]].len() {
                    references[group] = i;
                }
            }
            None => {
                group_of.push(references.len());
                references.push(i);
            }
        }
    }
    (group_of, references)
}

impl<const N: usize> Course<N> {
    /// Whether another trial makes the same movement at the same times.
    fn is_like(&self, other: &Self, allowed: f64) -> bool {
        let (mine, theirs) = (self.path(), other.path());
        let count = mine.len().min(theirs.len());
        let longest = mine.len().max(theirs.len());
        if count < longest - longest / 10 {
            return false;
        }
        let square: f64 = std::iter::zip(&mine, &theirs)
            .flat_map(|(a, b)| std::iter::zip(a, b).map(|(a, b)| (a - b) * (a - b)))
            .sum();
        square <= allowed * allowed * count as f64
    }
}

impl<const N: usize> Session<N> {
    /// Whether the arm is led by a robot.
    pub fn is_led(&self) -> bool {
        self.sight == Sight::Led
    }
}

impl Target {
    /// Whether it belongs to a named effect, and to which.
    pub fn named(self) -> Option<usize> {
        match self {
            Self::Named(e, _) => Some(e),
            _ => None,
        }
    }
}
