//! `Tolerance`, `Subject`, `AddedMass`, `TrialEntry` and `Description`.

use std::path::PathBuf;

use arm_model::{Refused, Table, Value};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::class::{built, table, value_class, wraps};
use super::muscle::Muscle;
use super::whole::{each, one, path_of};
use crate::errors::refused;

type Any<'a, 'py> = &'a Bound<'py, PyAny>;

/// What the calibration promises, each as one standard deviation. Smaller deviations are absorbed and reported, larger ones are
/// named.
///
/// Parameters
/// ----------
/// angle_offset_deg : float, default 0.3
///     Offset of an angle sensor [deg]; `angle_offset` is the same in radians.
/// force_bias_N : float, default 0.2
///     [N]
/// force_gain : float, default 0.01
///     Relative.
/// time_delay_s : float, default 0.005
///     Force against angles [s].
/// handle_placement_m : float, default 0.001
///     [m]
///
/// Raises
/// ------
/// BadInput
///     For a value that is negative or beyond what any calibration promises.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> armrs.Tolerance(force_bias_N=0.4).force_gain
/// 0.01
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Tolerance(pub arm_model::Tolerance);

#[pymethods]
impl Tolerance {
    #[new]
    #[pyo3(
        signature = (angle_offset_deg=None, force_bias_N=None, force_gain=None, time_delay_s=None, handle_placement_m=None),
        text_signature = "(angle_offset_deg=0.3, force_bias_N=0.2, force_gain=0.01, time_delay_s=0.005, handle_placement_m=0.001)"
    )]
    #[expect(non_snake_case, reason = "the unit stands in the name")]
    fn new(
        angle_offset_deg: Option<Any<'_, '_>>,
        force_bias_N: Option<Any<'_, '_>>,
        force_gain: Option<Any<'_, '_>>,
        time_delay_s: Option<Any<'_, '_>>,
        handle_placement_m: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("angle_offset_deg", angle_offset_deg),
            ("force_bias_N", force_bias_N),
            ("force_gain", force_gain),
            ("time_delay_s", time_delay_s),
            ("handle_placement_m", handle_placement_m),
        ];
        built("", table(given))
    }
    /// Offset of an angle sensor [deg].
    #[getter]
    fn angle_offset_deg(&self) -> f64 {
        self.0.angle_offset_deg
    }
    /// Offset of an angle sensor [rad].
    #[getter]
    fn angle_offset(&self) -> f64 {
        self.0.angle_offset()
    }
    /// Bias of a force channel [N].
    #[getter(force_bias_N)]
    fn force_bias(&self) -> f64 {
        self.0.force_bias
    }
    /// Relative error of the force sensor's gain.
    #[getter]
    fn force_gain(&self) -> f64 {
        self.0.force_gain
    }
    /// Delay of force against angles [s].
    #[getter]
    fn time_delay_s(&self) -> f64 {
        self.0.time_delay
    }
    /// Where the hand holds the handle [m].
    #[getter]
    fn handle_placement_m(&self) -> f64 {
        self.0.handle_placement
    }
}

value_class!(
    Tolerance,
    [
        ("angle_offset_deg", "°"),
        ("force_bias_N", "N"),
        ("force_gain", ""),
        ("time_delay_s", "s"),
        ("handle_placement_m", "m")
    ]
);

/// Whose arm it is. Body mass, height and sex are used for the literature values, name and side for a history.
///
/// Parameters
/// ----------
/// body_mass : float, optional
///     [kg]
/// height : float, optional
///     [m]
/// sex : {"male", "female"}, optional
/// name : str, optional
/// side : {"left", "right"}, optional
///     Which arm was measured.
/// lengths_m : sequence of float, optional
///     Measured lengths of the segments, the last one to the handle [m]; without them they are scaled with height.
///
/// Raises
/// ------
/// BadInput
///     For a value that is no person's.
///
/// Examples
/// --------
/// >>> import armrs
/// >>> armrs.Subject(body_mass=77, height=1.8, sex="male").body_mass
/// 77.0
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Subject(pub arm_model::Subject);

#[pymethods]
impl Subject {
    #[new]
    #[pyo3(signature = (body_mass=None, height=None, sex=None, name=None, side=None, lengths_m=None))]
    fn new(
        body_mass: Option<Any<'_, '_>>,
        height: Option<Any<'_, '_>>,
        sex: Option<Any<'_, '_>>,
        name: Option<Any<'_, '_>>,
        side: Option<Any<'_, '_>>,
        lengths_m: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("body_mass", body_mass),
            ("height", height),
            ("sex", sex),
            ("name", name),
            ("side", side),
            ("lengths_m", lengths_m),
        ];
        built("", table(given))
    }
    /// [kg]
    #[getter]
    fn body_mass(&self) -> Option<f64> {
        self.0.body_mass
    }
    /// [m]
    #[getter]
    fn height(&self) -> Option<f64> {
        self.0.height
    }
    /// "male" or "female".
    #[getter]
    fn sex(&self) -> Option<&'static str> {
        self.0.sex.map(arm_model::Sex::name)
    }
    /// By which sessions of one person are found again.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }
    /// Which arm was measured: "left" or "right".
    #[getter]
    fn side(&self) -> Option<&'static str> {
        self.0.side.map(arm_model::Side::name)
    }
    /// Measured lengths of the segments [m]; None where they are scaled with height.
    #[getter]
    fn lengths_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        let known = Some(&self.0.lengths).filter(|lengths| !lengths.is_empty());
        known.map(|lengths| PyTuple::new(py, lengths)).transpose()
    }
}

value_class!(
    Subject,
    [
        ("body_mass", "kg"),
        ("height", "m"),
        ("sex", ""),
        ("name", ""),
        ("side", ""),
        ("lengths_m", "m")
    ]
);

/// A mass that is fixed to a segment in some configurations, such as one part of an orthosis.
///
/// Parameters
/// ----------
/// segment : int
///     Number of the segment, from 1.
/// mass : float
///     [kg]
/// at : float
///     From the segment's proximal joint [m].
/// configurations : sequence of str
///     Where it is worn.
///
/// Raises
/// ------
/// BadInput
///     For a value out of bounds, with the bounds.
///
/// Examples
/// --------
/// >>> from armrs.model import AddedMass
/// >>> AddedMass(2, 0.2, 0.1, ("slow",)).configurations
/// ('slow',)
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct AddedMass(pub arm_model::AddedMass);

#[pymethods]
impl AddedMass {
    #[new]
    #[pyo3(signature = (segment, mass, at, configurations=None), text_signature = "(segment, mass, at, configurations=())")]
    fn new(
        segment: Any<'_, '_>,
        mass: Any<'_, '_>,
        at: Any<'_, '_>,
        configurations: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let given = [
            ("segment", Some(segment)),
            ("mass", Some(mass)),
            ("at", Some(at)),
            ("configurations", configurations),
        ];
        built("", table(given))
    }
    /// Number of the segment, from 1.
    #[getter]
    fn segment(&self) -> i64 {
        self.0.segment
    }
    /// [kg]
    #[getter]
    fn mass(&self) -> f64 {
        self.0.mass
    }
    /// From the segment's proximal joint [m].
    #[getter]
    fn at(&self) -> f64 {
        self.0.at
    }
    /// Where it is worn.
    #[getter]
    fn configurations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.0.configurations)
    }
}

value_class!(
    AddedMass,
    [
        ("segment", ""),
        ("mass", "kg"),
        ("at", "m"),
        ("configurations", "")
    ]
);

/// One trial in `dataset.toml`.
///
/// Parameters
/// ----------
/// file : str
///     Below the folder of the data set.
/// configuration : str
///     The name of the movement, shared by its repeats.
/// repeat : int
///     From 1.
/// role : {"fit", "test"}
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct TrialEntry(pub arm_model::TrialEntry);

#[pymethods]
impl TrialEntry {
    #[new]
    fn new(
        file: Any<'_, '_>,
        configuration: Any<'_, '_>,
        repeat: Any<'_, '_>,
        role: Any<'_, '_>,
    ) -> PyResult<Self> {
        let given = [
            ("file", Some(file)),
            ("configuration", Some(configuration)),
            ("repeat", Some(repeat)),
            ("role", Some(role)),
        ];
        built("", table(given))
    }
    /// Below the folder of the data set.
    #[getter]
    fn file(&self) -> &str {
        &self.0.file
    }
    /// The name of the movement, shared by its repeats.
    #[getter]
    fn configuration(&self) -> &str {
        &self.0.configuration
    }
    /// From 1.
    #[getter]
    fn repeat(&self) -> i64 {
        self.0.repeat
    }
    /// "fit" or "test".
    #[getter]
    fn role(&self) -> &'static str {
        self.0.role.name()
    }
}

value_class!(
    TrialEntry,
    [
        ("file", ""),
        ("configuration", ""),
        ("repeat", ""),
        ("role", "")
    ]
);

/// The content of `dataset.toml`, before any trial is read.
///
/// Parameters
/// ----------
/// name : str
/// model : str or None
///     The file of the model, below the folder of the data set; None for that of the subject by the literature.
/// trials : sequence of TrialEntry
/// force_on : {"robot", "arm"}, optional
///     What the forces act on.
/// sample_rate : float, optional
///     As stated [Hz].
/// subject : Subject
/// tolerance : Tolerance
/// synthetic : bool
///     Whether the trials were simulated.
/// added : sequence of AddedMass
///     Masses that are worn in some configurations besides the model.
/// muscles : sequence of Muscle
///     Muscles whose activity is recorded.
///
/// Raises
/// ------
/// BadInput
///     For trials without one to fit, or with a file or repeat twice.
#[pyclass(frozen, eq, hash, module = "armrs.model")]
#[derive(Clone)]
pub struct Description(pub arm_model::Description);

#[pymethods]
impl Description {
    #[new]
    #[pyo3(
        signature = (name, model, trials, force_on=None, sample_rate=None, subject=None, tolerance=None, synthetic=None, added=None, muscles=None),
        text_signature = "(name, model, trials, force_on=None, sample_rate=None, subject=Subject(), tolerance=Tolerance(), synthetic=False, added=(), muscles=())"
    )]
    #[expect(
        clippy::too_many_arguments,
        reason = "keyword arguments of a Python constructor"
    )]
    fn new(
        name: Any<'_, '_>,
        model: Any<'_, '_>,
        trials: Any<'_, '_>,
        force_on: Option<Any<'_, '_>>,
        sample_rate: Option<Any<'_, '_>>,
        subject: Option<Any<'_, '_>>,
        tolerance: Option<Any<'_, '_>>,
        synthetic: Option<Any<'_, '_>>,
        added: Option<Any<'_, '_>>,
        muscles: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let list = |tables: Vec<Table>| Value::List(tables.into_iter().map(Value::Table).collect());
        let trials = each("trials", trials, |entry: &TrialEntry| entry.0.to_table())?;
        let Value::Table(mut given) = table([
            ("name", Some(name)),
            ("model", Some(model)),
            ("force_on", force_on),
            ("sample_rate", sample_rate),
            ("synthetic", synthetic),
        ]) else {
            return Err(refused(Refused::new("", "nothing", "a table")));
        };
        given.push("trial", list(trials));
        if let Some(subject) = subject {
            given.push(
                "subject",
                one("subject", subject, |s: &Subject| s.0.to_table())?,
            );
        }
        if let Some(tolerance) = tolerance {
            let table = one("tolerance", tolerance, |t: &Tolerance| t.0.to_table())?;
            given.push("tolerance", table);
        }
        if let Some(added) = added {
            given.push(
                "added",
                list(each("added", added, |a: &AddedMass| a.0.to_table())?),
            );
        }
        if let Some(muscles) = muscles {
            given.push(
                "muscle",
                list(each("muscles", muscles, |m: &Muscle| m.0.to_table())?),
            );
        }
        built("", given.into())
    }
    /// Read a `dataset.toml`.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///
    /// Raises
    /// ------
    /// BadInput
    ///     Names the file, the key, the value found and the value allowed.
    #[staticmethod]
    fn load(path: Any<'_, '_>) -> PyResult<Self> {
        let path: PathBuf = path_of("path", path)?;
        let read = arm_model::Description::load(&path);
        read.map(Self).map_err(refused)
    }
    /// Return the text of `dataset.toml`.
    fn to_toml(&self) -> String {
        self.0.to_toml()
    }
    /// Name of the data set, where it states one.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }
    /// The file of the model, below the folder of the data set; None for that of the subject by the literature.
    #[getter]
    fn model(&self) -> Option<&str> {
        self.0.model.as_deref()
    }
    /// The trials, in the order of the file.
    #[getter]
    fn trials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let entries = self.0.trials.iter().cloned().map(TrialEntry);
        PyTuple::new(py, entries.collect::<Vec<_>>())
    }
    /// What the forces act on: "robot" or "arm".
    #[getter]
    fn force_on(&self) -> Option<&'static str> {
        self.0.force_on.map(arm_model::ForceOn::name)
    }
    /// As stated [Hz].
    #[getter]
    fn sample_rate(&self) -> Option<f64> {
        self.0.sample_rate
    }
    /// Whose arm it is.
    #[getter]
    fn subject(&self) -> Subject {
        Subject(self.0.subject.clone())
    }
    /// What the calibration promises.
    #[getter]
    fn tolerance(&self) -> Tolerance {
        Tolerance(self.0.tolerance)
    }
    /// Whether the trials were simulated.
    #[getter]
    fn synthetic(&self) -> bool {
        self.0.synthetic
    }
    /// Masses that are worn in some configurations besides the model.
    #[getter]
    fn added<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let added = self.0.added.iter().cloned().map(AddedMass);
        PyTuple::new(py, added.collect::<Vec<_>>())
    }
    /// Muscles whose activity is recorded.
    #[getter]
    fn muscles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let muscles = self.0.muscles.iter().cloned().map(Muscle);
        PyTuple::new(py, muscles.collect::<Vec<_>>())
    }
}

value_class!(
    Description,
    [
        ("name", ""),
        ("model", ""),
        ("trials", ""),
        ("force_on", ""),
        ("sample_rate", "Hz"),
        ("subject", ""),
        ("tolerance", ""),
        ("synthetic", ""),
        ("added", ""),
        ("muscles", "")
    ]
);

wraps!(Tolerance, Subject, AddedMass, TrialEntry, Description);
