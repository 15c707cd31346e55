//! Identification: trials in, estimates out.

use std::collections::BTreeSet;

use arm_core::effect::{Effect, Place};
use arm_core::{Chain, Joints};
use arm_ident::inference::joint_method::{MotionSource, Options};
use arm_ident::regression::trial::{Model, Role, Tolerance, Trial};
use arm_ident::results as core;
use arm_ident::results::{IdentificationInput, TrialName};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arm::{AnyChain, each_short_length};
use crate::arrays::rows;
use crate::errors::{bad_input, identification, invalid, refused};
use crate::model;
use crate::results::Identification;
use crate::rig::Rig;

/// The attributes of a Python `Trial` that the core reads: SI units, uniform samples, no gaps in the numbers.
#[derive(FromPyObject)]
pub struct Columns<'py> {
    pub file: String,
    role: String,
    /// Name of the movement.
    configuration: String,
    rate: f64,
    /// Time of each sample [s].
    t: PyReadonlyArray1<'py, f64>,
    q: PyReadonlyArray2<'py, f64>,
    dq: Option<PyReadonlyArray2<'py, f64>>,
    force_on_arm: Option<PyReadonlyArray2<'py, f64>>,
    moment_on_arm: Option<PyReadonlyArray1<'py, f64>>,
    tau: Option<PyReadonlyArray2<'py, f64>>,
    robot_q: Option<PyReadonlyArray2<'py, f64>>,
    base: Option<PyReadonlyArray2<'py, f64>>,
    activity: Option<PyReadonlyArray2<'py, f64>>,
    valid: PyReadonlyArray1<'py, bool>,
}

/// How to identify: the attributes of a Python `CoreSettings`.
#[derive(FromPyObject)]
pub struct IdentificationSettings {
    method: String,
    fitted: Vec<bool>,
    /// The model as given.
    model: Py<model::Model>,
    tolerance: Py<model::Tolerance>,
    cutoff: Option<f64>,
    motion: String,
    level: f64,
    threads: usize,
}

impl IdentificationSettings {
    /// What the calibration promises.
    pub fn tolerance(&self) -> Tolerance {
        *self.tolerance.get().inner()
    }

    /// Which effects of the rig are fitted.
    pub fn fitted(&self) -> impl Iterator<Item = bool> {
        self.fitted.iter().copied()
    }
}

impl Columns<'_> {
    /// Time of the last sample [s].
    pub fn end(&self) -> f64 {
        self.t.as_array().last().copied().unwrap_or(0.0)
    }
}

/// Trials as the core takes them, their movements numbered in the order of their names.
pub fn read_trials<const N: usize>(columns: &[Columns<'_>], rig: &Rig) -> PyResult<Vec<Trial<N>>> {
    let movements: BTreeSet<&str> = columns.iter().map(|c| c.configuration.as_str()).collect();
    let place = |c: &Columns<'_>| movements.range(..c.configuration.as_str()).count();
    columns.iter().map(|c| trial(c, place(c), rig)).collect()
}

fn trial<const N: usize>(c: &Columns<'_>, configuration: usize, rig: &Rig) -> PyResult<Trial<N>> {
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
    // Where no effect depends on it, the arm moves without it.
    let feels_activity = rig.effects.iter().any(|e| e.kind.feels_activity());
    let activity = c.activity.as_ref().filter(|_| feels_activity);
    let activity = activity.map(|a| rows("activity", a)).transpose()?;
    let trial = Trial {
        role: if c.role == "test" {
            Role::Test
        } else {
            Role::Fit
        },
        configuration,
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
        activity,
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
        ("activity", trial.activity.as_ref().map(Vec::len)),
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
    settings: &IdentificationSettings,
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
        let moved = setup.base_motion != [0.0; 2]
            || setup.displaced.is_somewhere()
            || setup.force_delay != 0.0;
        if moved {
            return Err(cannot_undo(effect));
        }
    }
    Ok(Model {
        chain: setup.chain().map_err(invalid)?,
        segment_uncertainty: settings.model.get().inner().segment_uncertainty,
        fitted,
        held,
        contact: setup.contact,
    })
}

/// Identifies by the joint method or the cascade; see `armrs.identify`.
#[pyfunction]
pub fn identify(
    py: Python<'_>,
    rig: &Rig,
    trials: Vec<Columns<'_>>,
    settings: IdentificationSettings,
) -> PyResult<Identification> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        input: (&[Columns<'_>], &IdentificationSettings),
    ) -> PyResult<Identification> {
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
            may_stick: true,
            tolerance: settings.tolerance(),
            level: settings.level,
            threads: settings.threads,
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
        let names = trials.iter().zip(columns).map(|(trial, c)| TrialName {
            role: trial.role,
            configuration: c.configuration.clone(),
        });
        let input = IdentificationInput {
            model: settings.model.get().inner(),
            effects: &rig.effects,
            trials: &names.collect::<Vec<_>>(),
            method: &settings.method,
            level: settings.level,
        };
        core::Identification::of(&result, &input)
            .map(Identification)
            .map_err(refused)
    }
    each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&trials, &settings)))
}
