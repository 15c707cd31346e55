//! The laboratory: the robot under its controllers and supervisor.

use arm_core::{Chain, Joints};
use arm_sim::{
    Controlled, Controller, InjectedFault, Interaction, InteractionLaw, Safety, Support, Yielded,
};
use numpy::{PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arm::{AnyChain, each_short_length};
use crate::arrays::by_rows;
use crate::errors::{bad_input, simulation};
use crate::online::{GravityCompensator, OnlineCompensation};
use crate::rig::Rig;
use crate::row_kernels::joints;
use crate::simulation::{Driven, RunSettings, experiment};

/// The robot's controller and what the supervisor allows.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Watch {
    bandwidth: f64,
    damping: f64,
    torque_limit: f64,
    angle_margin: f64,
    speed: f64,
    acceleration: f64,
    force: f64,
    /// Time [s], kind, joint, and size ([s] or [N] in y and z) of what goes wrong on purpose.
    fault: Option<(f64, String, usize, (f64, f64))>,
    seed: u64,
}

impl Watch {
    fn settings(&self) -> (Controller, Safety) {
        let controller = Controller {
            bandwidth: self.bandwidth,
            damping: self.damping,
            torque_limit: self.torque_limit,
            ..Controller::default()
        };
        let safety = Safety {
            angle_margin: self.angle_margin,
            speed: self.speed,
            acceleration: self.acceleration,
            force: self.force,
        };
        (controller, safety)
    }
}

/// What the handle behaves like.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Yielding {
    law: String,
    stiffness: f64,
    handle_damping: f64,
    mass: f64,
    link_masses: [f64; 2],
    /// Time at rest after the movement [s].
    hold: f64,
}

impl Yielding {
    fn core(&self) -> PyResult<Interaction> {
        let law = match self.law.as_str() {
            "impedance" => InteractionLaw::Impedance,
            "admittance" => InteractionLaw::Admittance,
            other => return Err(bad_input("law", other, "impedance or admittance")),
        };
        Ok(Interaction {
            law,
            stiffness: self.stiffness,
            damping: self.handle_damping,
            mass: self.mass,
            link_masses: self.link_masses,
        })
    }
}

fn fault(kind: &str, joint: usize, size: (f64, f64)) -> PyResult<InjectedFault> {
    if joint > 1 {
        return Err(bad_input("fault, joint", joint + 1, "1 or 2"));
    }
    match kind {
        "runaway" => Ok(InjectedFault::Runaway(joint)),
        "frozen" => Ok(InjectedFault::Frozen(joint)),
        "nan" => Ok(InjectedFault::NotANumber(joint)),
        "late" => Ok(InjectedFault::Late(size.0)),
        "force" => Ok(InjectedFault::Pressed(size.into())),
        other => Err(bad_input(
            "fault, kind",
            other,
            "runaway, frozen, nan, late or force",
        )),
    }
}

/// The robot's controller leads an arm, monitored by the safety supervisor; see `armrs.record`.
#[pyfunction]
pub fn control<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    watch: Watch,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, watch): (&Driven<'_>, &RunSettings, &Watch),
    ) -> PyResult<Controlled> {
        let experiment = experiment(chain, rig, drive, settings)?;
        let (controller, safety) = watch.settings();
        let fault = watch
            .fault
            .as_ref()
            .map(|(at, kind, joint, size)| Ok::<_, PyErr>((*at, fault(kind, *joint, *size)?)))
            .transpose()?;
        let settings = (&controller, &safety);
        py.detach(|| arm_sim::control(&experiment, settings, fault, watch.seed))
            .map_err(simulation)
    }
    let done =
        each_short_length!(&rig.arm.chain, c => run(py, c, rig, (&drive, &settings, &watch)))?;
    let out = PyDict::new(py);
    out.set_item("time", done.time.to_pyarray(py))?;
    let angles = done.robot_q.to_pyarray(py);
    out.set_item("robot_q", angles.call_method1("reshape", (-1, 2))?)?;
    out.set_item("tracking_error", done.tracking_error)?;
    out.set_item("periods_to_stop", done.periods_to_stop)?;
    out.set_item("force_after_fault", done.force_after_fault)?;
    out.set_item("way_after_stop", done.way_after_stop)?;
    out.set_item("stop", done.stop.as_ref().map(stopped))?;
    Ok(out)
}

/// Reason, channel, value, limit and time [s] of a stop.
fn stopped(s: &arm_core::monitor::Stop<f64>) -> (&'static str, Option<usize>, f64, f64, f64) {
    // The supervisor's clock starts at one second.
    let at = (s.at as f64 - 1e6) * 1e-6;
    (s.reason.name(), s.channel, s.value, s.limit, at)
}

/// A compliant robot leads an arm that motors in its joints may carry; see `armrs.record`.
///
/// Parameters
/// ----------
/// perturbation : ndarray, shape (n, 2)
///     Force at the handle, by control periods, again and again [N]; no rows for none.
/// support : tuple, optional
///     What carries the arm, the share of its torque, and the largest torque [N m].
#[pyfunction]
pub fn interact<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: RunSettings,
    device: (Watch, Yielding),
    perturbation: PyReadonlyArray2<'py, f64>,
    support: Option<(Bound<'py, OnlineCompensation>, f64, f64)>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, watch, yielding): (&Driven<'_>, &RunSettings, &Watch, &Yielding),
        pushed: &[f64],
        support: Option<(&(dyn GravityCompensator + Sync), f64, f64)>,
    ) -> PyResult<Yielded> {
        let mut experiment = experiment(chain, rig, drive, settings)?;
        experiment.duration += yielding.hold;
        if let Some(other) = support.map(|s| s.0.joints()).filter(|&n| n != N) {
            return Err(bad_input(
                "support",
                format!("{other} joints"),
                &format!("{N}"),
            ));
        }
        let (controller, safety) = watch.settings();
        let interaction = yielding.core()?;
        let device = (&controller, &interaction, &safety);
        let limit = support.map_or(1.0, |(_, _, limit)| limit);
        py.detach(|| {
            let mut carry = |time: f64, q: &Joints<f64, N>| {
                let (arm, share, _) = support?;
                let (torque, _) = arm.carry(time, q.as_slice(), &[0.0; N])?;
                Some(joints::<f64, N>(&torque) * share)
            };
            let carry: Option<Support<'_, N>> = support.is_some().then_some(&mut carry);
            arm_sim::interact(&experiment, device, pushed, (carry, limit), watch.seed)
        })
        .map_err(simulation)
    }
    let given = (&drive, &settings, &device.0, &device.1);
    let pushed = by_rows(&perturbation);
    let support = support
        .as_ref()
        .map(|(arm, share, limit)| (&*arm.get().inner, *share, *limit));
    let done = each_short_length!(&rig.arm.chain, c => run(py, c, rig, given, &pushed, support))?;
    crate::custom_effects::failed()?;
    let out = PyDict::new(py);
    out.set_item("time", done.time.to_pyarray(py))?;
    let rows = done.time.len();
    for (name, values) in [
        ("robot_q", &done.robot_q),
        ("q", &done.q),
        ("qd", &done.qd),
        ("force_on_arm", &done.force_on_arm),
        ("support", &done.support),
    ] {
        let shape = (rows, values.len() / rows);
        out.set_item(name, values.to_pyarray(py).call_method1("reshape", shape)?)?;
    }
    out.set_item("tracking_error", done.tracking_error)?;
    out.set_item("stop", done.stop.as_ref().map(stopped))?;
    Ok(out)
}
