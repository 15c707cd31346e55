//! Identification: trials in, estimates out.

use arm_core::effect::{Effect, Place};
use arm_core::{Chain, Joints};
use arm_ident::inference::estimate::{Estimate, Explained, Identified, Quantity};
use arm_ident::inference::joint_method::{MotionSource, Options};
use arm_ident::regression::trial::{Model, Role, Tolerance, Trial};
use arm_ident::regression::unknown::Source;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arm::{AnyChain, each_short_length};
use crate::convert::rows;
use crate::errors::{bad_input, identification, invalid};
use crate::model;
use crate::rig::Rig;

/// One trial as Python hands it over: SI units, uniform samples, no gaps in the numbers.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Columns<'py> {
    role: String,
    configuration: usize,
    rate: f64,
    q: PyReadonlyArray2<'py, f64>,
    dq: Option<PyReadonlyArray2<'py, f64>>,
    force_on_arm: Option<PyReadonlyArray2<'py, f64>>,
    moment_on_arm: Option<PyReadonlyArray1<'py, f64>>,
    tau: Option<PyReadonlyArray2<'py, f64>>,
    robot_q: Option<PyReadonlyArray2<'py, f64>>,
    base: Option<PyReadonlyArray2<'py, f64>>,
    valid: PyReadonlyArray1<'py, bool>,
}

/// What the calibration promises, as the estimation takes it: in radians.
pub fn tolerance(of: &model::Tolerance) -> Tolerance {
    Tolerance {
        angle_offset: of.0.angle_offset(),
        force_bias: of.0.force_bias,
        force_gain: of.0.force_gain,
        time_delay: of.0.time_delay,
        handle_placement: of.0.handle_placement,
    }
}

/// How to identify.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    method: String,
    fitted: Vec<bool>,
    segment_uncertainty: f64,
    tolerance: Py<model::Tolerance>,
    cutoff: Option<f64>,
    motion: String,
    level: f64,
}

impl Settings {
    /// What the calibration promises.
    pub fn tolerance(&self) -> Tolerance {
        tolerance(self.tolerance.get())
    }
}

/// Trials as the core takes them.
pub fn read_trials<const N: usize>(columns: &[Columns<'_>], rig: &Rig) -> PyResult<Vec<Trial<N>>> {
    columns.iter().map(|c| trial(c, rig)).collect()
}

fn trial<const N: usize>(c: &Columns<'_>, rig: &Rig) -> PyResult<Trial<N>> {
    let joints = |name, a| {
        Ok::<_, PyErr>(
            rows::<N>(name, a)?
                .into_iter()
                .map(Joints::from)
                .collect::<Vec<_>>(),
        )
    };
    let handle = match (&c.robot_q, &rig.robot) {
        (Some(q), Some(robot)) => Some(
            rows::<2>("robot_q", q)?
                .into_iter()
                .map(|q| robot.handle(&q.into()))
                .collect(),
        ),
        _ => None,
    };
    let base = c.base.as_ref().map(|b| rows::<2>("base", b)).transpose()?;
    let trial = Trial {
        role: if c.role == "test" {
            Role::Test
        } else {
            Role::Fit
        },
        configuration: c.configuration,
        rate: c.rate,
        q: joints("q", &c.q)?,
        speed: c.dq.as_ref().map(|v| joints("dq", v)).transpose()?,
        force_on_arm: c
            .force_on_arm
            .as_ref()
            .map(|f| rows("force_on_arm", f))
            .transpose()?,
        moment_on_arm: c.moment_on_arm.as_ref().map(|m| m.as_array().to_vec()),
        torque: c.tau.as_ref().map(|t| joints("tau", t)).transpose()?,
        handle,
        base,
        valid: c.valid.as_array().to_vec(),
    };
    let n = trial.len();
    let lengths = [
        ("dq", trial.speed.as_ref().map(Vec::len)),
        ("force_on_arm", trial.force_on_arm.as_ref().map(Vec::len)),
        ("moment_on_arm", trial.moment_on_arm.as_ref().map(Vec::len)),
        ("tau", trial.torque.as_ref().map(Vec::len)),
        ("robot_q", trial.handle.as_ref().map(Vec::len)),
        ("base", trial.base.as_ref().map(Vec::len)),
        ("valid", Some(trial.valid.len())),
    ];
    for (name, found) in lengths {
        if found.is_some_and(|found| found != n) {
            return Err(bad_input(
                name,
                format!("{} samples", found.unwrap_or(0)),
                &format!("{n}, as many as q"),
            ));
        }
    }
    Ok(trial)
}

/// An effect that a simulation applies and an identification has no way to take out of measured data.
fn cannot_undo(effect: &Effect<f64>) -> PyErr {
    let allowed = "effects of joints, segments, hand, contact stiffness and gravity; take it out of the data and the model";
    bad_input("effects of the model", effect.kind.info().kind, allowed)
}

/// Splits the effects into those that are fitted and those that are held, and applies those that alter the rig.
pub fn model<const N: usize>(
    chain: &Chain<f64, N>,
    rig: &Rig,
    settings: &Settings,
) -> PyResult<Model<N>> {
    let mut setup = rig.setup(chain);
    let (mut fitted, mut held): (Vec<Effect<f64>>, Vec<Effect<f64>>) = (Vec::new(), Vec::new());
    for (effect, &fit) in rig.effects.iter().zip(&settings.fitted) {
        match effect.kind.info().place {
            Place::Joint if fit => fitted.push(*effect),
            Place::Joint => held.push(*effect),
            Place::AngleSensor | Place::ForceSensor | Place::Sensors => {
                return Err(cannot_undo(effect));
            }
            _ => effect.alter(&mut setup),
        }
        let moved =
            setup.base_motion != [0.0; 2] || setup.ripple != [0.0; 2] || setup.force_delay != 0.0;
        if moved {
            return Err(cannot_undo(effect));
        }
    }
    Ok(Model {
        chain: setup.chain().map_err(invalid)?,
        segment_uncertainty: settings.segment_uncertainty,
        fitted,
        held,
        contact: setup.contact,
    })
}

/// Identifies by the joint method or the cascade; see `armrs.identify`.
#[pyfunction]
pub fn identify<'py>(
    py: Python<'py>,
    rig: &Rig,
    trials: Vec<Columns<'py>>,
    settings: Settings,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, const N: usize>(
        py: Python<'py>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        input: (&[Columns<'py>], &Settings),
    ) -> PyResult<Bound<'py, PyDict>> {
        let (columns, settings) = input;
        let model = model(chain, rig, settings)?;
        let trials = read_trials::<N>(columns, rig)?;
        let options = Options {
            cutoff: settings.cutoff,
            motion: match settings.motion.as_str() {
                "auto" => MotionSource::Auto,
                "measured" => MotionSource::Measured,
                "simulated" => MotionSource::Simulated,
                other => return Err(bad_input("motion", other, "auto, measured or simulated")),
            },
            tolerance: settings.tolerance(),
            level: settings.level,
        };
        let cascade = arm_ident::cascade::Options {
            cutoff: settings.cutoff,
            tolerance: settings.tolerance(),
            level: settings.level,
            ..Default::default()
        };
        let result = match settings.method.as_str() {
            "joint" => py
                .detach(|| arm_ident::inference::joint_method::identify(&model, &trials, &options)),
            "cascade" => py.detach(|| arm_ident::cascade::identify(&model, &trials, &cascade)),
            other => return Err(bad_input("method", other, "joint or cascade")),
        }
        .map_err(identification)?;
        outcome(py, &result)
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&trials, &settings)))
}

fn outcome<'py, const N: usize>(
    py: Python<'py>,
    result: &Identified<N>,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("status", result.status.name())?;
    out.set_item("rank", result.rank)?;
    out.set_item("unknowns", result.unknowns)?;
    out.set_item("scale_free", result.scale_free)?;
    out.set_item("cutoff", result.cutoff)?;
    out.set_item("clusters", result.clusters)?;
    out.set_item("neglected_inertia", &result.neglected_inertia)?;
    out.set_item("speed_noise", &result.speed_noise)?;
    out.set_item(
        "speed_noise_allowed",
        arm_ident::regression::measured_motion::QUIET,
    )?;
    let not_simulated = result.not_simulated.as_ref();
    out.set_item("not_simulated", not_simulated.map(ToString::to_string))?;
    out.set_item("trades", &result.trades)?;
    for (name, list) in [
        ("parameters", &result.parameters),
        ("combinations", &result.combinations),
        ("calibration", &result.calibration),
    ] {
        let items = list
            .iter()
            .map(|e| estimate(py, e, &result.fitted))
            .collect::<PyResult<Vec<_>>>()?;
        out.set_item(name, PyList::new(py, items)?)?;
    }
    let explained = result
        .explained
        .iter()
        .map(|e| series(py, e))
        .collect::<PyResult<Vec<_>>>()?;
    out.set_item("explained", PyList::new(py, explained)?)?;
    let segments: Vec<_> = result
        .chain
        .segments()
        .iter()
        .map(|s| (s.length, s.mass, s.com[0], s.com[1], s.inertia))
        .collect();
    out.set_item("segments", segments)?;
    let effects: Vec<_> = result
        .fitted
        .iter()
        .map(|e| {
            let info = e.kind.info();
            (
                info.kind,
                e.index,
                e.parameters[..info.parameters.len()].to_vec(),
            )
        })
        .collect();
    out.set_item("effects", effects)?;
    Ok(out)
}

fn estimate<'py>(
    py: Python<'py>,
    e: &Estimate,
    fitted: &[Effect<f64>],
) -> PyResult<Bound<'py, PyDict>> {
    let own = e.name.as_str();
    let (name, kind) = match e.quantity {
        Quantity::Unknown(Source::Effect(i, p)) | Quantity::EffectParameter(i, p) => {
            let info = fitted[i].kind.info();
            (info.parameters[p].name, info.kind)
        }
        // "elastic1 stiffness*rest": the kind and the joint stand in fields of their own.
        Quantity::Unknown(Source::RestTorque(i, _)) => (
            own.split_once(' ').map_or(own, |(_, name)| name),
            fitted[i].kind.info().kind,
        ),
        Quantity::Unknown(Source::Calibration(_)) => (own, "calibration"),
        Quantity::Unknown(Source::Segment(..)) | Quantity::Segment => (own, "segment"),
        Quantity::Combination => (own, "combination"),
    };
    let out = PyDict::new(py);
    out.set_item("name", name)?;
    out.set_item("joint", e.joint.map(|j| j + 1))?;
    out.set_item("kind", kind)?;
    out.set_item("value", e.value)?;
    out.set_item("std", e.std)?;
    out.set_item("unit", e.unit.replace('·', " "))?;
    out.set_item("interval", e.interval)?;
    out.set_item("decided_by", e.decided_by.name())?;
    Ok(out)
}

fn series<'py, const N: usize>(py: Python<'py>, e: &Explained<N>) -> PyResult<Bound<'py, PyDict>> {
    let flat = |rows: &[Joints<f64, N>]| -> Vec<f64> {
        rows.iter().flat_map(|r| r.iter().copied()).collect()
    };
    let shape = |values: Vec<f64>| {
        values
            .to_pyarray(py)
            .call_method1("reshape", (e.samples.len(), N))
    };
    let out = PyDict::new(py);
    out.set_item("samples", e.samples.to_pyarray(py))?;
    out.set_item("measured", shape(flat(&e.measured))?)?;
    out.set_item("fitted", shape(flat(&e.fitted))?)?;
    Ok(out)
}
