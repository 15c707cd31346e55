use std::ops::Deref;
use std::path::Path;

use arm_core::{Chain, Invalid, Setup};

use crate::fields::{Bounds, Fields};
use crate::number::rounded;
use crate::value::by_value;
use crate::{Contact, Effect, Joint, Refused, Robot, Segment, Table, Value, file, toml_file};

/// Most segments of an arm.
pub const MAX_SEGMENTS: usize = 6;
/// The weight of an arm that is held at its tip may press the contact in by this part of the arm's length.
const SOFT_CONTACT: f64 = 0.2;

/// What a model is made of; [`Model::new`] checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Proximal first.
    pub segments: Vec<Segment>,
    /// One a segment: `joints[j]` is at the proximal end of `segments[j]`.
    pub joints: Vec<Joint>,
    /// Along −z \[m/s²\].
    pub gravity: f64,
    /// First joint, y and z \[m\].
    pub base: [f64; 2],
    /// Relative standard deviation of masses, centres of mass and inertias; 0 is exact.
    pub segment_uncertainty: f64,
    /// Relative standard deviation of the laws that the joints state; 0 is exact.
    pub joint_uncertainty: f64,
    /// The robot that leads the arm.
    pub robot: Option<Robot>,
    /// Between hand and robot.
    pub contact: Option<Contact>,
    /// What acts besides the laws that the joints state.
    pub effects: Vec<Effect>,
}

impl Default for Parts {
    fn default() -> Self {
        Self {
            segments: Vec::new(),
            joints: Vec::new(),
            gravity: 9.81,
            base: [0.0; 2],
            segment_uncertainty: 0.05,
            joint_uncertainty: 0.0,
            robot: None,
            contact: None,
            effects: Vec::new(),
        }
    }
}

impl Parts {
    /// The same parts with the numbers of the table `[arm]` that are given there.
    ///
    /// # Errors
    /// [`Refused`] for a value out of bounds.
    pub fn with_numbers(self, mut arm: Fields) -> Result<Self, Refused> {
        Ok(Self {
            gravity: arm.number_or("gravity", self.gravity, &Model::GRAVITY)?,
            base: arm.pair_or("base", self.base, &Model::BASE)?,
            segment_uncertainty: arm.number_or(
                "segment_uncertainty",
                self.segment_uncertainty,
                &UNCERTAINTY,
            )?,
            joint_uncertainty: arm.number_or(
                "joint_uncertainty",
                self.joint_uncertainty,
                &UNCERTAINTY,
            )?,
            ..self
        })
    }
}

/// An arm, what acts on it, and the rig that leads it. One that exists is valid.
#[derive(Clone, Debug, PartialEq)]
pub struct Model(Parts);

impl Deref for Model {
    type Target = Parts;
    fn deref(&self) -> &Parts {
        &self.0
    }
}

const UNCERTAINTY: Bounds = Bounds::finite("").least(0.0).most(1.0).hint("5 % is 0.05");

impl Model {
    pub(crate) const GRAVITY: Bounds = Bounds::finite("m/s²").least(0.0).most(1000.0);
    pub(crate) const BASE: Bounds = Bounds::finite("m");

    /// A model of checked parts.
    ///
    /// # Errors
    /// [`Refused`] names the first part that is not valid, or what does not fit together.
    pub fn new(parts: Parts) -> Result<Self, Refused> {
        let joints = parts.joints.len();
        if !(1..=MAX_SEGMENTS).contains(&parts.segments.len()) {
            let found = format!("{} segments", parts.segments.len());
            let allowed = format!("1 to {MAX_SEGMENTS} segments");
            return Err(Refused::new("[[arm.segment]]", found, allowed));
        }
        if joints != parts.segments.len() {
            let allowed = format!("one a segment, so {}", parts.segments.len());
            return Err(Refused::new(
                "[[arm.joint]]",
                format!("{joints} joints"),
                allowed,
            ));
        }
        for (k, segment) in (1..).zip(&parts.segments) {
            within(&format!("[[arm.segment]] {k}"), segment.check())?;
        }
        for (k, joint) in (1..).zip(&parts.joints) {
            within(&format!("[[arm.joint]] {k}"), joint.check())?;
        }
        for (k, effect) in (1..).zip(&parts.effects) {
            let place = format!("[[effect]] {k} ({})", effect.name());
            within(&place, effect.check_joint(joints))?;
        }
        within("[robot]", parts.robot.map_or(Ok(()), |robot| robot.check()))?;
        within("[contact]", parts.contact.map_or(Ok(()), |c| c.check()))?;
        Self::GRAVITY.check("[arm], gravity", parts.gravity)?;
        for (k, value) in parts.base.into_iter().enumerate() {
            Self::BASE.check(&format!("[arm], base[{k}]"), value)?;
        }
        UNCERTAINTY.check("[arm], segment_uncertainty", parts.segment_uncertainty)?;
        UNCERTAINTY.check("[arm], joint_uncertainty", parts.joint_uncertainty)?;
        refuse_soft_contact(&parts)?;
        Ok(Self(parts))
    }

    /// The same model with some parts changed.
    ///
    /// # Errors
    /// [`Refused`] as of [`Model::new`].
    pub fn change(&self, change: impl FnOnce(&mut Parts)) -> Result<Self, Refused> {
        let mut parts = self.0.clone();
        change(&mut parts);
        Self::new(parts)
    }

    /// Number of joints, and of segments.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Every effect: the laws that the joints state, joint by joint, then the effects listed.
    pub fn all_effects(&self) -> Vec<Effect> {
        let joints = self.joints.iter().enumerate();
        joints
            .flat_map(|(index, joint)| joint.effects(index))
            .chain(self.effects.iter().copied())
            .collect()
    }

    /// The same model with a point mass on a segment.
    ///
    /// * `segment` - from 0
    /// * `mass` - \[kg\]
    /// * `at` - from the segment's proximal joint \[m\]; at its end when absent
    ///
    /// # Errors
    /// [`Refused`] for a mass that is not positive, or a place that is not on the segment.
    pub fn with_mass(&self, segment: usize, mass: f64, at: Option<f64>) -> Result<Self, Refused> {
        let Some(old) = self.segments.get(segment) else {
            let allowed = format!("a whole number 1 to {}", self.n_joints());
            return Err(Refused::new("number", (segment + 1).to_string(), allowed));
        };
        Bounds::finite("kg").above(0.0).check("mass", mass)?;
        let on = Bounds::finite("m").least(0.0).most(old.length);
        let at = at.map_or(Ok(old.length), |at| on.check("at", at))?;
        let new = old.with_mass(mass, at);
        self.change(|parts| parts.segments[segment] = new)
    }

    /// What is hardly an arm, a line each.
    pub fn warnings(&self) -> Vec<String> {
        self.segments.iter().filter_map(Segment::warning).collect()
    }

    /// Reads `model.toml`.
    ///
    /// # Errors
    /// [`Refused`] with file, table, key, the value found and the values allowed.
    pub fn load(path: &Path) -> Result<Self, Refused> {
        let text = file::read(path, "a TOML file")?;
        Self::from_toml(&text).map_err(|refused| refused.in_file(path))
    }

    /// Reads the text of `model.toml`.
    ///
    /// # Errors
    /// [`Refused`] with table, key, the value found and the values allowed.
    pub fn from_toml(text: &str) -> Result<Self, Refused> {
        Self::from_value("", toml_file::read(text)?.into())
    }

    /// The text of `model.toml`. Reading it back gives an equal model, to the last bit.
    pub fn to_toml(&self) -> String {
        toml_file::write(&self.to_table())
    }

    /// Reads a model of any format.
    ///
    /// # Errors
    /// [`Refused`] with table, key, the value found and the values allowed.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut document = Fields::new(place, value)?;
        document.only(&["arm"], &["robot", "contact", "effect"])?;
        let mut arm = Fields::new("[arm]", document.take("arm").unwrap_or(Value::Nothing))?;
        arm.only(
            &["segment"],
            &[
                "joint",
                "gravity",
                "base",
                "segment_uncertainty",
                "joint_uncertainty",
            ],
        )?;
        let segments = arm.tables("segment", "arm.segment")?;
        let joints = arm.tables("joint", "arm.joint")?;
        let effects = document.tables("effect", "effect")?;
        let joints = each("[[arm.joint]]", "joint", joints, Joint::from_value)?;
        let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
        let parts = Parts {
            segments: each("[[arm.segment]]", "segment", segments, Segment::from_value)?,
            robot: optional(&mut document, "robot", Robot::from_value)?,
            contact: optional(&mut document, "contact", Contact::from_value)?,
            effects: (1..)
                .zip(effects)
                .map(|(k, table)| Effect::from_value_on(&names, &format!("[[effect]] {k}"), table))
                .collect::<Result<_, _>>()?,
            joints,
            ..Parts::default()
        };
        Self::new(parts.with_numbers(arm)?)
    }

    /// The model as it stands in a file.
    pub fn to_table(&self) -> Table {
        let list = |tables: Vec<Table>| Value::List(tables.into_iter().map(Value::Table).collect());
        let mut arm = Table::new()
            .with("gravity", self.gravity)
            .with("base", self.base)
            .with("segment_uncertainty", self.segment_uncertainty);
        if self.joint_uncertainty != 0.0 {
            arm.push("joint_uncertainty", self.joint_uncertainty);
        }
        arm.push(
            "segment",
            list(self.segments.iter().map(Segment::to_table).collect()),
        );
        arm.push(
            "joint",
            list(self.joints.iter().map(Joint::to_table).collect()),
        );
        let mut document = Table::new().with("arm", arm);
        document.push("robot", self.robot.as_ref().map(Robot::to_table));
        document.push("contact", self.contact.as_ref().map(Contact::to_table));
        if !self.effects.is_empty() {
            document.push(
                "effect",
                list(self.effects.iter().map(Effect::to_table).collect()),
            );
        }
        document
    }

    /// The rigid arm of `N` segments as the core computes with it.
    ///
    /// # Errors
    /// [`Invalid`] where the model has another number of segments.
    pub fn chain<const N: usize>(&self) -> Result<Chain<f64, N>, Invalid> {
        let segments: Vec<_> = self.segments.iter().map(Segment::core).collect();
        let Ok(segments) = <[_; N]>::try_from(segments) else {
            return Err(Invalid::OutOfRange {
                name: "number of segments",
                index: 0,
                found: self.n_joints() as f64,
                min: N as f64,
                max: N as f64,
            });
        };
        Chain::new(segments, self.base, [0.0, -self.gravity])
    }

    /// The rig of `N` segments without its effects.
    ///
    /// # Errors
    /// [`Invalid`] where the model has another number of segments.
    pub fn setup<const N: usize>(&self) -> Result<Setup<f64, N>, Invalid> {
        Ok(Setup::new(&self.chain()?, self.core_contact()))
    }

    /// The contact as the core computes with it, [`Contact::ASSUMED`] where the model states none.
    pub fn core_contact(&self) -> arm_core::Contact<f64> {
        self.contact.unwrap_or(Contact::ASSUMED).core()
    }

    /// Every effect as the core computes with it, in the order of [`Model::all_effects`].
    pub fn core_effects(&self) -> Vec<arm_core::effect::Effect<f64>> {
        self.all_effects().iter().map(Effect::core).collect()
    }
}

by_value!(Model);

fn within(place: &str, checked: Result<(), Refused>) -> Result<(), Refused> {
    checked.map_err(|refused| refused.within(place))
}

/// Reads each table of a list; one without a name is called by its number.
fn each<T>(
    place: &str,
    name: &str,
    tables: Vec<Value>,
    read: fn(&str, Value) -> Result<T, Refused>,
) -> Result<Vec<T>, Refused> {
    let named = |(k, value): (usize, Value)| {
        let value = match value {
            Value::Table(table) if table.0.iter().all(|(key, _)| key != "name") => {
                Value::Table(table.with("name", format!("{name} {k}")))
            }
            value => value,
        };
        read(&format!("{place} {k}"), value)
    };
    (1..).zip(tables).map(named).collect()
}

fn optional<T>(
    document: &mut Fields,
    key: &str,
    read: fn(&str, Value) -> Result<T, Refused>,
) -> Result<Option<T>, Refused> {
    match document.take(key) {
        None | Some(Value::Nothing) => Ok(None),
        Some(value) => read(&format!("[{key}]"), value).map(Some),
    }
}

/// Refuses a contact into which the arm would sink: its stiffness is then in another unit.
fn refuse_soft_contact(parts: &Parts) -> Result<(), Refused> {
    let Some(contact) = parts.contact else {
        return Ok(());
    };
    // Stretched out forward, with its first joint free.
    let (mut length, mut moment) = (0.0, 0.0);
    for segment in &parts.segments {
        moment += segment.mass * (length + segment.com);
        length += segment.length;
    }
    let held = parts.gravity * moment / length;
    let least = held / (SOFT_CONTACT * length);
    // A slide gives way in one direction on purpose.
    let stiffest = contact.stiffness[0].max(contact.stiffness[1]);
    if stiffest >= least {
        return Ok(());
    }
    let allowed = format!(
        ">= {} N/m: {} N of the arm's weight would press it in by {} m",
        rounded(least, 3),
        rounded(held, 3),
        rounded(held / stiffest, 3)
    );
    let found = Value::Number(stiffest).shown();
    Err(Refused::new("[contact], stiffness", found, allowed).hint("kN/m or N/mm? 10 kN/m is 10000"))
}
