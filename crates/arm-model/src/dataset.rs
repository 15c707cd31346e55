use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use crate::fields::{Bounds, Fields};
use crate::value::by_value;
use crate::{Refused, Subject, Table, Tolerance, Value, file, toml_file, unknown};

/// What the forces in the files act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ForceOn {
    /// The force of the arm on the robot's handle.
    Robot,
    /// The opposite.
    Arm,
}

const FORCES: [(&str, ForceOn); 2] = [("robot", ForceOn::Robot), ("arm", ForceOn::Arm)];

impl ForceOn {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        FORCES[self as usize].0
    }
}

/// What a trial is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// To choose and to fit on.
    Fit,
    /// To test on; nothing is ever chosen or fitted on it.
    Test,
}

const ROLES: [(&str, Role); 2] = [("fit", Role::Fit), ("test", Role::Test)];

impl Role {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        ROLES[self as usize].0
    }
}

/// A mass that is fixed to a segment in some configurations, such as one part of an orthosis.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedMass {
    /// Number of the segment, from 1.
    pub segment: i64,
    /// \[kg\]
    pub mass: f64,
    /// From the segment's proximal joint \[m\].
    pub at: f64,
    /// Where it is worn.
    pub configurations: Vec<String>,
}

impl AddedMass {
    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["segment", "mass", "at"], &["configurations"])?;
        let whole = fields.whole("segment", 1)?;
        let kilograms = Bounds::finite("kg").above(0.0).most(20.0);
        let metres = Bounds::finite("m")
            .least(0.0)
            .most(2.0)
            .hint("millimetres?");
        Ok(Self {
            segment: whole.unwrap_or(1),
            mass: fields.number("mass", &kilograms)?,
            at: fields.number("at", &metres)?,
            configurations: fields.names("configurations")?,
        })
    }

    /// The mass as it stands in a file.
    pub fn to_table(&self) -> Table {
        let names = self.configurations.iter().map(|n| n.as_str().into());
        Table::new()
            .with("segment", self.segment)
            .with("mass", self.mass)
            .with("at", self.at)
            .with("configurations", names.collect::<Vec<Value>>())
    }
}

/// A muscle, the channel with its activity, and the joint that it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Muscle {
    /// Name of its column.
    pub channel: String,
    /// Number of the joint, from 1.
    pub joint: i64,
    /// Envelope of a maximal voluntary contraction, in the unit of the channel; without it the largest of the session.
    pub mvc: Option<f64>,
    /// Envelope at rest, in the unit of the channel; without it the median of the session.
    pub rest: Option<f64>,
    /// By how much torque follows activity \[s\].
    pub delay: f64,
}

/// Delay of torque behind activity where none is stated \[s\]: Cavanagh and Komi 1979 found 0.0495 to 0.0555 s in elbow flexors.
const DELAY: f64 = 0.05;

impl Muscle {
    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["channel", "joint"], &["mvc", "rest", "delay_s"])?;
        let channel = fields.required_text("channel")?;
        if !channel.starts_with("emg_") {
            let found = Value::from(channel.as_str()).shown();
            return Err(Refused::new(
                fields.at("channel"),
                found,
                "the name of an emg_ column",
            ));
        }
        let level = |least: Bounds| least.most(1e9);
        let seconds = Bounds::finite("s").least(0.0).most(0.5);
        let muscle = Self {
            channel,
            joint: fields.whole("joint", 1)?.unwrap_or(1),
            mvc: fields.maybe_number("mvc", &level(Bounds::finite("").above(0.0)))?,
            rest: fields.maybe_number("rest", &level(Bounds::finite("").least(0.0)))?,
            delay: fields.maybe_number("delay_s", &seconds)?.unwrap_or(DELAY),
        };
        match (muscle.mvc, muscle.rest) {
            (Some(most), Some(rest)) if most <= rest => {
                let (found, allowed) =
                    (Value::Number(most).shown(), format!("above rest = {rest}"));
                Err(Refused::new(fields.at("mvc"), found, allowed))
            }
            _ => Ok(muscle),
        }
    }

    /// The muscle as it stands in a file.
    pub fn to_table(&self) -> Table {
        let mut table = Table::new()
            .with("channel", self.channel.as_str())
            .with("joint", self.joint);
        table.push("mvc", self.mvc);
        table.push("rest", self.rest);
        table.with("delay_s", self.delay)
    }
}

/// One trial in `dataset.toml`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TrialEntry {
    /// Its file, below the folder of the data set.
    pub file: String,
    /// The name of the movement, shared by its repeats.
    pub configuration: String,
    /// Number of the repeat, from 1.
    pub repeat: i64,
    /// What it is for.
    pub role: Role,
}

impl TrialEntry {
    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value that is not allowed.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["file", "configuration", "role"], &["repeat"])?;
        let file = fields.required_text("file")?;
        let configuration = fields.required_text("configuration")?;
        let repeat = fields.whole("repeat", 1)?.unwrap_or(1);
        let role = fields.choice("role", &ROLES)?.unwrap_or(Role::Fit);
        Ok(Self {
            file,
            configuration,
            repeat,
            role,
        })
    }

    /// The entry as it stands in a file.
    pub fn to_table(&self) -> Table {
        Table::new()
            .with("file", self.file.as_str())
            .with("configuration", self.configuration.as_str())
            .with("repeat", self.repeat)
            .with("role", self.role.name())
    }
}

/// The content of `dataset.toml`, before any trial is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Its name, where it states one.
    pub name: Option<String>,
    /// The model that the data challenge, below the folder of the data set; without one it is that of the subject by the literature.
    pub model: Option<String>,
    /// What the forces act on.
    pub force_on: Option<ForceOn>,
    /// As stated \[Hz\].
    pub sample_rate: Option<f64>,
    /// Whether the trials were simulated.
    pub synthetic: bool,
    /// Whose arm it is.
    pub subject: Subject,
    /// Tolerances of the calibration.
    pub tolerance: Tolerance,
    /// Masses that are worn in some configurations besides the model.
    pub added: Vec<AddedMass>,
    /// Muscles whose activity is recorded.
    pub muscles: Vec<Muscle>,
    /// The trials, in the order of the file.
    pub trials: Vec<TrialEntry>,
}

impl Description {
    /// Reads `dataset.toml`.
    ///
    /// # Errors
    /// [`Refused`] with file, table, key, the value found and the values allowed.
    pub fn load(path: &Path) -> Result<Self, Refused> {
        let text = file::read(path, "a TOML file")?;
        Self::from_toml(&text).map_err(|refused| refused.in_file(path))
    }

    /// Reads the text of `dataset.toml`.
    ///
    /// # Errors
    /// [`Refused`] with table, key, the value found and the values allowed.
    pub fn from_toml(text: &str) -> Result<Self, Refused> {
        Self::from_value("", toml_file::read(text)?.into())
    }

    /// The text of `dataset.toml`.
    pub fn to_toml(&self) -> String {
        toml_file::write(&self.to_table())
    }

    /// Reads a description of any format.
    ///
    /// # Errors
    /// [`Refused`] with table, key, the value found and the values allowed.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(
            &["trial"],
            &[
                "model",
                "name",
                "force_on",
                "sample_rate",
                "synthetic",
                "subject",
                "tolerance",
                "added",
                "muscle",
            ],
        )?;
        let tables = fields.tables("trial", "trial")?;
        let trials = (1..)
            .zip(tables)
            .map(|(k, table)| TrialEntry::from_value(&format!("[[trial]] {k}"), table))
            .collect::<Result<Vec<_>, _>>()?;
        check_trials(&trials)?;
        let rate = Bounds::finite("Hz").above(0.0).most(1e6);
        let table = |value: Option<Value>| value.unwrap_or_else(|| Table::new().into());
        let subject = Subject::from_value("[subject]", table(fields.take("subject")))?;
        let model = fields.maybe_text("model")?;
        if model.is_none()
            && let Some(lacking) = subject.lacks()
        {
            let allowed =
                "the file of the model, or a [subject] with body_mass, height, sex and lengths_m";
            return Err(Refused::new(fields.at("model"), "nothing", allowed)
                .hint(format!("{lacking} is missing in [subject]")));
        }
        Ok(Self {
            name: fields.maybe_text("name")?,
            model,
            force_on: fields.choice("force_on", &FORCES)?,
            sample_rate: fields.maybe_number("sample_rate", &rate)?,
            subject,
            tolerance: Tolerance::from_value("[tolerance]", table(fields.take("tolerance")))?,
            added: added(fields.tables("added", "added")?, &trials)?,
            muscles: muscles(fields.tables("muscle", "muscle")?)?,
            synthetic: fields.flag("synthetic")?,
            trials,
        })
    }

    /// The description as it stands in a file; tolerances only where they are not the usual ones.
    pub fn to_table(&self) -> Table {
        let list = |tables: Vec<Table>| Value::List(tables.into_iter().map(Value::Table).collect());
        let mut table = Table::new();
        table.push("name", self.name.clone());
        table.push("model", self.model.clone());
        table.push("force_on", self.force_on.map(ForceOn::name));
        table.push("sample_rate", self.sample_rate);
        if self.synthetic {
            table.push("synthetic", true);
        }
        if self.subject != Subject::default() {
            table.push("subject", self.subject.to_table());
        }
        if self.tolerance != Tolerance::default() {
            table.push("tolerance", self.tolerance.to_table());
        }
        if !self.added.is_empty() {
            table.push(
                "added",
                list(self.added.iter().map(AddedMass::to_table).collect()),
            );
        }
        if !self.muscles.is_empty() {
            table.push(
                "muscle",
                list(self.muscles.iter().map(Muscle::to_table).collect()),
            );
        }
        table.with(
            "trial",
            list(self.trials.iter().map(TrialEntry::to_table).collect()),
        )
    }
}

by_value!(AddedMass, Muscle, TrialEntry, Description);

fn added(tables: Vec<Value>, trials: &[TrialEntry]) -> Result<Vec<AddedMass>, Refused> {
    let read = |(k, table): (usize, Value)| {
        let place = format!("[[added]] {k}");
        let item = AddedMass::from_value(&place, table)?;
        let known: Vec<&str> = trials.iter().map(|t| t.configuration.as_str()).collect();
        match item
            .configurations
            .iter()
            .find(|n| !known.contains(&n.as_str()))
        {
            Some(name) => {
                let place = format!("{place}, configurations");
                Err(unknown(&place, name, "configuration", &known))
            }
            None => Ok(item),
        }
    };
    (1..).zip(tables).map(read).collect()
}

fn muscles(tables: Vec<Value>) -> Result<Vec<Muscle>, Refused> {
    let mut all: Vec<Muscle> = Vec::new();
    for (k, table) in (1..).zip(tables) {
        let muscle = Muscle::from_value(&format!("[[muscle]] {k}"), table)?;
        if let Some(before) = all.iter().position(|m| m.channel == muscle.channel) {
            let found = Value::from(muscle.channel.as_str()).shown();
            let allowed = format!(
                "each channel once: [[muscle]] {} has it already",
                before + 1
            );
            return Err(Refused::new(
                format!("[[muscle]] {k}, channel"),
                found,
                allowed,
            ));
        }
        all.push(muscle);
    }
    Ok(all)
}

fn check_trials(trials: &[TrialEntry]) -> Result<(), Refused> {
    let mut by_file: BTreeMap<PathBuf, usize> = BTreeMap::new();
    let mut by_repeat: BTreeMap<(&str, i64), usize> = BTreeMap::new();
    for (number, trial) in (1..).zip(trials) {
        let first = *by_file.entry(normal(&trial.file)).or_insert(number);
        if first != number {
            return Err(Refused::new(
                format!("[[trial]] {number}, file"),
                Value::from(trial.file.as_str()).shown(),
                format!("each file once: [[trial]] {first} has it already"),
            ));
        }
        let repeat = (trial.configuration.as_str(), trial.repeat);
        let first = *by_repeat.entry(repeat).or_insert(number);
        if first != number {
            return Err(Refused::new(
                format!("[[trial]] {number}, repeat"),
                format!("repeat {} of \"{}\"", trial.repeat, trial.configuration),
                format!("each repeat once: [[trial]] {first} has it already"),
            ));
        }
    }
    if trials.iter().any(|trial| trial.role == Role::Fit) {
        return Ok(());
    }
    Err(Refused::new(
        "[[trial]]",
        "no trial with role = \"fit\"",
        "at least one",
    ))
}

/// A path without what leads nowhere.
fn normal(file: &str) -> PathBuf {
    let mut out = PathBuf::new();
    for part in Path::new(file).components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}
