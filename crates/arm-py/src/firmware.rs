//! Input of `armrs export-c`: the unknowns of a model, its calibration, and torques as the C interface gives them.

use arm_core::effect::{ActsOn, Effect, Kind, MAX_STATES, Motion, applied};
use arm_core::{Calibration, Chain, Equation, Invalid, Measured, Real};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arm::AnyChain;
use crate::errors::{bad_input, invalid};
use crate::rig::Rig;
use crate::row_kernels::joints;

/// Most effects and unknowns of the C interface.
pub const EFFECTS: usize = 12;
pub const UNKNOWNS: usize = 18;
/// The equation of motion as the C interface holds it.
pub type DeviceEquation<T, const N: usize> = Equation<T, N, UNKNOWNS, EFFECTS>;

/// What a device needs of a model.
///
/// Parameters
/// ----------
/// rig : Rig
///     Of two or three segments.
/// uncertainty : float
///     Relative standard deviation of masses, centres of mass and inertias.
/// samples : list of list of float
///     Angles, speeds, accelerations, then force and moment on the arm at the tip [rad, N, N m].
///
/// Returns
/// -------
/// dict
///     `values` and `sd` of the unknowns in use, `torques` of the samples [N m], the calibration of the sensors, and what each
///     effect acts on: "joints", "arm" or "sensors".
#[pyfunction]
pub fn firmware<'py>(
    py: Python<'py>,
    rig: &Rig,
    uncertainty: f64,
    samples: Vec<Vec<f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    match &rig.arm.chain {
        AnyChain::Two(chain) => firmware_values(py, chain, &rig.effects, uncertainty, &samples),
        AnyChain::Three(chain) => firmware_values(py, chain, &rig.effects, uncertainty, &samples),
        _ => Err(too_long(rig)),
    }
}

/// The refusal of an arm that no device can hold.
pub fn too_long(rig: &Rig) -> PyErr {
    bad_input(
        "[[arm.segment]]",
        rig.arm.n_joints(),
        "2 or 3 segments for firmware",
    )
}

fn firmware_values<'py, const N: usize>(
    py: Python<'py>,
    chain: &Chain<f64, N>,
    effects: &[Effect<f64>],
    uncertainty: f64,
    samples: &[Vec<f64>],
) -> PyResult<Bound<'py, PyDict>> {
    let (equation, calibration) = device::<f64, N>(chain, effects)?;
    let priors = equation.priors(uncertainty);
    let used = priors.iter().take(equation.used());
    let result = PyDict::new(py);
    result.set_item("values", used.clone().map(|p| p.mean).collect::<Vec<_>>())?;
    result.set_item("sd", used.map(|p| p.sd).collect::<Vec<_>>())?;
    let torques = samples.iter().map(|s| torque(&equation, s));
    result.set_item("torques", torques.collect::<Vec<_>>())?;
    result.set_item("angle_offset", calibration.angle_offset.to_vec())?;
    result.set_item("force", calibration.force.map(|row| row.to_vec()).to_vec())?;
    result.set_item("force_offset", calibration.force_offset.to_vec())?;
    result.set_item("force_delay", calibration.force_delay)?;
    let acts = effects.iter().map(|e| match e.kind.acts_on() {
        ActsOn::Joints => "joints",
        ActsOn::Arm => "arm",
        _ => "sensors",
    });
    result.set_item("acts_on", acts.collect::<Vec<_>>())?;
    Ok(result)
}

/// The equation of motion that a device makes of an arm in its precision, with the places of the C interface, and the calibration of
/// the sensors.
pub fn device<T: Real, const N: usize>(
    chain: &Chain<f64, N>,
    effects: &[Effect<f64>],
) -> PyResult<(DeviceEquation<T, N>, Calibration<f64, N>)> {
    if let Some(own) = effects.iter().find(|e| matches!(e.kind, Kind::Custom(_))) {
        return Err(refused((
            0,
            Invalid::CannotAct {
                kind: own.kind.info().kind,
            },
        )));
    }
    let calibration = Calibration::of(chain, effects).map_err(refused)?;
    let sensed = |e: &Effect<f64>| e.kind.acts_on() == ActsOn::Sensors;
    let acting = effects.iter().filter(|e| !sensed(e));
    let acting: Vec<Effect<T>> = acting
        .map(|e| Effect {
            kind: e.kind,
            index: e.index,
            parameters: e.parameters.map(T::of),
            on: e.on,
        })
        .collect();
    let arm = applied(&chain.cast(), &acting).map_err(refused)?;
    if acting.len() > EFFECTS {
        return Err(bad_input(
            "[[effect]]",
            format!("{} effects of the arm", acting.len()),
            "at most 12 for firmware",
        ));
    }
    let mut kept = [off(); EFFECTS];
    for (place, effect) in kept.iter_mut().zip(&acting) {
        *place = *effect;
        place.on = effect.kind.acts_on() == ActsOn::Joints;
    }
    let equation = Equation::new(arm, kept).map_err(invalid)?;
    Ok((equation, calibration))
}

/// What follows for the equation of motion of a rig on a device of some precision.
macro_rules! with_equation {
    ($rig:expr, $single:expr, $equation:ident => $then:expr) => {
        match (&$rig.arm.chain, $single) {
            ($crate::arm::AnyChain::Two(chain), false) => with_equation!(@ chain, $rig, f64, $equation, $then),
            ($crate::arm::AnyChain::Three(chain), false) => with_equation!(@ chain, $rig, f64, $equation, $then),
            ($crate::arm::AnyChain::Two(chain), true) => with_equation!(@ chain, $rig, f32, $equation, $then),
            ($crate::arm::AnyChain::Three(chain), true) => with_equation!(@ chain, $rig, f32, $equation, $then),
            _ => Err($crate::firmware::too_long($rig)),
        }
    };
    (@ $chain:ident, $rig:expr, $real:ty, $equation:ident, $then:expr) => {{
        let ($equation, _) = $crate::firmware::device::<$real, _>($chain, &$rig.effects)?;
        $then
    }};
}
pub(crate) use with_equation;

fn off<T: Real>() -> Effect<T> {
    Effect {
        on: false,
        ..Effect::new(arm_core::effect::KINDS[0], 0)
    }
}

/// What `armrs_inverse_dynamics` gives.
fn torque<const N: usize>(equation: &DeviceEquation<f64, N>, sample: &[f64]) -> Vec<f64> {
    let at = |k: usize| joints::<f64, N>(&sample[k * N..(k + 1) * N]);
    let mut motion = Motion::new(0.0, at(0), at(1));
    motion.qdd = at(2);
    let [y, z, moment_on_arm] = [0, 1, 2].map(|k| sample[3 * N + k]);
    let load = Measured {
        force_on_arm: [y, z],
        moment_on_arm,
        ..Measured::none()
    };
    let found = equation.demanded(&motion, &[[0.0; MAX_STATES]; EFFECTS], &load);
    found.iter().copied().collect()
}

fn refused((_, why): (usize, Invalid)) -> PyErr {
    match why {
        Invalid::CannotAct { kind } => bad_input(
            &format!("[[effect]] ({kind})"),
            "an effect that a device cannot apply",
            "effects of the arm, and constant errors of its sensors",
        ),
        other => invalid(other),
    }
}
