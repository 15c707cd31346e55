use crate::fields::{Bounds, Fields, check_text};
use crate::number::rounded;
use crate::value::by_value;
use crate::{Refused, Table, Value};

/// Mass of a segment for each metre of its length, in general \[kg/m\]: an upper arm has 7, and steel as thick as a man 1000.
const MAX_DENSITY: f64 = 1000.0;
/// In mass · length². A point mass at the far end has 1, a rod a twelfth; more than this is probably another unit.
const LARGE_INERTIA: f64 = 3.0;

/// One rigid segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segment {
    /// Its name.
    pub name: String,
    /// Joint to joint, or joint to handle for the last \[m\].
    pub length: f64,
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass along the segment from the proximal joint \[m\].
    pub com: f64,
    /// Moment of inertia about the centre of mass \[kg m²\].
    pub inertia: f64,
    /// Centre of mass normal to the segment, counter-clockwise \[m\].
    pub com_normal: f64,
}

impl Segment {
    /// Keys in files; all but the last are numbers and required.
    const KEYS: [&'static str; 6] = ["name", "length", "mass", "com", "inertia", "com_normal"];

    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&Self::KEYS[..5], &Self::KEYS[5..])?;
        let name = fields.required_text("name")?;
        let length = fields.number("length", &Self::LENGTH)?;
        let any = Bounds::finite("m");
        let mut segment = Self {
            name,
            length,
            mass: fields.number("mass", &Self::MASS)?,
            com: fields.number("com", &Self::com_bounds(length))?,
            inertia: fields.number("inertia", &Self::INERTIA)?,
            com_normal: fields.number_or("com_normal", 0.0, &any)?,
        };
        segment.check().map_err(|refused| refused.within(place))?;
        segment.com_normal += 0.0;
        Ok(segment)
    }

    /// Bounds of the length.
    pub(crate) const LENGTH: Bounds = Bounds::finite("m")
        .above(0.0)
        .most(100.0)
        .hint("millimetres?");
    pub(crate) const MASS: Bounds = Bounds::finite("kg").above(0.0);
    pub(crate) const INERTIA: Bounds = Bounds::finite("kg m²").least(0.0);

    pub(crate) const fn com_bounds(length: f64) -> Bounds {
        Bounds::finite("m")
            .least(0.0)
            .most(length)
            .hint("at most the length of the segment")
    }

    pub(crate) const fn normal_bounds(length: f64) -> Bounds {
        Bounds::finite("m").least(-length).most(length)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`Refused`] names the first that is out of bounds.
    pub fn check(&self) -> Result<(), Refused> {
        check_text("name", &self.name)?;
        Self::LENGTH.check("length", self.length)?;
        Self::MASS.check("mass", self.mass)?;
        let most = (MAX_DENSITY * self.length).max(1.0);
        if self.mass > most {
            let allowed = format!(
                "at most {} kg for a segment of {} m",
                rounded(most, 6),
                rounded(self.length, 6)
            );
            let found = Value::Number(self.mass).shown();
            return Err(Refused::new("mass", found, allowed).hint("grams?"));
        }
        Self::com_bounds(self.length).check("com", self.com)?;
        Self::INERTIA.check("inertia", self.inertia)?;
        Self::normal_bounds(self.length).check("com_normal", self.com_normal)?;
        Ok(())
    }

    /// The segment as it stands in a file.
    pub fn to_table(&self) -> Table {
        let table = Table::new()
            .with("name", self.name.as_str())
            .with("length", self.length)
            .with("mass", self.mass)
            .with("com", self.com)
            .with("inertia", self.inertia);
        if self.com_normal == 0.0 {
            table
        } else {
            table.with("com_normal", self.com_normal)
        }
    }

    /// The same segment with a point mass on it.
    ///
    /// * `mass` - \[kg\]
    /// * `at` - from the proximal joint \[m\]
    #[must_use]
    pub fn with_mass(&self, mass: f64, at: f64) -> Self {
        let total = self.mass + mass;
        let com = (self.mass * self.com + mass * at) / total;
        // Between the two at any rounding: a segment's end is as far as a model may have it.
        let com = com.clamp(self.com.min(at), self.com.max(at));
        let normal = self.mass * self.com_normal / total;
        let square = |value: f64| value * value;
        let shift = square(self.com - com) + square(self.com_normal - normal);
        Self {
            name: self.name.clone(),
            length: self.length,
            mass: total,
            com,
            inertia: self.inertia + self.mass * shift + mass * (square(at - com) + square(normal)),
            com_normal: normal,
        }
    }

    /// What is hardly a segment of an arm, in a sentence.
    pub fn warning(&self) -> Option<String> {
        let scale = self.mass * self.length * self.length;
        (self.inertia > LARGE_INERTIA * scale).then(|| {
            format!(
                "model: inertia {} kg m² of segment {} is {} times mass · length², a mass at the far end has 1: \
                 is it in kg cm², or about another point?",
                rounded(self.inertia, 6),
                crate::number::quoted(&self.name),
                rounded(self.inertia / scale, 3)
            )
        })
    }

    /// The segment as the core computes with it.
    pub fn core(&self) -> arm_core::Segment<f64> {
        arm_core::Segment {
            length: self.length,
            mass: self.mass,
            com: [self.com, self.com_normal],
            inertia: self.inertia,
        }
    }
}

by_value!(Segment);
