//! `Segment`, `Joint`, `Robot` and `Contact`.

use pyo3::prelude::*;

use super::class::{built, table, value_class, wraps};

type Any<'a, 'py> = &'a Bound<'py, PyAny>;

/// One rigid segment.
///
/// Parameters
/// ----------
/// name : str
/// length : float
///     Joint to joint, or joint to handle for the last [m].
/// mass : float
///     [kg]
/// com : float
///     Centre of mass along the segment from the proximal joint [m].
/// inertia : float
///     Moment of inertia about the centre of mass [kg m²].
/// com_normal : float, default 0
///     Centre of mass normal to the segment, counter-clockwise [m].
///
/// Raises
/// ------
/// BadInput
///     For a value out of bounds, with the bounds.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> forearm = armrs.Segment("forearm", length=0.264, mass=1.264, com=0.121, inertia=0.0074)
/// >>> forearm.replace(mass=1.3).mass
/// 1.3
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Segment(pub arm_model::Segment);

#[pymethods]
impl Segment {
    #[new]
    #[pyo3(
        signature = (name, length, mass, com, inertia, com_normal=None),
        text_signature = "(name, length, mass, com, inertia, com_normal=0.0)"
    )]
    fn new(
        name: Any<'_, '_>,
        length: Any<'_, '_>,
        mass: Any<'_, '_>,
        com: Any<'_, '_>,
        inertia: Any<'_, '_>,
        com_normal: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("name", Some(name)),
            ("length", Some(length)),
            ("mass", Some(mass)),
            ("com", Some(com)),
            ("inertia", Some(inertia)),
            ("com_normal", com_normal),
        ];
        built("", table(given))
    }
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }
    /// Joint to joint, or joint to handle for the last [m].
    #[getter]
    fn length(&self) -> f64 {
        self.0.length
    }
    /// [kg]
    #[getter]
    fn mass(&self) -> f64 {
        self.0.mass
    }
    /// Centre of mass along the segment from the proximal joint [m].
    #[getter]
    fn com(&self) -> f64 {
        self.0.com
    }
    /// Moment of inertia about the centre of mass [kg m²].
    #[getter]
    fn inertia(&self) -> f64 {
        self.0.inertia
    }
    /// Centre of mass normal to the segment, counter-clockwise [m].
    #[getter]
    fn com_normal(&self) -> f64 {
        self.0.com_normal
    }
}

value_class!(
    Segment,
    [
        ("name", ""),
        ("length", "m"),
        ("mass", "kg"),
        ("com", "m"),
        ("inertia", "kg m²"),
        ("com_normal", "m")
    ]
);

/// The passive properties of one joint that belong to the model itself; zero where there is none.
///
/// Parameters
/// ----------
/// name : str
/// stiffness : float, default 0
///     [N m/rad] about `rest`.
/// rest : float, default 0
///     Angle at which the elastic moment is zero [rad].
/// viscosity : float, default 0
///     [N m s/rad]
/// coulomb : float, default 0
///     Dry friction [N m].
///
/// Raises
/// ------
/// BadInput
///     For a value out of the bounds that the catalogue has for its effect.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> armrs.Joint("elbow", coulomb=0.16).coulomb
/// 0.16
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Joint(pub arm_model::Joint);

#[pymethods]
impl Joint {
    #[new]
    #[pyo3(
        signature = (name, stiffness=None, rest=None, viscosity=None, coulomb=None),
        text_signature = "(name, stiffness=0.0, rest=0.0, viscosity=0.0, coulomb=0.0)"
    )]
    fn new(
        name: Any<'_, '_>,
        stiffness: Option<Any<'_, '_>>,
        rest: Option<Any<'_, '_>>,
        viscosity: Option<Any<'_, '_>>,
        coulomb: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("name", Some(name)),
            ("stiffness", stiffness),
            ("rest", rest),
            ("viscosity", viscosity),
            ("coulomb", coulomb),
        ];
        built("", table(given))
    }
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }
    /// [N m/rad] about `rest`.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.0.stiffness
    }
    /// Angle at which the elastic moment is zero [rad].
    #[getter]
    fn rest(&self) -> f64 {
        self.0.rest
    }
    /// [N m s/rad]
    #[getter]
    fn viscosity(&self) -> f64 {
        self.0.viscosity
    }
    /// Dry friction [N m].
    #[getter]
    fn coulomb(&self) -> f64 {
        self.0.coulomb
    }
}

value_class!(
    Joint,
    [
        ("name", ""),
        ("stiffness", "N m/rad"),
        ("rest", "rad"),
        ("viscosity", "N m s/rad"),
        ("coulomb", "N m")
    ]
);

/// The robot that leads the arm: two links.
///
/// Parameters
/// ----------
/// lengths : (float, float)
///     [m]
/// base : (float, float)
///     First axis, y and z [m].
/// elbow : {"up", "down"}
///     Which of the two postures it takes.
///
/// Raises
/// ------
/// BadInput
///     For a value out of bounds, with the bounds.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> armrs.Robot((0.45, 0.45), (1.05, -0.1)).elbow
/// 'up'
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Robot(pub arm_model::Robot);

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (lengths, base, elbow=None), text_signature = "(lengths, base, elbow='up')")]
    fn new(lengths: Any<'_, '_>, base: Any<'_, '_>, elbow: Option<Any<'_, '_>>) -> PyResult<Self> {
        let given = [
            ("lengths", Some(lengths)),
            ("base", Some(base)),
            ("elbow", elbow),
        ];
        built("", table(given))
    }
    /// Lengths of the links [m].
    #[getter]
    fn lengths(&self) -> (f64, f64) {
        self.0.lengths.into()
    }
    /// First axis, y and z [m].
    #[getter]
    fn base(&self) -> (f64, f64) {
        self.0.base.into()
    }
    /// Which of the two postures it takes: "up" or "down".
    #[getter]
    fn elbow(&self) -> &'static str {
        self.0.elbow_name()
    }
}

value_class!(Robot, [("lengths", "m"), ("base", "m"), ("elbow", "")]);

/// The spring and damper between hand and robot.
///
/// Parameters
/// ----------
/// stiffness : (float, float)
///     Along y and z [N/m].
/// damping : (float, float), default (0, 0)
///     Along y and z [N s/m].
///
/// Raises
/// ------
/// BadInput
///     For a value out of bounds, with the bounds.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> armrs.Contact((1e4, 1e4), (25, 25)).damping
/// (25.0, 25.0)
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Contact(pub arm_model::Contact);

#[pymethods]
impl Contact {
    #[new]
    #[pyo3(signature = (stiffness, damping=None), text_signature = "(stiffness, damping=(0.0, 0.0))")]
    fn new(stiffness: Any<'_, '_>, damping: Option<Any<'_, '_>>) -> PyResult<Self> {
        let given = [("stiffness", Some(stiffness)), ("damping", damping)];
        built("", table(given))
    }
    /// Return the contact of the thesis, which is taken where a model states none.
    #[staticmethod]
    fn assumed() -> Self {
        Self(arm_model::Contact::ASSUMED)
    }
    /// Along y and z [N/m].
    #[getter]
    fn stiffness(&self) -> (f64, f64) {
        self.0.stiffness.into()
    }
    /// Along y and z [N s/m].
    #[getter]
    fn damping(&self) -> (f64, f64) {
        self.0.damping.into()
    }
}

value_class!(Contact, [("stiffness", "N/m"), ("damping", "N s/m")]);

wraps!(Segment, Joint, Robot, Contact);
