//! The gap workflow: trials in, what the model lacks out.

use arm_core::Chain;
use arm_core::effect::Effect;
use arm_gap::candidate::Candidate;
use arm_gap::fit::Fitted;
use arm_gap::hypothesis::{Coordinate, Hypothesis, Target};
use arm_gap::misfit::Lack;
use arm_gap::search::{Finding, Named};
use arm_gap::session::{Session, Sight};
use arm_gap::study::Study;
use arm_ident::trial::Tolerance;
use numpy::ToPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arm::{AnyChain, each_short_length};
use crate::errors::{bad_input, gap};
use crate::ident::{Columns, read_trials};
use crate::rig::Rig;

/// What is known beforehand.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    segment_uncertainty: f64,
    angle_offset: f64,
    force_bias: f64,
    force_gain: f64,
    time_delay: f64,
    handle_placement: f64,
    /// Whether a robot's own path is compared through the closed chain; else joint torques are.
    led: bool,
    threads: usize,
}

/// The refusal of an arm that the search is not made for.
fn too_long() -> PyErr {
    bad_input("[[arm.segment]]", "more than 4", "1 to 4 segments")
}

fn session<const N: usize>(
    chain: &Chain<f64, N>,
    rig: &Rig,
    columns: &[Columns<'_>],
    settings: &Settings,
) -> PyResult<Session<N>> {
    Ok(Session {
        chain: *chain,
        contact: rig.contact,
        effects: rig.effects.clone(),
        segment_uncertainty: settings.segment_uncertainty,
        tolerance: Tolerance {
            angle_offset: settings.angle_offset,
            force_bias: settings.force_bias,
            force_gain: settings.force_gain,
            time_delay: settings.time_delay,
            handle_placement: settings.handle_placement,
        },
        trials: read_trials(columns, rig)?,
        sight: if settings.led {
            Sight::Led
        } else {
            Sight::Torque
        },
    })
}

/// What the model as given would show on every trial, beside what was measured; `None` where it cannot be simulated.
#[pyfunction]
pub fn play<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
) -> PyResult<Bound<'py, PyList>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (columns, settings): (&[Columns<'py>], &Settings),
    ) -> PyResult<Bound<'py, PyList>> {
        let session = session::<N>(chain, rig, columns, settings)?;
        session.check().map_err(gap)?;
        let given = session.given();
        let plays = (0..session.trials.len())
            .map(|i| {
                let played = py.detach(|| {
                    let course = session.course(i)?;
                    let run = session.run(&given, &course).ok();
                    let channels = run.and_then(|r| session.read_raw(&given, &course, &r).ok());
                    Ok((course.raw, channels))
                });
                let (measured, given) = played.map_err(gap)?;
                let Some(given) = given else {
                    return Ok(py.None().into_bound(py));
                };
                let one = PyDict::new(py);
                one.set_item("measured", table(py, &measured)?)?;
                one.set_item("given", table(py, &given)?)?;
                Ok(one.into_any())
            })
            .collect::<PyResult<Vec<_>>>()?;
        PyList::new(py, plays)
    }
    each_short_length!(&rig.arm.get().chain, c => run(py, c, rig, (&trials, &settings)), Err(too_long()))
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
        rig: &Rig,
        (columns, settings, progress): (&[Columns<'py>], &Settings, Option<&Py<PyAny>>),
    ) -> PyResult<Bound<'py, PyDict>> {
        let session = session::<N>(chain, rig, columns, settings)?;
        let tell = |what: &str, share: f64| {
            if let Some(callable) = progress {
                // What a display does with it is no reason to stop.
                let _ = Python::attach(|py| callable.call1(py, (what, share)).map(|_| ()));
            }
        };
        let (study, finding) = py
            .detach(|| {
                let mut study = Study::new(&session, settings.threads)?;
                let finding = study.search(&tell)?;
                Ok((study, finding))
            })
            .map_err(gap)?;
        result(py, &study, &finding)
    }
    each_short_length!(
        &rig.arm.get().chain,
        c => run(py, c, rig, (&trials, &settings, progress.as_ref())),
        Err(too_long())
    )
}

fn result<'py, const N: usize>(
    py: Python<'py>,
    study: &Study<'_, N>,
    finding: &Finding<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("repeated", study.repeated)?;
    out.set_item("groups", study.group_of.clone())?;
    out.set_item("scale", finding.scale)?;
    out.set_item("calibrated", fitted(py, &finding.calibrated)?)?;
    out.set_item("amended", fitted(py, &finding.amended)?)?;
    let lack = |l: &Lack| (l.ratio, l.z, l.excess);
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
    let apart: Vec<_> = finding
        .apart
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
    out.set_item("apart", apart)?;
    let ruled: Vec<_> = finding
        .ruled
        .iter()
        .map(|r| (asked(&r.candidate), r.gain, r.price, r.smallest))
        .collect();
    out.set_item("ruled", ruled)?;
    let ladder: Vec<_> = finding
        .ladder
        .iter()
        .map(|rung| {
            let tried: Vec<_> = rung
                .tried
                .iter()
                .map(|(members, gain)| (members.iter().map(asked).collect::<Vec<_>>(), *gain))
                .collect();
            (tried, rung.before, rung.after)
        })
        .collect();
    out.set_item("ladder", ladder)?;
    let given = study.session.given();
    let plays = [
        ("given", &given),
        ("calibrated", &finding.calibrated.hypothesis),
        ("amended", &finding.amended.hypothesis),
    ];
    let trials = (0..study.courses.len())
        .map(|i| {
            let one = PyDict::new(py);
            let course = &study.courses[i];
            one.set_item("measured", table(py, &course.raw)?)?;
            for (name, hypothesis) in plays {
                let played = py.detach(|| {
                    let run = study.session.run(hypothesis, course).ok()?;
                    study.session.read_raw(hypothesis, course, &run).ok()
                });
                match played {
                    Some(channels) => one.set_item(name, table(py, &channels)?)?,
                    None => one.set_item(name, py.None())?,
                }
            }
            Ok(one)
        })
        .collect::<PyResult<Vec<_>>>()?;
    out.set_item("trials", PyList::new(py, trials)?)?;
    Ok(out)
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
        .map(|a| (asked(&a.candidate), a.worse, a.likeness))
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
