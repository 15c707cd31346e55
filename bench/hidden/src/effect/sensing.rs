//! What sensors do to what is there.

/// A fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensing {
    /// Added to a force \[N\].
    Bias(f64),
    /// Added to a force, for each second of the trial \[N/s\].
    Drift(f64),
    /// Relative error of a force.
    Gain(f64),
    /// Sensor turned, so that it reads the force turned counter-clockwise \[rad\].
    Turn(f64),
    /// Added to an angle \[rad\].
    Offset(f64),
    /// Forces late \[s\].
    Delay(f64),
    /// Relative error of an angle about a value \[rad\] at the end of the session, which grows from none at its start.
    WarmingAngle([f64; 2]),
    /// A force that lags: half the width of its loop \[N\].
    Hysteresis(f64),
}
