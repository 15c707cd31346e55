//! The gap workflow: trials in, what the model lacks out.

use std::sync::{Arc, Mutex};

use arm_core::Chain;
use arm_core::effect::Effect;
use arm_gap::GapError;
use arm_gap::candidates::candidate::Candidate;
use arm_gap::data::prepared_session::PreparedSession;
use arm_gap::data::session::{ComparisonMode, Session};
use arm_gap::measurement_model::hypothesis::{Coordinate, Hypothesis, Target};
use arm_gap::measurement_model::prediction::{Channels, Course};
use arm_gap::selection::conclusion::Finding;
use arm_gap::selection::first_order_screening::Look;
use arm_gap::selection::fit::Fitted;
use arm_gap::selection::held_out::{Left, Open, held_out as open_gaps};
use arm_gap::selection::lack_of_fit::LackOfFit;
use arm_gap::selection::model_discrimination::Contest;
use arm_gap::selection::model_selection::Named;
use arm_gap::trial_specific::component::TrialSpecific;
use numpy::ToPyArray;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arm::{AnyChain, each_short_length};
use crate::errors::{bad_input, gap};
use crate::ident::{Columns, read_trials, tolerance};
use crate::model;
use crate::own;
use crate::rig::Rig;

/// What is known beforehand.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    segment_uncertainty: f64,
    tolerance: Py<model::Tolerance>,
    /// Whether a robot's own path is compared through the closed chain; else joint torques are.
    led: bool,
    threads: usize,
    /// Names of kinds of one's own that are asked besides the catalogue.
    own: Vec<String>,
}

/// What a call is about.
struct Asked<'a, 'py> {
    rig: &'a Rig,
    trials: &'a [Columns<'py>],
    settings: &'a Settings,
}

impl<'a, 'py> Asked<'a, 'py> {
    fn of(rig: &'a Rig, trials: &'a [Columns<'py>], settings: &'a Settings) -> Self {
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
            segment_uncertainty: settings.segment_uncertainty,
            tolerance: tolerance(settings.tolerance.get()),
            trials: read_trials(self.trials, rig)?,
            comparison: if settings.led {
                ComparisonMode::Led
            } else {
                ComparisonMode::Torque
            },
            own: settings
                .own
                .iter()
                .map(|kind| own::kind(kind))
                .collect::<PyResult<_>>()?,
            base: Vec::new(),
            start: [[0.0; 3]; N],
        })
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
        own::failed()?;
        outcome.map_err(gap)
    }
}

/// What a model would show on every trial, beside what was measured; see [`shown`].
///
/// As it is, or with `own` as it is in each trial: where the hand holds the handle there, and in which phase a rhythm is.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, own=false))]
pub fn play<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
    own: bool,
) -> PyResult<Bound<'py, PyList>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        asked: &Asked<'_, 'py>,
        own: bool,
    ) -> PyResult<Bound<'py, PyList>> {
        let session = asked.session(chain)?;
        session.check().map_err(gap)?;
        let given = session.given();
        let plays = (0..session.trials.len())
            .map(|i| {
                let course = Arc::new(session.course(i).map_err(gap)?);
                // What cannot be simulated is told of below, with its trial.
                let believed = match own {
                    true => py.detach(|| session.in_trial((&given, &[]), &course)).ok(),
                    false => None,
                };
                let believed = believed.as_ref().unwrap_or(&given);
                shown(py, (&session, &course), &[("given", believed)])
            })
            .collect::<PyResult<Vec<_>>>();
        own::failed()?;
        PyList::new(py, plays?)
    }
    let asked = Asked::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &asked, own))
}

/// Searches for what a model lacks; see `armrs.find_gap`.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, progress=None))]
pub fn find_gap<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        asked: &Asked<'_, 'py>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let session = asked.session(chain)?;
        let session = py.detach(|| session.with_base());
        let callback = ProgressCallback::of(progress);
        let done = asked.studied(py, &session, |s| s.search(&|w, s| callback.tell(w, s)));
        let (prepared, finding) = callback.or_raised(done)?;
        result(py, &prepared, &finding)
    }
    let asked = Asked::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &asked, progress.as_ref()))
}

/// Calibrates a model, and asks every candidate alone to first order; see `armrs.gap.calibrate`.
#[pyfunction]
#[pyo3(signature = (rig, trials, settings, progress=None))]
pub fn look<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        asked: &Asked<'_, 'py>,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let session = asked.session(chain)?;
        let callback = ProgressCallback::of(progress);
        let done = asked.studied(py, &session, |s| s.look(&|w, s| callback.tell(w, s)));
        let (prepared, look) = callback.or_raised(done)?;
        first_look(py, &prepared, &look)
    }
    let asked = Asked::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &asked, progress.as_ref()))
}

fn first_look<'py, const N: usize>(
    py: Python<'py>,
    prepared: &PreparedSession<'_, N>,
    look: &Look<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("groups", prepared.group_of.clone())?;
    out.set_item("calibrated", fitted(py, &look.calibrated)?)?;
    out.set_item("lack", lack(&look.lack))?;
    out.set_item("unknowns", unknowns(prepared, &look.calibrated))?;
    let suspects: Vec<_> = look
        .suspects
        .iter()
        .map(|s| {
            (
                entry(&s.effect),
                s.candidate.free.clone(),
                s.gain,
                s.price,
                s.smallest,
            )
        })
        .collect();
    out.set_item("suspects", suspects)?;
    let plays = [("calibrated", look.in_trials.as_slice())];
    out.set_item("trials", played(py, prepared, &plays)?)?;
    Ok(out)
}

/// Who is told of the work, and what was raised to stop it.
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

/// The nuisances of a calibrated model, with what was known of them; see [`unknown`].
fn unknowns<const N: usize>(
    prepared: &PreparedSession<'_, N>,
    calibrated: &Fitted<N>,
) -> Vec<(&'static str, usize, usize, f64, f64, f64)> {
    let nuisances = prepared.session.nuisances();
    let each = nuisances.iter();
    each.filter_map(|c| unknown(&calibrated.hypothesis, c, f64::NAN))
        .collect()
}

fn lack(l: &LackOfFit) -> (f64, f64, f64) {
    (l.ratio, l.z, l.excess)
}

/// Measured channels of one trial, and those that hypotheses show; `None` where one cannot be simulated.
fn shown<'py, const N: usize>(
    py: Python<'py>,
    (session, course): (&Session<N>, &Course<N>),
    plays: &[(&str, &Hypothesis<N>)],
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("measured", table(py, session.measured_in(course))?)?;
    out.set_item("counted", course.counted.to_pyarray(py))?;
    for (name, hypothesis) in plays {
        let channels = py.detach(|| session.shown_in(hypothesis, course));
        set_table(&out, name, channels.ok())?;
    }
    Ok(out)
}

/// What the model as given and other hypotheses, as they are in each trial, show of every trial, and the angles of a free run in `free`.
fn played<'py, const N: usize>(
    py: Python<'py>,
    prepared: &PreparedSession<'_, N>,
    plays: &[(&str, &[Hypothesis<N>])],
) -> PyResult<Bound<'py, PyList>> {
    let given = rigid(prepared.session);
    let trials = std::iter::zip(0.., &prepared.courses)
        .map(|(i, course)| {
            let own = plays.iter().map(|(name, beliefs)| (*name, &beliefs[i]));
            let plays: Vec<_> = std::iter::once(("given", &given)).chain(own).collect();
            let one = shown(py, (prepared.session, course), &plays)?;
            let free = PyDict::new(py);
            for (name, hypothesis) in &plays {
                let place = (i, course.as_ref());
                let angles = py.detach(|| prepared.session.free_run(hypothesis, place));
                set_table(&free, name, angles.ok())?;
            }
            one.set_item("free", free)?;
            Ok(one)
        })
        .collect::<PyResult<Vec<_>>>()?;
    PyList::new(py, trials)
}

/// Effects that would do instead of a named one, and which of their parameters are free.
type Rivals = Vec<(String, usize, Vec<f64>, Vec<usize>)>;

/// An effect, and which of its parameters are free.
type Rival = (Effect<f64>, Vec<usize>);

/// How far apart a named effect and its rivals would be on planned movements, in standard deviations.
///
/// Parameters
/// ----------
/// rig : Rig
///     Everything with the named effect, which is the last of the rig's.
/// trials : list of dict
///     Those that were made.
/// settings : dict
/// planned : list of dict
///     Movements as they would be recorded.
/// rivals : list of (kind, index, values, free)
///
/// Returns
/// -------
/// list of list of float or None
///     First with the trials that were made alone, then with each planned one besides; None for what cannot be simulated.
#[pyfunction]
pub fn distances<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
    planned: Vec<Columns<'py>>,
    rivals: Rivals,
) -> PyResult<Vec<Option<Vec<f64>>>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        asked: &Asked<'_, '_>,
        (planned, rivals): (&[Columns<'_>], &[Rival]),
    ) -> PyResult<Vec<Option<Vec<f64>>>> {
        let all = asked.session(chain)?;
        let (planned, threads) = (read_trials(planned, asked.rig)?, asked.settings.threads);
        let mut without = all.clone();
        let Some(named) = without.effects.pop() else {
            return Err(bad_input("effects", "none", "a named effect"));
        };
        let outcome = py.detach(|| {
            let noise = PreparedSession::new(&all, threads)?.noise;
            let prepared = PreparedSession::with_noise(&without, noise, threads)?;
            let contest = Contest::new(prepared, named, rivals)?;
            let mut found = vec![Some(contest.distances(None)?)];
            let one = |i: usize| contest.distances(Some(&planned[i])).ok();
            let each = contest.prepared().parallel(planned.len(), one);
            found.extend(each);
            Ok(found)
        });
        own::failed()?;
        outcome.map_err(gap)
    }
    let rivals = rivals
        .into_iter()
        .map(|(kind, index, values, free)| {
            Ok((Effect::new(own::kind(&kind)?, index).with(&values), free))
        })
        .collect::<PyResult<Vec<_>>>()?;
    let asked = Asked::of(rig, &trials, &settings);
    each_short_length!(&rig.arm.chain, c => run(py, c, &asked, (&planned, &rivals)))
}

fn result<'py, const N: usize>(
    py: Python<'py>,
    prepared: &PreparedSession<'_, N>,
    finding: &Finding<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("repeated", prepared.repeated)?;
    out.set_item("groups", prepared.group_of.clone())?;
    out.set_item("scale", finding.scale)?;
    out.set_item("calibrated", fitted(py, &finding.calibrated)?)?;
    out.set_item("amended", fitted(py, &finding.amended)?)?;
    let rhythms = || finding.trial_specific.iter().filter(|a| a.trial.is_none());
    let entries = |list: &mut dyn Iterator<Item = &TrialSpecific>| -> Vec<Entry> {
        list.map(|a| entry(&a.effect)).collect()
    };
    out.set_item("rhythms", entries(&mut rhythms()))?;
    out.set_item("locked", entries(&mut rhythms().filter(|a| a.locked)))?;
    out.set_item("lack", finding.lack.each_ref().map(lack))?;
    let known: Vec<_> = std::iter::zip(&finding.precision.coordinates, &finding.precision.sd)
        .filter_map(|(c, sd)| unknown(&finding.amended.hypothesis, c, *sd))
        .collect();
    out.set_item("unknowns", known)?;
    let effects = finding
        .named
        .iter()
        .map(|n| named(py, n, finding))
        .collect::<PyResult<Vec<_>>>()?;
    out.set_item("named", PyList::new(py, effects)?)?;
    let trial_specific: Vec<_> = finding
        .trial_specific
        .iter()
        .map(|a| {
            let rivals: Vec<_> = a
                .rivals
                .iter()
                .map(|(e, worse)| (entry(e), *worse))
                .collect();
            (entry(&a.effect), a.sd, a.trial, a.span(), a.gain, rivals)
        })
        .collect();
    out.set_item("apart", trial_specific)?;
    let ruled: Vec<_> = finding
        .ruled
        .iter()
        .map(|r| (asked(&r.candidate), r.gain, r.price, r.smallest))
        .collect();
    out.set_item("ruled", ruled)?;
    let search_trace: Vec<_> = finding
        .search_trace
        .iter()
        .map(|step| {
            let tried: Vec<_> = step
                .tried
                .iter()
                .map(|(members, gain)| (members.iter().map(asked).collect::<Vec<_>>(), *gain))
                .collect();
            (tried, step.before, step.after)
        })
        .collect();
    out.set_item("ladder", search_trace)?;
    let [calibrated, amended] = &finding.in_trials;
    let plays = [
        ("calibrated", calibrated.as_slice()),
        ("amended", amended.as_slice()),
    ];
    out.set_item("trials", played(py, prepared, &plays)?)?;
    Ok(out)
}

/// The model as given, without the passive base.
fn rigid<const N: usize>(session: &Session<N>) -> Hypothesis<N> {
    let mut given = session.given();
    given.known.truncate(session.effects.len());
    given
}

/// What a model leaves of a trial: movement, whether it is a test, rate, residuals by channel, samples that count.
type LeftColumns = (usize, bool, f64, Option<Vec<Vec<f64>>>, Vec<bool>);
/// The gap of a channel: size, floor, its standard deviation, and trial, start, end and size where it is open.
type GapColumns = (
    Option<f64>,
    Option<f64>,
    Option<f64>,
    Option<(usize, f64, f64, f64)>,
);

/// The test of each channel's gap on the trials that were kept apart.
#[pyfunction]
pub fn held_out(py: Python<'_>, trials: Vec<LeftColumns>) -> Vec<GapColumns> {
    let trials: Vec<Left> = trials
        .into_iter()
        .map(|(group, test, rate, residuals, counted)| Left {
            group,
            test,
            rate,
            residuals,
            counted,
        })
        .collect();
    let gaps = py.detach(|| open_gaps(&trials));
    let open = |o: Open| (o.trial, o.span.0, o.span.1, o.size);
    gaps.into_iter()
        .map(|g| (g.size, g.floor, g.floor_std, g.open.map(open)))
        .collect()
}

fn named<'py, const N: usize>(
    py: Python<'py>,
    named: &Named,
    finding: &Finding<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let effect = &finding.amended.hypothesis.named[named.slot];
    out.set_item("effect", entry(effect))?;
    let sd: Vec<(usize, f64)> =
        std::iter::zip(&finding.precision.coordinates, &finding.precision.sd)
            .filter_map(|(c, sd)| match c.target {
                Target::Named(slot, p) if slot == named.slot => Some((p, *sd)),
                _ => None,
            })
            .collect();
    out.set_item("sd", sd)?;
    out.set_item("p_value", named.p_value)?;
    out.set_item("share", named.share)?;
    let alternatives: Vec<_> = named
        .alternatives
        .iter()
        .map(|a| {
            let fitted = (entry(&a.effect), a.candidate.free.clone());
            (fitted, a.worse, a.likeness)
        })
        .collect();
    out.set_item("alternatives", alternatives)?;
    Ok(out)
}

type Entry = (&'static str, usize, Vec<f64>);

fn entry(effect: &Effect<f64>) -> Entry {
    let info = effect.kind.info();
    let values = effect.parameters[..info.parameters.len()].to_vec();
    (info.kind, effect.index, values)
}

/// A candidate: its effect, and which of its parameters are free.
fn asked(candidate: &Candidate) -> (Entry, Vec<usize>) {
    (entry(&candidate.effect), candidate.free.clone())
}

fn fitted<'py, const N: usize>(
    py: Python<'py>,
    fitted: &Fitted<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let h = &fitted.hypothesis;
    let list = |effects: &[Effect<f64>]| effects.iter().map(entry).collect::<Vec<_>>();
    let out = PyDict::new(py);
    out.set_item("cost", fitted.cost)?;
    out.set_item("segments", h.segments.map(|s| s.to_vec()).to_vec())?;
    out.set_item("contact", h.contact)?;
    out.set_item("shift", h.shift)?;
    out.set_item("known", list(&h.known))?;
    out.set_item("calibration", list(&h.calibration))?;
    out.set_item("named", list(&h.named))?;
    Ok(out)
}

/// A nuisance: what it is, its value, its standard deviation before and after.
fn unknown<const N: usize>(
    hypothesis: &Hypothesis<N>,
    c: &Coordinate,
    sd: f64,
) -> Option<(&'static str, usize, usize, f64, f64, f64)> {
    let (what, index, part) = match c.target {
        Target::Segment(k, part) => (["mass", "com", "inertia"][part.min(2)], k, part),
        Target::Contact(part, axis) => (["compliance", "damping"][part.min(1)], 0, axis),
        Target::Shift(axis) => ("shift", 0, axis),
        Target::Placement(axis) => ("placement", 0, axis),
        Target::Eccentricity(j, part) => ("eccentricity", j, part),
        Target::Known(e, p) => ("known", e, p),
        Target::Calibration(e) => {
            let effect = &hypothesis.calibration[e];
            (effect.kind.info().kind, effect.index, 0)
        }
        Target::Named(..) => return None,
    };
    let before = c.prior.map_or(f64::INFINITY, |(_, sd)| sd);
    Some((what, index, part, hypothesis.get(c.target), before, sd))
}

fn set_table(out: &Bound<'_, PyDict>, name: &str, channels: Option<Channels>) -> PyResult<()> {
    let array = channels.map(|c| table(out.py(), &c)).transpose()?;
    out.set_item(name, array)
}

/// Channels as an array, `(n_samples, n_channels)`.
fn table<'py>(py: Python<'py>, channels: &[Vec<f64>]) -> PyResult<Bound<'py, PyAny>> {
    let count = channels.first().map_or(0, Vec::len);
    let values: Vec<f64> = (0..count)
        .flat_map(|i| channels.iter().map(move |c| c[i]))
        .collect();
    values
        .to_pyarray(py)
        .call_method1("reshape", (count, channels.len()))
}
