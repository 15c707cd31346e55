//! A prepared session: the course of every trial, the groups of repeats, and the noise.

use std::sync::{Arc, Mutex};

use arm_core::effect::{Effect, Kind};
use arm_ident::regression::unknown::spring;
use arm_ident::threads::parallel;

use crate::GapError;
use crate::data::course::{Channels, Course};
use crate::data::noise::NoiseModel;
use crate::data::repeats::groups;
use crate::data::session::Session;
use crate::data::valid_segments::{Observable, ValidSegments};
use crate::hypothesis::{Coordinate, Hypothesis, Target};
use crate::linearization::linear_response::Response;
use crate::linearization::linearized_run::Linear;

/// How long a disturbance acts before and after, the low-pass and the error of its timing included \[s\].
const AROUND: (f64, f64) = (0.5, 0.5);

/// What rest takes from the comparison of a movement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rest {
    /// Samples that are left out.
    pub left_out: Vec<bool>,
    /// Channels where not all are.
    pub observable: Arc<Vec<Observable>>,
    /// By joint, where it rests in a measured motion; nothing is listed where the motion is simulated.
    pub joints: Vec<Vec<bool>>,
}

/// A session made ready.
#[derive(Clone)]
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
    pub noise: NoiseModel,
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
    /// The runs of the hypotheses that were simulated last: a search comes back to what it has tried.
    pub(crate) simulated: Arc<Mutex<Vec<Arc<SimulatedRuns<'a, N>>>>>,
}

/// A simulated hypothesis, and what was computed from its runs: a search needs the same again when noise or samples have changed.
pub(crate) struct SimulatedRuns<'a, const N: usize> {
    pub hypothesis: Hypothesis<N>,
    /// On the reference of each group.
    pub lines: Arc<Vec<Linear<'a, N>>>,
    /// What the sensors would read on trials, in the common band.
    pub shown: Mutex<Vec<(Arc<Course<N>>, Channels)>>,
    /// Responses to numbers of the hypothesis.
    pub responses: Mutex<Vec<(Coordinate, Response)>>,
}

impl<'a, const N: usize> PreparedSession<'a, N> {
    /// Makes a session ready whose noise is known from another one.
    ///
    /// # Errors
    /// [`GapError`] for insufficient data.
    pub fn with_noise(
        session: &'a Session<N>,
        noise: NoiseModel,
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
        let noise = noise.weighed(&courses);
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
            dropped: session.unlikely_laws(),
            start: None,
            threads,
            simulated: Arc::default(),
        })
    }

    /// The most of the fitted trials of a movement, by their places among them, that have the same samples, and these samples.
    pub(crate) fn agreeing(&self, group: usize) -> Option<(Vec<usize>, ValidSegments)> {
        let members: Vec<usize> = (0..self.fitted.len())
            .filter(|&m| self.group_of[self.fitted[m]] == group)
            .collect();
        let all: Vec<_> = members
            .iter()
            .map(|&m| &self.valid_segments[self.fitted[m]])
            .collect();
        let (agreeing, samples) = ValidSegments::agreeing(&all)?;
        Some((agreeing.into_iter().map(|i| members[i]).collect(), samples))
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

    /// Whether a time \[s\] of a trial is left out because a disturbance has touched it.
    ///
    /// The contact does not place an arm of more than two joints: dry friction may hold it elsewhere than in its repeats from a disturbance
    /// to the end of the trial.
    pub(crate) fn is_left_out(&self, trial: usize, time: f64) -> bool {
        let stays = N > 2 && self.leaves_out_rest();
        let mut own = self.touched.iter().filter(|(t, _, _)| *t == trial);
        own.any(|(_, start, end)| time >= start - AROUND.0 && (stays || time <= end + AROUND.1))
    }

    /// Takes everything that disturbances have touched back in.
    pub fn take_back(&mut self) {
        self.touched.clear();
        self.cut();
    }

    /// Number of rows that the fit trials are compared by.
    pub(crate) fn compared_rows(&self) -> usize {
        let channels = self.session.channels();
        let fitted = self.fitted.iter();
        fitted
            .flat_map(|&t| self.valid_segments[t].rows_per_channel(channels))
            .sum()
    }

    /// Chooses the samples that are compared, and the trials that have any.
    pub(crate) fn cut(&mut self) {
        for i in 0..self.courses.len() {
            let trial = &self.session.trials[i];
            let rest = self.resting.get(self.group_of[i]).cloned();
            let Rest {
                mut left_out,
                observable,
                ..
            } = rest.unwrap_or_default();
            left_out.resize(trial.len(), false);
            for (k, flag) in left_out.iter_mut().enumerate() {
                *flag |= self.is_left_out(i, k as f64 / trial.rate);
            }
            self.valid_segments[i] =
                ValidSegments::of(trial, &self.courses[i], &left_out, observable);
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

    /// What is refitted with every candidate; see [`Session::nuisances`]. Dropped laws of the base are not.
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
        parallel(self.threads, jobs, one)
    }

    /// Whether a law of the base acts that is not dropped, or stands for it: a spring with its rest angle stands for a constant moment.
    pub(crate) fn has_in_base(&self, kind: Kind, joint: usize) -> bool {
        let is_constant = Effect::<f64>::new(kind, joint).is_constant();
        let stands = |e: &Effect<f64>| e.kind == kind || is_constant && spring(e).is_some();
        let mut kept = std::iter::zip(&self.dropped, &self.session.base).filter(|(d, _)| !**d);
        kept.any(|(_, law)| law.effect.index == joint && stands(&law.effect))
    }

    /// Whether samples are left out because a joint rests there.
    pub(crate) fn leaves_out_rest(&self) -> bool {
        !self.resting.is_empty()
    }
}
