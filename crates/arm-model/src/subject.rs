use crate::fields::{Bounds, Fields};
use crate::value::by_value;
use crate::{Refused, Table, Value};

/// Sex, as the literature's tables distinguish it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sex {
    /// Male.
    Male,
    /// Female.
    Female,
}

const SEXES: [(&str, Sex); 2] = [("male", Sex::Male), ("female", Sex::Female)];

impl Sex {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        SEXES[self as usize].0
    }
}

/// Side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The left arm.
    Left,
    /// The right arm.
    Right,
}

const SIDES: [(&str, Side); 2] = [("left", Side::Left), ("right", Side::Right)];

impl Side {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        SIDES[self as usize].0
    }
}

/// Whose arm it is. Body mass, height and sex are used for the literature values, name and side for a history.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Subject {
    /// \[kg\]
    pub body_mass: Option<f64>,
    /// \[m\]
    pub height: Option<f64>,
    /// As the literature's tables distinguish it.
    pub sex: Option<Sex>,
    /// By which sessions of one person are found again.
    pub name: Option<String>,
    /// Which arm was measured.
    pub side: Option<Side>,
    /// Measured lengths of the segments, the last one to the handle \[m\]; none where they are scaled with height.
    pub lengths: Vec<f64>,
}

impl Subject {
    const BODY_MASS: Bounds = Bounds::finite("kg").least(1.0).most(500.0);
    const HEIGHT: Bounds = Bounds::finite("m")
        .least(0.3)
        .most(3.0)
        .hint("centimetres?");
    const LENGTH: Bounds = Bounds::finite("m")
        .above(0.0)
        .most(1.0)
        .hint("centimetres or millimetres?");

    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(
            &[],
            &["body_mass", "height", "sex", "name", "side", "lengths_m"],
        )?;
        Ok(Self {
            body_mass: fields.maybe_number("body_mass", &Self::BODY_MASS)?,
            height: fields.maybe_number("height", &Self::HEIGHT)?,
            sex: fields.choice("sex", &SEXES)?,
            name: fields.maybe_text("name")?,
            side: fields.choice("side", &SIDES)?,
            lengths: fields.list("lengths_m", &Self::LENGTH)?,
        })
    }

    /// The first value that an arm by the literature needs and that is not stated; none where all are.
    pub fn lacks(&self) -> Option<&'static str> {
        let said = [
            ("body_mass", self.body_mass.is_some()),
            ("height", self.height.is_some()),
            ("sex", self.sex.is_some()),
            ("lengths_m", !self.lengths.is_empty()),
        ];
        said.into_iter().find(|(_, is)| !is).map(|(name, _)| name)
    }

    /// The subject as it stands in a file.
    pub fn to_table(&self) -> Table {
        let mut table = Table::new();
        table.push("body_mass", self.body_mass);
        table.push("height", self.height);
        table.push("sex", self.sex.map(Sex::name));
        table.push("name", self.name.clone());
        table.push("side", self.side.map(Side::name));
        if !self.lengths.is_empty() {
            let lengths = self.lengths.iter().copied().map(Value::Number).collect();
            table.push("lengths_m", Value::List(lengths));
        }
        table
    }
}

by_value!(Subject);
