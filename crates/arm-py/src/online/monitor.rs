//! The safety monitor.

use std::sync::Mutex;

use arm_core::monitor::{Monitor, MonitoredChannel, Observation, Quantity, Times};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::rows::{Table, locked};
use crate::arrays::by_rows;
use crate::errors::{bad_input, invalid};

/// Channels that the C interface watches.
const CHANNELS: usize = 16;

/// What one channel must not do, by the names of the C interface; times in microseconds, zero for no limit.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limits {
    quantity: String,
    min: f64,
    max: f64,
    fastest: f64,
    farthest: f64,
    frozen_after: u64,
}

impl Limits {
    fn core(&self) -> PyResult<MonitoredChannel<f64>> {
        use Quantity::{Acceleration, Angle, Force, Power, Speed};
        let all = [Angle, Speed, Acceleration, Force, Power];
        let Some(quantity) = all.into_iter().find(|q| q.name() == self.quantity) else {
            let allowed = all.map(Quantity::name).join(", ");
            return Err(bad_input("quantity", &self.quantity, &allowed));
        };
        let any = |change: f64| if change == 0.0 { f64::INFINITY } else { change };
        let mut channel = MonitoredChannel::range(quantity, self.min, self.max)
            .fastest(any(self.fastest))
            .farthest(any(self.farthest));
        channel.frozen_after = (self.frozen_after > 0).then_some(self.frozen_after);
        Ok(channel)
    }
}

/// The row of a log, why, the channel, what was found, the limit, and when [µs].
type Stopped = (usize, &'static str, Option<usize>, f64, f64, u64);

/// The compiled part of `armrs.online.Monitor`.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct OnlineMonitor {
    inner: Mutex<Monitor<f64, CHANNELS>>,
    channels: usize,
}

#[pymethods]
impl OnlineMonitor {
    #[new]
    fn new(channels: Vec<Limits>, oldest: u64, period: u64) -> PyResult<Self> {
        let count = channels.len();
        if count == 0 || count > CHANNELS {
            return Err(bad_input("channels", format!("{count} of them"), "1 to 16"));
        }
        let mut kept = [MonitoredChannel::magnitude(Quantity::Force, f64::INFINITY); CHANNELS];
        for (place, limits) in kept.iter_mut().zip(&channels) {
            *place = limits.core()?;
        }
        let monitor = Monitor::new(kept, Times { oldest, period }).and_then(|m| m.watching(count));
        Ok(Self {
            inner: Mutex::new(monitor.map_err(invalid)?),
            channels: count,
        })
    }

    /// Checks control periods up to the first that is not allowed.
    ///
    /// Parameters
    /// ----------
    /// times : tuple of ndarray of uint64, shape (n,)
    ///     The clock, and when the values were measured [µs].
    /// values : ndarray, shape (n, n_channels)
    /// moving : ndarray of bool, shape (n, n_channels)
    fn run(
        &self,
        times: (PyReadonlyArray1<'_, u64>, PyReadonlyArray1<'_, u64>),
        values: Table<'_>,
        moving: PyReadonlyArray2<'_, bool>,
    ) -> PyResult<Option<Stopped>> {
        let (now, stamp) = (times.0.as_slice()?, times.1.as_slice()?);
        let (values, moving) = (by_rows(&values), by_rows(&moving));
        let mut monitor = locked(&self.inner);
        for row in 0..now.len() {
            let span = row * self.channels..(row + 1) * self.channels;
            let mut seen = Observation {
                now: now[row],
                stamp: stamp[row],
                values: [0.0; CHANNELS],
                moving: [false; CHANNELS],
            };
            seen.values[..self.channels].copy_from_slice(&values[span.clone()]);
            seen.moving[..self.channels].copy_from_slice(&moving[span]);
            if let Err(stop) = monitor.check(&seen) {
                let reason = stop.reason.name();
                return Ok(Some((
                    row,
                    reason,
                    stop.channel,
                    stop.value,
                    stop.limit,
                    stop.at,
                )));
            }
        }
        Ok(None)
    }

    /// Lets a stopped device start again.
    fn reset(&self) {
        locked(&self.inner).reset();
    }
}
