//! One parameter with its unit and interval.

use serde::Serialize;

use super::{at_least, at_most};

/// Half width of a 95 % interval in standard deviations.
const HALF_WIDTH: f64 = 1.96;

/// One parameter of a named effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// In `unit`.
    pub value: f64,
    /// Standard deviation; `None` for a value that was held.
    pub std: Option<f64>,
    /// SI unit.
    pub unit: String,
    /// The 95 % interval, within what its kind allows.
    pub interval: Option<(f64, f64)>,
}

impl Value {
    /// A value with its interval.
    ///
    /// * `limits` - the smallest and the largest value that its kind allows
    pub fn of(value: f64, std: Option<f64>, unit: &str, limits: (f64, f64)) -> Self {
        let interval = std.map(|std| {
            (
                at_least(value - HALF_WIDTH * std, limits.0),
                at_most(value + HALF_WIDTH * std, limits.1),
            )
        });
        Self {
            value,
            std,
            unit: unit.to_owned(),
            interval,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_stays_within_what_the_kind_allows() {
        let wide = Value::of(0.01, Some(0.08), "rad/s", (1e-4, 1.0));
        assert_eq!(wide.interval, Some((1e-4, 0.01 + 1.96 * 0.08)));
        assert_eq!(Value::of(0.01, None, "rad/s", (1e-4, 1.0)).interval, None);
    }
}
