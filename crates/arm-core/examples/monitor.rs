//! A monitor of one angle: it stops at the first value that is not allowed, and stays stopped.

use arm_core::Invalid;
use arm_core::monitor::{Monitor, MonitoredChannel, Observation, Quantity, Times};

fn main() -> Result<(), Invalid> {
    let angle = MonitoredChannel::range(Quantity::Angle, -1.5, 0.5)
        .fastest(5.0)
        .frozen_after(50_000);
    let times = Times {
        oldest: 2_000,
        period: 2_000,
    };
    let mut monitor = Monitor::new([angle], times)?;
    for k in 0..500 {
        let now = 1_000 * k;
        let seen = Observation {
            now,
            stamp: now,
            values: [0.002 * k as f64],
            moving: [true],
        };
        if let Err(stop) = monitor.check(&seen) {
            println!(
                "{} of channel {:?} at {} ms: {}, allowed {}",
                stop.reason.name(),
                stop.channel,
                stop.at / 1000,
                stop.value,
                stop.limit
            );
            break;
        }
    }
    Ok(())
}
