//! A session made ready: every trial's course, which trials repeat each other, and the noise.

use std::sync::Arc;

use arm_core::effect::{Local, Place};
use nalgebra::{DMatrix, DVector};

use crate::GapError;
use crate::anchor::Anchor;
use crate::groups::groups;
use crate::hypothesis::Hypothesis;
use crate::noise::{Noise, Stretches, dot};
use crate::normal::factor;
use crate::predict::{Channels, Course};
use crate::session::{Session, Sight};
use crate::threads;

/// A session made ready.
pub struct Study<'a, const N: usize> {
    /// What is challenged and by what.
    pub session: &'a Session<N>,
    /// Every trial, in their order.
    pub courses: Vec<Arc<Course<N>>>,
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
    /// The samples of each group at which one of them rests.
    resting: Vec<Vec<bool>>,
    /// What disturbances have touched: trial, start and end \[s\].
    touched: Vec<(usize, f64, f64)>,
    /// Threads.
    pub threads: usize,
}

impl<'a, const N: usize> Study<'a, N> {
    /// Makes a session ready; the noise is read off the repeats of the fit trials against the model as given.
    ///
    /// # Errors
    /// [`GapError`] for data that cannot be judged, or a model that cannot be simulated.
    pub fn new(session: &'a Session<N>, threads: usize) -> Result<Self, GapError> {
        let noise = Noise::unknown(session.channels())?;
        let mut study = Self::with_noise(session, noise, threads)?;
        let given = study.anchor(&session.given())?;
        study.leave_out_rest(&given);
        study.measure_noise(&given)?;
        Ok(study)
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
        Ok(Self {
            session,
            courses,
            stretches,
            group_of,
            references,
            noise,
            repeated: false,
            fitted,
            dry: [false; N],
            resting: Vec::new(),
            touched: Vec::new(),
            threads,
        })
    }

    /// Reads the noise anew: what repeats differ in, or without repeats what a hypothesis leaves.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for series that no noise can be read off.
    pub fn measure_noise(&mut self, anchor: &Anchor<N>) -> Result<(), GapError> {
        let channels = self.session.channels();
        let mut deviations = Vec::new();
        // For each deviation what a trial may differ by without noise.
        let mut shifts: Vec<Arc<Vec<Vec<Vec<f64>>>>> = Vec::new();
        for group in 0..self.references.len() {
            let members: Vec<usize> = (0..self.fitted.len())
                .filter(|&m| self.group_of[self.fitted[m]] == group)
                .collect();
            let Some(&first) = members.first() else {
                continue;
            };
            let n = members.len();
            let stretches = &self.stretches[self.fitted[first]];
            let same = |m: &usize| self.stretches[self.fitted[*m]] == *stretches;
            if n < 2 || !members.iter().all(same) {
                continue;
            }
            let scale = libm::sqrt(n as f64 / (n as f64 - 1.0));
            let picked: Vec<Vec<Vec<f64>>> = members
                .iter()
                .map(|&m| flat(&anchor.residuals[m], stretches))
                .collect();
            let own = anchor.own.iter();
            let columns = Arc::new(
                own.map(|r| flat(&r.0[group], stretches))
                    .collect::<Vec<_>>(),
            );
            for one in &picked {
                let deviation: Vec<Vec<f64>> = (0..channels)
                    .map(|c| {
                        let mean =
                            |i: usize| picked.iter().map(|p| p[c][i]).sum::<f64>() / n as f64;
                        (0..one[c].len())
                            .map(|i| scale * (one[c][i] - mean(i)))
                            .collect()
                    })
                    .collect();
                deviations.push(deviation);
                shifts.push(Arc::clone(&columns));
            }
        }
        self.repeated = !deviations.is_empty();
        let range: Vec<f64> = (0..channels)
            .map(|c| {
                // An arm that swings freely has no torque to show, but its inertia has.
                let seen = self.fitted.iter().flat_map(|&t| &self.courses[t].seen[c]);
                let all = seen.chain(anchor.residuals.iter().flat_map(|r| &r[c]));
                let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(*v), b.max(*v))
                });
                (high - low).max(0.0)
            })
            .collect();
        self.noise = if self.repeated {
            self.noise_of(&deviations, &shifts, &range)?
        } else {
            self.noise_of_residuals(anchor, &range)?
        };
        Ok(())
    }

    /// The noise of deviations, and how far each is shifted, found in turns: as much is taken for a shift as the noise and
    /// what is known of shifts allow.
    fn noise_of(
        &self,
        deviations: &[Vec<Vec<f64>>],
        shifts: &[Arc<Vec<Vec<Vec<f64>>>>],
        range: &[f64],
    ) -> Result<Noise, GapError> {
        const TURNS: usize = 3;
        let known: Vec<f64> = self
            .session
            .by_trial()
            .iter()
            .map(|c| c.prior.map_or(f64::INFINITY, |(_, sd)| sd))
            .collect();
        let mut noise = Noise::of(deviations, range)?;
        for _ in 0..TURNS {
            if known.is_empty() {
                break;
            }
            let mut clean = deviations.to_vec();
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
                for (share, column) in solver.solve(&score).iter().zip(columns.iter()) {
                    let values = column.iter().flatten();
                    for (value, shift) in deviation.iter_mut().flatten().zip(values) {
                        *value -= share * shift;
                    }
                }
            }
            noise = Noise::of(&clean, range)?;
        }
        Ok(noise)
    }

    /// Leaves out the samples at which a joint with dry friction rests, or reverses: there friction is whatever holds it.
    ///
    /// Whether anything changed since the last time; then anchors are to be made anew. The samples of repeats stay the same:
    /// they rest together.
    pub fn leave_out_rest(&mut self, anchor: &Anchor<N>) -> bool {
        let dry = dry_joints(&anchor.hypothesis);
        if dry == self.dry {
            return false;
        }
        self.dry = dry;
        let one = |group: usize| self.resting(anchor, group);
        self.resting = (0..self.references.len()).map(one).collect();
        self.cut();
        true
    }

    /// Leaves out what a disturbance has touched in one trial.
    pub fn leave_out(&mut self, trial: usize, (start, end): (f64, f64)) {
        self.touched.push((trial, start, end));
        self.cut();
    }

    /// Takes everything that disturbances have touched back in.
    pub fn take_back(&mut self) {
        self.touched.clear();
        self.cut();
    }

    /// Chooses the samples that are compared, and the trials that have any.
    fn cut(&mut self) {
        /// How long a disturbance is felt before and after, the low-pass included \[s\].
        const AROUND: (f64, f64) = (0.2, 0.5);
        for i in 0..self.courses.len() {
            let trial = &self.session.trials[i];
            let rest = self.resting.get(self.group_of[i]);
            let mut out = rest.cloned().unwrap_or_default();
            out.resize(trial.len(), false);
            for (_, start, end) in self.touched.iter().filter(|(t, _, _)| *t == i) {
                for (k, flag) in out.iter_mut().enumerate() {
                    let time = k as f64 / trial.rate;
                    *flag |= time >= start - AROUND.0 && time <= end + AROUND.1;
                }
            }
            self.stretches[i] = Stretches::of(trial, &self.courses[i], &out);
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
    }

    /// The samples of a movement at which a joint with dry friction rests.
    fn resting(&self, anchor: &Anchor<N>, group: usize) -> Vec<bool> {
        /// Share of its fastest speed below which a joint rests, and the speed above which it never does \[rad/s\].
        const SLOW: (f64, f64) = (0.25, 0.03);
        let course = &self.courses[self.references[group]];
        let count = course.seen[0].len();
        let speed = |i: usize, j: usize| match (course.motion(), anchor.lines.get(group)) {
            (Some(motion), _) => motion.qd[i][j].abs(),
            (None, Some(line)) => line.state(i).1[j].abs(),
            (None, None) => f64::INFINITY,
        };
        let mut rest = vec![false; count];
        for j in (0..N).filter(|&j| self.dry[j]) {
            let fastest = (0..count).map(|i| speed(i, j)).fold(0.0, f64::max);
            let limit = f64::min(SLOW.0 * fastest, SLOW.1);
            // Where torques are compared a joint that reverses on the way does not rest: the law of its friction holds through zero.
            let shortest = match self.session.sight {
                Sight::Led => 1,
                Sight::Torque => (course.rate / course.band) as usize,
            };
            let mut start = 0;
            for i in 0..=count {
                if i < count && speed(i, j) <= limit {
                    continue;
                }
                if i - start >= shortest {
                    rest[start..i].fill(true);
                }
                start = i + 1;
            }
        }
        rest
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
pub fn flat(channels: &Channels, stretches: &Stretches) -> Vec<Vec<f64>> {
    let one = |c: &Vec<f64>| stretches.pick(c).into_iter().flatten().collect();
    channels.iter().map(one).collect()
}
