//! The gap workflow: search, screening, simulated trials and distances of alternatives.

use std::sync::{Arc, Mutex};

use arm_core::Chain;
use arm_core::effect::Effect;
use arm_gap::GapError;
use arm_gap::data::session::{ComparisonMode, Session};
use arm_gap::prepared_session::PreparedSession;
use arm_gap::results as core;
use arm_gap::results::{SearchInput, TrialFile, Version};
use arm_gap::selection::model_discrimination::Discrimination;
use arm_ident::threads::parallel;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::arm::{AnyChain, each_short_length};
use crate::custom_effects;
use crate::errors::{bad_input, gap, refused};
use crate::identification::{Columns, read_trials};
use crate::model;
use crate::results::{Alternative, GapResult, Screening, SimulatedTrial};
use crate::rig::Rig;

/// What is known beforehand: the attributes of a Python `SearchSettings`.
#[derive(FromPyObject)]
pub struct SearchSettings {
    /// The model as given.
    model: Py<model::Model>,
    /// Whether the forces in the files are on the robot.
    force_on_robot: bool,
    tolerance: Py<model::Tolerance>,
    /// Whether a robot's own path is compared through the closed chain; else joint torques are.
    led: bool,
    /// Weights of the samples of each trial; see [`Session::weights`].
    weights: Vec<f64>,
    threads: usize,
    /// Names of user-defined kinds that are tested besides the catalogue.
    own: Vec<String>,
}

/// What a call is about.
struct Call<'a, 'py> {
    rig: &'a Rig,
    trials: &'a [Columns<'py>],
    settings: &'a SearchSettings,
}

impl<'a, 'py> Call<'a, 'py> {
    fn of(rig: &'a Rig, trials: &'a [Columns<'py>], settings: &'a SearchSettings) -> Self {
        Self {
            rig,
            trials,
            settings,
        }
    }

    fn session<const N: usize>(&self, chain: &Chain<f64, N>) -> PyResult<Session<N>> {
        let (rig, settings) = (self.rig, self.settings);
        Ok(Session {
            chain: *chain,
            contact: rig.contact,
            effects: rig.effects.clone(),
            segment_uncertainty: settings.model.get().inner().segment_uncertainty,
            tolerance: *settings.tolerance.get().inner(),
            trials: read_trials(self.trials, rig)?,
            comparison: if settings.led {
                ComparisonMode::Led
            } else {
                ComparisonMode::Torque
            },
            weights: settings.weights.clone(),
            own: settings
                .own
                .iter()
                .map(|kind| custom_effects::kind(kind))
                .collect::<PyResult<_>>()?,
            base: Vec::new(),
            start: [[0.0; 3]; N],
        })
    }

    fn files(&self) -> Vec<TrialFile> {
        let file = |c: &Columns<'_>| TrialFile {
            file: c.file.clone(),
            end: c.end(),
        };
        self.trials.iter().map(file).collect()
    }

    fn input<'s>(&'s self, trials: &'s [TrialFile]) -> SearchInput<'s> {
        SearchInput {
            model: self.settings.model.get().inner(),
            force_on_robot: self.settings.force_on_robot,
            trials,
        }
    }

    /// A session made ready, and what some work on it came to; the interpreter is free meanwhile.
    fn studied<'s, const N: usize, T: Send>(
        &self,
        py: Python<'_>,
        session: &'s Session<N>,
        work: impl FnOnce(&mut PreparedSession<'s, N>) -> Result<T, GapError> + Send,
    ) -> PyResult<(PreparedSession<'s, N>, T)> {
        let threads = self.settings.threads;
        let outcome = py.detach(|| {
            let mut prepared = PreparedSession::new(session, threads)?;
            let found = work(&mut prepared)?;
            Ok((prepared, found))
        });
        custom_effects::failed()?;
        outcome.map_err(gap)
    }
}

/// What a model shows of every trial, as `given`, beside what was measured.
///
/// As it is, or with `own` as it is in each trial: where the hand holds the handle there, and in which phase a rhythm is.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, own=false))]
pub fn play(
    py: Python<'_>,
    rig: &Rig,
    trials: Vec<Columns<'_>>,
    settings: SearchSettings,
    own: bool,
) -> PyResult<Vec<SimulatedTrial>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        call: &Call<'_, '_>,
        own: bool,
    ) -> PyResult<Vec<SimulatedTrial>> {
        let session = call.session(chain)?;
        session.check().map_err(gap)?;
        let given = session.given();
        let files: Vec<&str> = call.trials.iter().map(|c| c.file.as_str()).collect();
        let one = |i: usize| {
            let course = Arc::new(session.course(i)?);
            // A trial that cannot be simulated is reported below.
            let own_or_given = match own {
                true => session.in_trial((&given, &[]), &course).ok(),
                false => None,
            };
            let mut trial = core::SimulatedTrial::measured(&session, (i, files[i]), &course);
            let hypothesis = own_or_given.as_ref().unwrap_or(&given);
            trial.shown[Version::Given as usize] = session.shown_in(hypothesis, &course).ok();
            Ok(trial)
        };
        let threads = call.settings.threads;
        let plays = py.detach(|| parallel(threads, files.len(), one));
        custom_effects::failed()?;
        let made = |play: Result<core::SimulatedTrial, GapError>| {
            play.map(|trial| SimulatedTrial(trial.into())).map_err(gap)
        };
        plays.into_iter().map(made).collect()
    }
    let call = Call::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &call, own))
}

/// How far each joint moves in the fit trials, in the common band [rad]; in one of several trials a sensor may slip.
#[pyfunction]
pub fn reach(rig: &Rig, trials: Vec<Columns<'_>>, settings: SearchSettings) -> PyResult<Vec<f64>> {
    fn run<const N: usize>(chain: &Chain<f64, N>, call: &Call<'_, '_>) -> PyResult<Vec<f64>> {
        Ok(call.session(chain)?.reach().to_vec())
    }
    let call = Call::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(c, &call))
}

/// Searches for what a model lacks; see `armrs.find_gap`.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, progress=None))]
pub fn find_gap(
    py: Python<'_>,
    rig: &Rig,
    trials: Vec<Columns<'_>>,
    settings: SearchSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<GapResult> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        call: &Call<'_, '_>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<GapResult> {
        let session = call.session(chain)?;
        let session = py.detach(|| session.with_base(call.settings.threads));
        let callback = ProgressCallback::of(progress);
        let done = call.studied(py, &session, |s| s.search(&|w, s| callback.tell(w, s)));
        let (prepared, finding) = callback.or_raised(done)?;
        let files = call.files();
        let input = call.input(&files);
        py.detach(|| core::GapResult::of(&prepared, &finding, &input))
            .map(GapResult)
            .map_err(refused)
    }
    let call = Call::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &call, progress.as_ref()))
}

/// Calibrates a model, and tests every candidate alone to first order; see `armrs.gap.calibrate`.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, progress=None))]
pub fn look(
    py: Python<'_>,
    rig: &Rig,
    trials: Vec<Columns<'_>>,
    settings: SearchSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Screening> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        call: &Call<'_, '_>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<Screening> {
        let session = call.session(chain)?;
        let callback = ProgressCallback::of(progress);
        let done = call.studied(py, &session, |s| s.screen(&|w, s| callback.tell(w, s)));
        let (prepared, screening) = callback.or_raised(done)?;
        let files = call.files();
        let input = call.input(&files);
        py.detach(|| core::Screening::of(&prepared, &screening, &input))
            .map(Screening)
            .map_err(refused)
    }
    let call = Call::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &call, progress.as_ref()))
}

/// The callback for progress, and what was raised to stop the work.
struct ProgressCallback<'a> {
    callable: Option<&'a Py<PyAny>>,
    raised: Mutex<Option<PyErr>>,
}

impl<'a> ProgressCallback<'a> {
    fn of(callable: Option<&'a Py<PyAny>>) -> Self {
        Self {
            callable,
            raised: Mutex::new(None),
        }
    }

    fn tell(&self, what: &str, share: f64) -> Result<(), GapError> {
        Python::attach(|py| {
            let call = |callable: &Py<PyAny>| callable.call1(py, (what, share)).map(|_| ());
            let callback = py
                .check_signals()
                .and_then(|()| self.callable.map_or(Ok(()), call));
            match callback {
                // What a display does wrong is no reason to stop, but an interrupt is.
                Err(error) if !error.is_instance_of::<PyException>(py) => {
                    if let Ok(mut raised) = self.raised.lock() {
                        *raised = Some(error);
                    }
                    Err(GapError::Stopped)
                }
                _ => Ok(()),
            }
        })
    }

    /// What the work came to, unless it was stopped.
    fn or_raised<T>(self, outcome: PyResult<T>) -> PyResult<T> {
        match self.raised.into_inner() {
            Ok(Some(error)) => Err(error),
            _ => outcome,
        }
    }
}

/// An effect, and which of its parameters are free.
type Rival = (Effect<f64>, Vec<usize>);

/// How far apart a named effect and its rivals would be on planned movements, in standard deviations.
///
/// Parameters
/// ----------
/// rig : Rig
///     Everything with the named effect, which is the last of the rig's.
/// trials : list of Trial
///     Those that were made.
/// settings : SearchSettings
/// planned : list of Trial
///     Movements as they would be recorded.
/// rivals : list of Alternative
///
/// Returns
/// -------
/// list of list of float or None
///     First with the trials that were made alone, then with each planned one besides; None for what cannot be simulated.
#[pyfunction]
pub fn distances(
    py: Python<'_>,
    rig: &Rig,
    trials: Vec<Columns<'_>>,
    settings: SearchSettings,
    planned: Vec<Columns<'_>>,
    rivals: Vec<PyRef<'_, Alternative>>,
) -> PyResult<Vec<Option<Vec<f64>>>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        call: &Call<'_, '_>,
        (planned, rivals): (&[Columns<'_>], &[Rival]),
    ) -> PyResult<Vec<Option<Vec<f64>>>> {
        let all = call.session(chain)?;
        // Each is one more movement, beside those that were made.
        let alone = |c| read_trials(std::slice::from_ref(c), call.rig);
        let planned: Vec<_> = planned.iter().map(alone).collect::<PyResult<_>>()?;
        let threads = call.settings.threads;
        let mut without = all.clone();
        let Some(named) = without.effects.pop() else {
            return Err(bad_input("effects", "none", "a named effect"));
        };
        let outcome = py.detach(|| {
            let noise = PreparedSession::new(&all, threads)?.noise;
            let prepared = PreparedSession::with_noise(&without, noise, threads)?;
            let discrimination = Discrimination::new(prepared, named, rivals)?;
            let mut found = vec![Some(discrimination.distances(None)?)];
            let one = |i: usize| discrimination.distances(planned[i].first()).ok();
            let each = discrimination.prepared().parallel(planned.len(), one);
            found.extend(each);
            Ok(found)
        });
        custom_effects::failed()?;
        outcome.map_err(gap)
    }
    let rivals = rivals
        .iter()
        .map(|rival| {
            let effect = rival.0.simulated;
            let effect = effect.ok_or_else(|| bad_input("rivals", "one", "fitted ones"))?;
            Ok((effect.core(), rival.0.free.clone()))
        })
        .collect::<PyResult<Vec<_>>>()?;
    let call = Call::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &call, (&planned, &rivals)))
}
