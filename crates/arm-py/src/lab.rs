//! The laboratory: the robot under its controller and supervisor, and what the literature expects of a subject.

use arm_core::Chain;
use arm_core::anthropometry::{Grip, PARTS, Sex, Subject};
use arm_sim::{Controlled, Controller, Fault, Safety};
use numpy::ToPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arm::{AnyChain, each_short_length};
use crate::errors::{bad_input, invalid, simulation};
use crate::rig::Rig;
use crate::sim::{Driven, Settings, experiment};

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

fn fault(kind: &str, joint: usize, size: (f64, f64)) -> PyResult<Fault> {
    if joint > 1 {
        return Err(bad_input("fault, joint", joint + 1, "1 or 2"));
    }
    match kind {
        "runaway" => Ok(Fault::Runaway(joint)),
        "frozen" => Ok(Fault::Frozen(joint)),
        "nan" => Ok(Fault::NotANumber(joint)),
        "late" => Ok(Fault::Late(size.0)),
        "force" => Ok(Fault::Pressed(size.into())),
        other => Err(bad_input(
            "fault, kind",
            other,
            "runaway, frozen, nan, late or force",
        )),
    }
}

/// Lets the robot's controller lead an arm, watched by the safety supervisor; see `armrs.record`.
#[pyfunction]
pub fn control<'py>(
    py: Python<'py>,
    rig: &Rig,
    drive: Driven<'py>,
    settings: Settings,
    watch: Watch,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<const N: usize>(
        py: Python<'_>,
        chain: &Chain<f64, N>,
        rig: &Rig,
        (drive, settings, watch): (&Driven<'_>, &Settings, &Watch),
    ) -> PyResult<Controlled> {
        let experiment = experiment(chain, rig, drive, settings)?;
        let controller = Controller {
            bandwidth: watch.bandwidth,
            damping: watch.damping,
            torque_limit: watch.torque_limit,
            ..Controller::default()
        };
        let safety = Safety {
            angle_margin: watch.angle_margin,
            speed: watch.speed,
            acceleration: watch.acceleration,
            force: watch.force,
        };
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
    let stop = done.stop.map(|s| {
        // The supervisor's clock starts at one second.
        let at = (s.at as f64 - 1e6) * 1e-6;
        (s.reason.name(), s.channel, s.value, s.limit, at)
    });
    out.set_item("stop", stop)?;
    Ok(out)
}

/// What the literature expects of the segments of an arm: name and (value, standard deviation) of each quantity, by segment.
///
/// Lengths [m] may be measured; the others are scaled with height.
#[pyfunction]
pub fn literature<'py>(
    py: Python<'py>,
    body_mass: f64,
    height: f64,
    sex: &str,
    lengths: Vec<Option<f64>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let sex = match sex {
        "male" => Sex::Male,
        "female" => Sex::Female,
        other => return Err(bad_input("sex", other, "male or female")),
    };
    let subject = Subject::new(body_mass, height, sex).map_err(invalid)?;
    PARTS
        .iter()
        .zip(["upper arm", "forearm", "hand"])
        .zip(lengths)
        .map(|((&part, name), length)| {
            let prior = subject
                .prior(part, length, Grip::Neutral)
                .map_err(invalid)?;
            let out = PyDict::new(py);
            out.set_item("name", name)?;
            out.set_item("length", prior.length)?;
            for (key, e) in [
                ("mass", prior.mass),
                ("com", prior.com),
                ("inertia", prior.inertia),
            ] {
                out.set_item(key, (e.value, e.sd))?;
            }
            Ok(out)
        })
        .collect()
}
