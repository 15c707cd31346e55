use arm_core::Elbow;

use crate::fields::{Bounds, Fields};
use crate::value::by_value;
use crate::{Refused, Table, Value};

/// The robot that leads the arm: two links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot {
    /// Lengths of the links \[m\].
    pub lengths: [f64; 2],
    /// First axis, y and z \[m\].
    pub base: [f64; 2],
    /// Which of the two postures it takes.
    pub elbow: Elbow,
}

const ELBOWS: [(&str, Elbow); 2] = [("up", Elbow::Up), ("down", Elbow::Down)];

impl Robot {
    pub(crate) const LENGTHS: Bounds = Bounds::finite("m")
        .above(0.0)
        .most(100.0)
        .hint("millimetres?");
    pub(crate) const BASE: Bounds = Bounds::finite("m");

    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["lengths", "base"], &["elbow"])?;
        Ok(Self {
            lengths: fields.pair("lengths", &Self::LENGTHS)?,
            base: fields.pair("base", &Self::BASE)?,
            elbow: fields.choice("elbow", &ELBOWS)?.unwrap_or(Elbow::Up),
        })
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`Refused`] names the first that is out of bounds.
    pub fn check(&self) -> Result<(), Refused> {
        for k in 0..2 {
            Self::LENGTHS.check(&format!("lengths[{k}]"), self.lengths[k])?;
            Self::BASE.check(&format!("base[{k}]"), self.base[k])?;
        }
        Ok(())
    }

    /// The word for the side of the elbow.
    pub fn elbow_name(&self) -> &'static str {
        match self.elbow {
            Elbow::Up => "up",
            Elbow::Down => "down",
        }
    }

    /// The robot as it stands in a file.
    pub fn to_table(&self) -> Table {
        Table::new()
            .with("lengths", self.lengths)
            .with("base", self.base)
            .with("elbow", self.elbow_name())
    }

    /// The robot as the core computes with it.
    ///
    /// # Errors
    /// [`Invalid`](arm_core::Invalid) for a length that is not positive.
    pub fn core(&self) -> Result<arm_core::Robot<f64>, arm_core::Invalid> {
        arm_core::Robot::new(self.lengths, self.base, self.elbow)
    }
}

by_value!(Robot);
