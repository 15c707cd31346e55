//! The result of the gap workflow.

use std::sync::Arc;

use arm_gap::results as core;
use arm_gap::results::{Evidence, Lack, Verdict, Version};
use pyo3::prelude::*;

use super::class::{Attribute, result_class};
use super::simulated::SimulatedTrial;
use crate::errors::{bad_input, refused};
use crate::model::{self, Wraps};
use crate::rig::Rig;

impl Attribute for Verdict {
    const ALLOWED: &'static str = "explained, nothing_missing or unexplained";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.name().to_owned().write(py)
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let name: String = given.extract()?;
        let mut all = Self::ALL.into_iter();
        all.find(|v| v.name() == name)
            .ok_or_else(|| bad_input("verdict", &name, Self::ALLOWED))
    }
}

impl Attribute for Lack {
    const ALLOWED: &'static str = "ratio and z";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.ratio, self.z).write(py)
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (ratio, z) = given.extract()?;
        Ok(Self { ratio, z })
    }
}

impl Attribute for [Lack; 2] {
    const ALLOWED: &'static str = "ratio and z of two models";
    fn write<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.to_vec().write(py)
    }
    fn read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let all = Vec::read(given)?;
        <Self>::try_from(all).map_err(|_| bad_input("lack", "something else", Self::ALLOWED))
    }
}

result_class! {
    /// What was fitted of a model, in the terms of the model.
    Fitted of core::Fitted, in "armrs.workflows.gap" {
        /// Relative changes of mass, centre of mass and inertia of each segment.
        segments: Vec<[f64; 3]>, "";
        /// Relative changes of compliance and of damping of the contact, y and z.
        contact: [[f64; 2]; 2], "";
        /// Shift of the robot's base, y and z [m].
        shift: [f64; 2], "m";
        /// Effects of the model, with what was refitted of them.
        known: Vec<arm_model::Effect>, "";
        /// Imperfections of the sensors.
        calibration: Vec<arm_model::Effect>, "";
        /// Effects that the model lacks.
        named: Vec<arm_model::Effect>, "";
    }
}

#[pymethods]
impl Fitted {
    /// Return a rig that shows what the fit shows: the model with everything that was fitted, the imperfections of its sensors and these rhythms
    /// included.
    fn rig(&self, model: &Bound<'_, PyAny>, rhythms: &Bound<'_, PyAny>) -> PyResult<Rig> {
        let model = model::one("model", model, |m: &model::Model| m.inner().clone())?;
        let rhythms = model::each("rhythms", rhythms, |e: &model::Effect| e.0)?;
        let (model, effects) = self.0.as_fitted(&model, &rhythms).map_err(refused)?;
        let effects = effects.iter().map(arm_model::Effect::core).collect();
        Rig::of(&model, effects)
    }
}

result_class! {
    /// What the gap workflow came to, without the data set.
    GapResult of core::GapResult, in "armrs.workflows.gap" {
        /// "explained", "nothing_missing" or "unexplained".
        verdict: Verdict, "";
        /// What the model lacks, that which explains most first.
        effects: Vec<core::Missing>, "";
        /// Where the calibrated model and the fit trials disagree, the clearest first.
        places: Vec<core::Place>, "";
        /// The gap of each channel on the test trials.
        gap: core::Named<core::ChannelGap>, "";
        /// What was tested and not named.
        would_have_seen: Vec<core::Limit>, "";
        /// Share of what the calibrated model left beyond noise that is still there.
        unexplained: f64, "";
        /// Shape of what is left, in words.
        looks_like: Option<String>, "";
        /// Small imperfections that were refitted.
        absorbed: Vec<core::Absorbed>, "";
        /// Lack of fit, ratio and z, of the calibrated and of the amended model; NaN without repeats.
        lack: [Lack; 2], "";
        /// Rounds of the search.
        search_trace: Vec<core::SearchStep>, "";
        /// Remarks on the data.
        warnings: Vec<String>, "";
        /// The model with the named effects, everything refitted.
        model: arm_model::Model, "";
        /// The calibrated model as it was fitted.
        calibrated: core::Fitted, "";
        /// The amended model as it was fitted.
        amended: core::Fitted, "";
        /// Rhythms that were set apart.
        rhythms: Vec<arm_model::Effect>, "";
        /// Number of rhythms with the same phase in every trial: the last effects of `model`.
        locked: usize, "";
        /// Misfit for each degree of freedom.
        scale: f64, "";
        /// Every trial, measured and simulated.
        trials: Vec<Arc<core::SimulatedTrial>>, "";
    }
}

#[pymethods]
impl GapResult {
    /// Return the amended model without rhythms, which are set apart from what is fitted.
    fn lasting(&self) -> PyResult<model::Model> {
        self.0.lasting().map(model::Model::wrap).map_err(refused)
    }
}

result_class! {
    /// Result of the first-order screening.
    Screening of core::Screening, in "armrs.workflows.gap" {
        /// Segments, contact and known effects refitted.
        model: arm_model::Model, "";
        /// Small imperfections that were refitted.
        absorbed: Vec<core::Absorbed>, "";
        /// The gap of each channel on the test trials; `after` is None.
        gap: core::Named<core::ChannelGap>, "";
        /// Lack of fit of the calibrated model, ratio and z; NaN without repeats.
        lack: Lack, "";
        /// Every effect that was tested, alone and to first order, the likeliest first.
        suspects: Vec<core::Suspect>, "";
    }
}

/// Return the verdict of a search.
///
/// Parameters
/// ----------
/// named : bool
///     Whether an effect was named.
/// is_open : bool
///     Whether a channel of the test trials is open.
/// z, ratio : float
///     Lack of fit on the fit trials: in standard deviations (NaN without repeats), and the ratio of the residual variance to that of repeats.
/// share : float
///     Share of the calibrated model's lack of fit that is left.
///
/// Returns
/// -------
/// {"explained", "nothing_missing", "unexplained"}
#[pyfunction]
#[pyo3(signature = (*, named, is_open, z, ratio, share))]
pub fn verdict_of(named: bool, is_open: bool, z: f64, ratio: f64, share: f64) -> &'static str {
    let evidence = Evidence {
        named,
        is_open,
        z,
        ratio,
        share,
    };
    Verdict::of(&evidence).name()
}

/// Return the names of the channels that are compared: angles and forces of a led arm, else joint torques.
#[pyfunction]
pub fn channel_names(joints: usize, led: bool) -> Vec<String> {
    core::channel_names(joints, led)
}

fn inner(trials: Vec<PyRef<'_, SimulatedTrial>>) -> Vec<Arc<core::SimulatedTrial>> {
    trials.iter().map(|t| Arc::clone(&t.0)).collect()
}

/// Return the root mean square of simulated less measured by channel, over the trials that a model can be simulated on; None without one.
#[pyfunction]
pub fn sizes(trials: Vec<PyRef<'_, SimulatedTrial>>, version: &str) -> PyResult<Vec<Option<f64>>> {
    let Some(version) = Version::named(version) else {
        return Err(bad_input(
            "version",
            version,
            "given, calibrated or amended",
        ));
    };
    Ok(core::sizes(&inner(trials), version))
}

/// Return the gap of a result on trials that played no part in it; floors are those of the result.
///
/// Parameters
/// ----------
/// given, calibrated, amended : list of SimulatedTrial
///     The trials with each model, shown as `given`.
/// known : GapResult
/// names : list of str
///     Of the channels.
#[pyfunction]
pub fn confirmed<'py>(
    py: Python<'py>,
    given: Vec<PyRef<'py, SimulatedTrial>>,
    calibrated: Vec<PyRef<'py, SimulatedTrial>>,
    amended: Vec<PyRef<'py, SimulatedTrial>>,
    known: &GapResult,
    names: Vec<String>,
) -> PyResult<Bound<'py, PyAny>> {
    let plays = [given, calibrated, amended].map(inner);
    core::confirmed(&plays, &known.0.gap, &names).write(py)
}

/// Adds classes and functions to the module.
pub fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Fitted>()?;
    m.add_class::<GapResult>()?;
    m.add_class::<Screening>()?;
    m.add("LACK_OF_FIT", core::LACK_OF_FIT)?;
    m.add("TIE", core::TIE)?;
    m.add("OPEN_GAP", core::OPEN_GAP)?;
    m.add("THRESHOLD", arm_gap::candidates::candidate::THRESHOLD)?;
    m.add_function(wrap_pyfunction!(verdict_of, m)?)?;
    m.add_function(wrap_pyfunction!(channel_names, m)?)?;
    m.add_function(wrap_pyfunction!(sizes, m)?)?;
    m.add_function(wrap_pyfunction!(confirmed, m)?)
}
