//! `Muscle`.

use pyo3::prelude::*;

use super::class::{built, table, value_class, wraps};

type Any<'a, 'py> = &'a Bound<'py, PyAny>;

/// A muscle, the channel with its activity, and the joint that it moves.
///
/// Parameters
/// ----------
/// channel : str
///     Name of its column, `emg_…`.
/// joint : int
///     Number of the joint, from 1.
/// mvc : float, optional
///     Envelope of a maximal voluntary contraction, in the unit of the channel; without it the largest of the session.
/// rest : float, optional
///     Envelope at rest, in the unit of the channel; without it the median of the session.
/// delay_s : float, default 0.05
///     By how much torque follows activity [s].
///
/// Raises
/// ------
/// BadInput
///     For a value out of bounds, with the bounds.
///
/// Examples
/// --------
/// >>> from armrs.model import Muscle
/// >>> Muscle("emg_biceps_uV", 2, mvc=850.0).delay_s
/// 0.05
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Muscle(pub arm_model::Muscle);

#[pymethods]
impl Muscle {
    #[new]
    #[pyo3(
        signature = (channel, joint, mvc=None, rest=None, delay_s=None),
        text_signature = "(channel, joint, mvc=None, rest=None, delay_s=0.05)"
    )]
    fn new(
        channel: Any<'_, '_>,
        joint: Any<'_, '_>,
        mvc: Option<Any<'_, '_>>,
        rest: Option<Any<'_, '_>>,
        delay_s: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("channel", Some(channel)),
            ("joint", Some(joint)),
            ("mvc", mvc),
            ("rest", rest),
            ("delay_s", delay_s),
        ];
        built("", table(given))
    }
    /// Name of its column.
    #[getter]
    fn channel(&self) -> &str {
        &self.0.channel
    }
    /// Number of the joint, from 1.
    #[getter]
    fn joint(&self) -> i64 {
        self.0.joint
    }
    /// Envelope of a maximal voluntary contraction, in the unit of the channel.
    #[getter]
    fn mvc(&self) -> Option<f64> {
        self.0.mvc
    }
    /// Envelope at rest, in the unit of the channel.
    #[getter]
    fn rest(&self) -> Option<f64> {
        self.0.rest
    }
    /// By how much torque follows activity [s].
    #[getter]
    fn delay_s(&self) -> f64 {
        self.0.delay
    }
}

value_class!(
    Muscle,
    [
        ("channel", ""),
        ("joint", ""),
        ("mvc", ""),
        ("rest", ""),
        ("delay_s", "s")
    ]
);

wraps!(Muscle);
