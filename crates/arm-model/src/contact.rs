use crate::fields::{Bounds, Fields};
use crate::value::by_value;
use crate::{Refused, Table, Value};

/// The spring and damper between hand and robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Along y and z \[N/m\].
    pub stiffness: [f64; 2],
    /// Along y and z \[N s/m\].
    pub damping: [f64; 2],
}

impl Contact {
    /// The contact of the thesis, which is taken where a model states none.
    pub const ASSUMED: Self = Self {
        stiffness: [10_000.0; 2],
        damping: [25.0; 2],
    };
    pub(crate) const STIFFNESS: Bounds = Bounds::finite("N/m").above(0.0);
    pub(crate) const DAMPING: Bounds = Bounds::finite("N s/m").least(0.0);

    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["stiffness"], &["damping"])?;
        Ok(Self {
            stiffness: fields.pair("stiffness", &Self::STIFFNESS)?,
            damping: fields.pair_or("damping", [0.0; 2], &Self::DAMPING)?,
        })
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`Refused`] names the first that is out of bounds.
    pub fn check(&self) -> Result<(), Refused> {
        for k in 0..2 {
            Self::STIFFNESS.check(&format!("stiffness[{k}]"), self.stiffness[k])?;
            Self::DAMPING.check(&format!("damping[{k}]"), self.damping[k])?;
        }
        Ok(())
    }

    /// The contact as it stands in a file.
    pub fn to_table(&self) -> Table {
        Table::new()
            .with("stiffness", self.stiffness)
            .with("damping", self.damping)
    }

    /// The contact as the core computes with it.
    pub fn core(&self) -> arm_core::Contact<f64> {
        arm_core::Contact::new(self.stiffness, self.damping)
    }
}

by_value!(Contact);
