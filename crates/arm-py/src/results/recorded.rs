//! `Recording` and `Readings`: the samples of a run, and the sensor readings of it.

use arm_sim::Readings as Read;
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy, PyTuple};

/// Values a sample as an array, `(n,)` or, of several a sample, `(n, width)`; `None` where there are none.
fn array(py: Python<'_>, values: Vec<f64>, width: Option<usize>) -> PyResult<Py<PyAny>> {
    if values.is_empty() {
        return Ok(py.None());
    }
    let count = values.len();
    let flat = values.into_pyarray(py);
    Ok(match width {
        None => flat.into_any().unbind(),
        Some(width) => flat.reshape([count / width, width])?.into_any().unbind(),
    })
}

fn reduced<'py>(
    of: &Bound<'py, PyAny>,
    names: &[&str],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    let values = names.iter().map(|name| {
        let item = of.getattr(*name)?;
        match item.is_instance_of::<PyMappingProxy>() {
            true => item.call_method0("copy"),
            false => Ok(item),
        }
    });
    let values = values.collect::<PyResult<Vec<_>>>()?;
    Ok((of.get_type().into_any(), PyTuple::new(of.py(), values)?))
}

/// What the sensors of a rig read of a run.
///
/// Parameters
/// ----------
/// time : ndarray, shape (n,)
///     Time [s].
/// q : ndarray, shape (n, n_joints)
///     Joint angles [rad].
/// force_on_arm : ndarray, shape (n, 2), or None
///     Force on the arm [N]; None of an arm that nothing holds.
/// moment_on_arm : ndarray, shape (n,), or None
///     Moment on the arm [N m].
/// robot_q : ndarray, shape (n, 2), or None
///     Angles of the robot [rad]; None without a robot.
/// tau : ndarray, shape (n, n_joints), or None
///     Torques of motors or brakes [N m]; None where there are none.
#[pyclass(frozen, get_all, module = "armrs.workflows.simulate")]
pub struct Readings {
    time: Py<PyAny>,
    q: Py<PyAny>,
    force_on_arm: Py<PyAny>,
    moment_on_arm: Py<PyAny>,
    robot_q: Py<PyAny>,
    tau: Py<PyAny>,
}

impl Readings {
    /// What sensors read, in Python.
    pub fn of<const N: usize>(py: Python<'_>, read: Read<N>) -> PyResult<Self> {
        Ok(Self {
            time: array(py, read.time, None)?,
            q: array(py, read.q, Some(N))?,
            force_on_arm: array(py, read.force_on_arm, Some(2))?,
            moment_on_arm: array(py, read.moment_on_arm, None)?,
            robot_q: array(py, read.robot_q, Some(2))?,
            tau: array(py, read.torque, Some(N))?,
        })
    }
}

#[pymethods]
impl Readings {
    #[new]
    fn new(
        time: PyReadonlyArray1<'_, f64>,
        q: Py<PyAny>,
        force_on_arm: Py<PyAny>,
        moment_on_arm: Py<PyAny>,
        robot_q: Py<PyAny>,
        tau: Py<PyAny>,
    ) -> Self {
        Self {
            time: (*time).clone().into_any().unbind(),
            q,
            force_on_arm,
            moment_on_arm,
            robot_q,
            tau,
        }
    }
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let samples = self.time.bind(py).len()?;
        Ok(format!("Readings({samples} samples)"))
    }
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        const NAMES: [&str; 6] = [
            "time",
            "q",
            "force_on_arm",
            "moment_on_arm",
            "robot_q",
            "tau",
        ];
        reduced(slf.as_any(), &NAMES)
    }
}

/// The samples of a run.
///
/// Parameters
/// ----------
/// columns : mapping of str to ndarray or None
///     Every recorded quantity, shape (n,) or (n, k), in SI units: `time`, `q`, `force_on_arm`, `torque.gravity`, …; None where there is none.
/// effects : sequence of (str, int)
///     Kind and joint, from 0, of each effect: the columns of `resisting`.
/// energy_error : ndarray, shape (n,)
///     Energy that is not accounted for since the start [J].
/// readings : sequence of Readings
///     What the sensors read, one for each seed.
#[pyclass(frozen, get_all, module = "armrs.workflows.simulate")]
pub struct Recording {
    columns: Py<PyMappingProxy>,
    effects: Vec<(String, usize)>,
    energy_error: Py<PyArray1<f64>>,
    readings: Py<PyTuple>,
}

impl Recording {
    /// The samples of a piece of a run, which are taken, and what was read of it.
    ///
    /// * `energy_error` - as of [`Piece::energy_error`]
    pub fn of<const N: usize>(
        py: Python<'_>,
        mut recording: arm_sim::Recording<N>,
        energy_error: Vec<f64>,
        readings: Vec<Readings>,
    ) -> PyResult<Self> {
        let columns = PyDict::new(py);
        for (name, width, values) in recording.columns_mut() {
            // Energies, works, time and the moment are numbers; everything else belongs to joints, axes or effects.
            let scalar = name == "time"
                || name == "moment_on_arm"
                || name.starts_with("energy")
                || name.starts_with("work");
            let values = array(py, std::mem::take(values), (!scalar).then_some(width))?;
            columns.set_item(name, values)?;
        }
        let effects = recording.effects.iter();
        let effects = effects.map(|(kind, index)| (kind.info().kind.to_owned(), *index));
        Ok(Self {
            columns: PyMappingProxy::new(py, columns.as_mapping()).unbind(),
            effects: effects.collect(),
            energy_error: energy_error.into_pyarray(py).unbind(),
            readings: PyTuple::new(py, readings)?.unbind(),
        })
    }
}

#[pymethods]
impl Recording {
    #[new]
    fn new(
        columns: &Bound<'_, PyDict>,
        effects: Vec<(String, usize)>,
        energy_error: Py<PyArray1<f64>>,
        readings: Py<PyTuple>,
    ) -> Self {
        Self {
            columns: PyMappingProxy::new(columns.py(), columns.as_mapping()).unbind(),
            effects,
            energy_error,
            readings,
        }
    }
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (samples, columns) = (
            self.energy_error.bind(py).len()?,
            self.columns.bind(py).len()?,
        );
        Ok(format!("Recording({samples} samples, {columns} columns)"))
    }
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let names = ["columns", "effects", "energy_error", "readings"];
        reduced(slf.as_any(), &names)
    }
}
