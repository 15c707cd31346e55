//! `Model` and `load_model`.

use std::path::PathBuf;

use arm_model::{Bounds, Fields, Parts, Refused, Value};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyMapping, PyString, PyTuple};
use pyo3::{PyClass, PyTypeInfo};

use super::class::{self, Wraps, value_class};
use super::parameter::{AnyId, ParameterInfo};
use super::{Contact, Effect, Joint, Robot, Segment, value};
use crate::errors::refused;

/// An arm, what acts on it, and the rig that leads it.
///
/// Values are checked where they are made, so a `Model` that exists is valid, wherever it came from.
///
/// Parameters
/// ----------
/// segments : sequence of Segment
///     Proximal first.
/// joints : sequence of Joint
///     One a segment: `joints[j]` is at the proximal end of `segments[j]`.
/// gravity : float, default 9.81
///     Along −z [m/s²].
/// base : (float, float), default (0, 0)
///     First joint, y and z [m].
/// segment_uncertainty : float, default 0.05
///     Relative standard deviation of masses, centres of mass and inertias; 0 is exact.
/// robot : Robot, optional
/// contact : Contact, optional
/// effects : sequence of Effect
///     What acts besides the laws that the joints state.
/// joint_uncertainty : float, default 0
///     Relative standard deviation of the laws that the joints state; 0 is exact.
///
/// Raises
/// ------
/// BadInput
///     For a part of another class, and for parts that do not fit together.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> arm = armrs.Model([armrs.Segment("arm", 0.3, 1.5, 0.15, 0.012)], [armrs.Joint("elbow", coulomb=0.05)])
/// >>> arm.with_value("joint[1].coulomb.torque", 0.16).joints[0].coulomb
/// 0.16
#[pyclass(frozen, eq, hash, module = "armrs.model")]
pub struct Model {
    inner: arm_model::Model,
    segments: PyOnceLock<Py<PyTuple>>,
    joints: PyOnceLock<Py<PyTuple>>,
    effects: PyOnceLock<Py<PyTuple>>,
    all_effects: PyOnceLock<Py<PyTuple>>,
}

impl Model {
    /// The object of `arm-model`.
    pub fn inner(&self) -> &arm_model::Model {
        &self.inner
    }
}

impl Wraps for Model {
    type Inner = arm_model::Model;
    fn wrap(inner: arm_model::Model) -> Self {
        Self {
            inner,
            segments: PyOnceLock::new(),
            joints: PyOnceLock::new(),
            effects: PyOnceLock::new(),
            all_effects: PyOnceLock::new(),
        }
    }
    fn read(place: &str, value: Value) -> Result<arm_model::Model, Refused> {
        arm_model::Model::from_value(place, value)
    }
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(
        signature = (segments, joints, gravity=None, base=None, segment_uncertainty=None, robot=None, contact=None, effects=None, joint_uncertainty=None),
        text_signature = "(segments, joints, gravity=9.81, base=(0.0, 0.0), segment_uncertainty=0.05, robot=None, contact=None, effects=(), joint_uncertainty=0.0)"
    )]
    #[expect(
        clippy::too_many_arguments,
        reason = "keyword arguments of a Python constructor"
    )]
    fn new(
        segments: &Bound<'_, PyAny>,
        joints: &Bound<'_, PyAny>,
        gravity: Option<&Bound<'_, PyAny>>,
        base: Option<&Bound<'_, PyAny>>,
        segment_uncertainty: Option<&Bound<'_, PyAny>>,
        robot: Option<&Bound<'_, PyAny>>,
        contact: Option<&Bound<'_, PyAny>>,
        effects: Option<&Bound<'_, PyAny>>,
        joint_uncertainty: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let numbers = class::table([
            ("gravity", gravity),
            ("base", base),
            ("segment_uncertainty", segment_uncertainty),
            ("joint_uncertainty", joint_uncertainty),
        ]);
        let parts = Parts {
            segments: each("segments", segments, |s: &Segment| s.0.clone())?,
            joints: each("joints", joints, |j: &Joint| j.0.clone())?,
            robot: maybe("robot", robot, |r: &Robot| r.0)?,
            contact: maybe("contact", contact, |c: &Contact| c.0)?,
            effects: effects
                .map(|effects| each("effects", effects, |e: &Effect| e.0))
                .transpose()?
                .unwrap_or_default(),
            ..Parts::default()
        };
        Fields::new("[arm]", numbers)
            .and_then(|fields| parts.with_numbers(fields))
            .and_then(arm_model::Model::new)
            .map(Self::wrap)
            .map_err(refused)
    }

    /// Segments, proximal first.
    #[getter]
    fn segments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let items = self.inner.segments.iter().cloned().map(Segment);
        once(py, &self.segments, items)
    }
    /// Joints, one a segment.
    #[getter]
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let items = self.inner.joints.iter().cloned().map(Joint);
        once(py, &self.joints, items)
    }
    /// What acts besides the laws that the joints state.
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        once(
            py,
            &self.effects,
            self.inner.effects.iter().copied().map(Effect),
        )
    }
    /// Every effect: what the joints state, joint by joint, then `effects`.
    #[getter]
    fn all_effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let items = self.inner.all_effects();
        once(py, &self.all_effects, items.into_iter().map(Effect))
    }
    /// Along −z [m/s²].
    #[getter]
    fn gravity(&self) -> f64 {
        self.inner.gravity
    }
    /// First joint, y and z [m].
    #[getter]
    fn base(&self) -> (f64, f64) {
        self.inner.base.into()
    }
    /// Relative standard deviation of masses, centres of mass and inertias; 0 is exact.
    #[getter]
    fn segment_uncertainty(&self) -> f64 {
        self.inner.segment_uncertainty
    }
    /// Relative standard deviation of the laws that the joints state; 0 is exact.
    #[getter]
    fn joint_uncertainty(&self) -> f64 {
        self.inner.joint_uncertainty
    }
    /// The robot that leads the arm, if any.
    #[getter]
    fn robot(&self) -> Option<Robot> {
        self.inner.robot.map(Robot)
    }
    /// The spring and damper between hand and robot, if stated.
    #[getter]
    fn contact(&self) -> Option<Contact> {
        self.inner.contact.map(Contact)
    }
    /// Number of joints, and of segments.
    #[getter]
    fn n_joints(&self) -> usize {
        self.inner.n_joints()
    }
    /// What is hardly an arm, a line each.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.inner.warnings())
    }
    /// Every parameter with its value, bounds and unit.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let all = self.inner.parameters().into_iter().map(ParameterInfo);
        PyTuple::new(py, all.collect::<Vec<_>>())
    }

    /// Return the value of a parameter, or None for an object or effect that the model does not have.
    ///
    /// Parameters
    /// ----------
    /// parameter : ParameterId or str
    ///     Such as `joint[2].coulomb.torque`.
    ///
    /// Returns
    /// -------
    /// float or None
    ///     In the unit of the parameter.
    fn value(&self, parameter: AnyId<'_>) -> PyResult<Option<f64>> {
        Ok(self.inner.value(parameter.id()?))
    }

    /// Return the same model with one parameter changed. An effect that it does not have yet is added with its default values.
    ///
    /// Parameters
    /// ----------
    /// parameter : ParameterId or str
    ///     Such as `joint[2].coulomb.torque`.
    /// value : float
    ///     In the unit of the parameter.
    ///
    /// Raises
    /// ------
    /// BadInput
    ///     For an object that the model does not have, and a value out of bounds.
    fn with_value(&self, parameter: AnyId<'_>, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let value = Bounds::finite("").read("value", &value::read(value));
        let value = value.map_err(refused)?;
        let changed = self.inner.with(parameter.id()?, value);
        changed.map(Self::wrap).map_err(refused)
    }

    /// Return a model with a point mass on a segment.
    ///
    /// Parameters
    /// ----------
    /// number : int
    ///     The segment, from 1.
    /// mass : float
    ///     [kg]
    /// at : float, optional
    ///     From the segment's proximal joint [m]; at its end when absent. The centre of mass stays on the segment.
    #[pyo3(signature = (number, mass, at=None))]
    fn with_mass(
        &self,
        number: &Bound<'_, PyAny>,
        mass: &Bound<'_, PyAny>,
        at: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let segment = match value::read(number) {
            Value::Integer(k) if (1..=self.inner.n_joints() as i64).contains(&k) => k - 1,
            other => {
                let allowed = format!("a whole number 1 to {}", self.inner.n_joints());
                return Err(refused(Refused::new("number", other.shown(), allowed)));
            }
        };
        let kilograms = Bounds::finite("kg").above(0.0);
        let mass = kilograms
            .read("mass", &value::read(mass))
            .map_err(refused)?;
        let metres = |at| Bounds::finite("m").read("at", &value::read(at));
        let at = at.map(metres).transpose().map_err(refused)?;
        let heavier = self.inner.with_mass(segment as usize, mass, at);
        heavier.map(Self::wrap).map_err(refused)
    }

    /// Write `model.toml`; reading it back gives an equal model, to the last bit. The file is replaced at once or not at all.
    ///
    /// Parameters
    /// ----------
    /// path : path
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = path_of("path", path)?;
        let arguments = pyo3::types::PyDict::new(py);
        arguments.set_item("kind", ".toml")?;
        py.import("armrs.io.files")?.call_method(
            "write_text",
            (path, self.inner.to_toml()),
            Some(&arguments),
        )?;
        Ok(())
    }

    /// Return the text of `model.toml`.
    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    /// Return the model that the text of a `model.toml` describes.
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        let model = arm_model::Model::from_toml(text);
        model.map(Self::wrap).map_err(refused)
    }
}

value_class!(
    Model,
    [
        ("segments", ""),
        ("joints", ""),
        ("gravity", "m/s²"),
        ("base", "m"),
        ("segment_uncertainty", ""),
        ("robot", ""),
        ("contact", ""),
        ("effects", ""),
        ("joint_uncertainty", "")
    ]
);

/// Read `model.toml`.
///
/// Parameters
/// ----------
/// path : path
///     The file.
///
/// Returns
/// -------
/// Model
///
/// Raises
/// ------
/// BadInput
///     Names the file, the key, the value found and the value allowed. A key that is not known is refused with the nearest
///     known one.
#[pyfunction]
pub fn load_model(path: &Bound<'_, PyAny>) -> PyResult<Model> {
    let path = path_of("path", path)?;
    let model = arm_model::Model::load(&path);
    model.map(Model::wrap).map_err(refused)
}

/// The path that an argument is.
pub(super) fn path_of(place: &str, given: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let text = given.is_instance_of::<PyString>();
    let named = !given.is_instance_of::<PyBytes>()
        && given.get_type().hasattr("__fspath__")?
        && given
            .call_method0("__fspath__")?
            .is_instance_of::<PyString>();
    if !text && !named {
        let refusal = Refused::new(place, value::read(given).shown(), "a path");
        return Err(refused(refusal));
    }
    given.extract()
}

/// The objects of one class in a sequence.
pub fn each<C, T>(
    place: &str,
    given: &Bound<'_, PyAny>,
    inner: impl Fn(&C) -> T,
) -> PyResult<Vec<T>>
where
    C: PyClass<Frozen = pyo3::pyclass::boolean_struct::True> + PyTypeInfo + Sync,
{
    let name = C::type_object(given.py()).name()?.to_string();
    let sequence = || {
        let allowed = format!("a sequence of {name}");
        refused(Refused::new(place, value::read(given).shown(), allowed))
    };
    if given.is_instance_of::<PyString>()
        || given.is_instance_of::<PyBytes>()
        || given.cast::<PyMapping>().is_ok()
    {
        return Err(sequence());
    }
    let items = given.try_iter().map_err(|_| sequence())?;
    (0..)
        .zip(items)
        .map(|(k, item)| {
            let item = item?;
            one(&format!("{place}[{k}]"), &item, &inner)
        })
        .collect()
}

/// An object of one class.
pub fn one<C, T>(place: &str, given: &Bound<'_, PyAny>, inner: impl Fn(&C) -> T) -> PyResult<T>
where
    C: PyClass<Frozen = pyo3::pyclass::boolean_struct::True> + PyTypeInfo + Sync,
{
    match given.cast::<C>() {
        Ok(item) => Ok(inner(item.get())),
        Err(_) => {
            let name = C::type_object(given.py()).name()?.to_string();
            let article = if name.starts_with(['A', 'E', 'I', 'O', 'U']) {
                "an"
            } else {
                "a"
            };
            let allowed = format!("{article} {name}");
            Err(refused(Refused::new(
                place,
                value::read(given).shown(),
                allowed,
            )))
        }
    }
}

/// An object of one class, or None.
fn maybe<C, T>(
    place: &str,
    given: Option<&Bound<'_, PyAny>>,
    inner: impl Fn(&C) -> T,
) -> PyResult<Option<T>>
where
    C: PyClass<Frozen = pyo3::pyclass::boolean_struct::True> + PyTypeInfo + Sync,
{
    given.map(|given| one(place, given, inner)).transpose()
}

/// A tuple of objects that is made at the first use, so that each is the same object ever after.
fn once<'py, C: PyClass + Into<pyo3::PyClassInitializer<C>>>(
    py: Python<'py>,
    place: &PyOnceLock<Py<PyTuple>>,
    items: impl Iterator<Item = C>,
) -> PyResult<Bound<'py, PyTuple>> {
    let tuple = place.get_or_try_init(py, || {
        let items = items.map(|item| Py::new(py, item));
        let items: Vec<Py<C>> = items.collect::<PyResult<_>>()?;
        Ok::<_, PyErr>(PyTuple::new(py, items)?.unbind())
    })?;
    Ok(tuple.bind(py).clone())
}
