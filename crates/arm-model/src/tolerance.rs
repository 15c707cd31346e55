use crate::fields::{Bounds, Fields};
use crate::value::by_value;
use crate::{Refused, Table, Value};

/// Tolerances of the calibration, each as one standard deviation. Smaller deviations are absorbed and reported, larger ones
/// are named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Offset of an angle sensor \[°\].
    pub angle_offset_deg: f64,
    /// Bias of a force channel \[N\].
    pub force_bias: f64,
    /// Relative error of the force sensor's gain.
    pub force_gain: f64,
    /// Delay of force against angles \[s\].
    pub time_delay: f64,
    /// Where the hand holds the handle \[m\].
    pub handle_placement: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self {
            angle_offset_deg: 0.3,
            force_bias: 0.2,
            force_gain: 0.01,
            time_delay: 0.005,
            handle_placement: 0.001,
        }
    }
}

/// A key: its name, its largest value, and its field.
type Key = (&'static str, f64, fn(&mut Tolerance) -> &mut f64);

const KEYS: [Key; 5] = [
    ("angle_offset_deg", 180.0, |t| &mut t.angle_offset_deg),
    ("force_bias_N", 1e4, |t| &mut t.force_bias),
    ("force_gain", 10.0, |t| &mut t.force_gain),
    ("time_delay_s", 10.0, |t| &mut t.time_delay),
    ("handle_placement_m", 10.0, |t| &mut t.handle_placement),
];

impl Tolerance {
    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown key and for a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&[], &KEYS.map(|(name, ..)| name))?;
        let mut tolerance = Self::default();
        for (name, most, of) in KEYS {
            let value = of(&mut tolerance);
            let bounds = Bounds::finite("").least(0.0).most(most);
            *value = fields.number_or(name, *value, &bounds)?;
        }
        Ok(tolerance)
    }

    /// Offset of an angle sensor \[rad\].
    pub fn angle_offset(&self) -> f64 {
        self.angle_offset_deg.to_radians()
    }

    /// The tolerances as they stand in a file.
    pub fn to_table(&self) -> Table {
        let mut values = *self;
        KEYS.iter().fold(Table::new(), |table, (name, _, of)| {
            table.with(name, *of(&mut values))
        })
    }
}

by_value!(Tolerance);
