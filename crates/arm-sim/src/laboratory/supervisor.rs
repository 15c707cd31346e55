//! The safety supervisor that watches a robot (thesis section 3.3).

use arm_core::monitor::{Monitor, MonitoredChannel, Observation, Quantity, Stop, Times};
use arm_core::{Joints, Plane};

use crate::laboratory::noise::Normal;
use crate::{JointMotion, SimulationError};

/// What the supervisor allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// How far an angle may be outside of the required ones \[rad\].
    pub angle_margin: f64,
    /// Largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest acceleration of a joint \[rad/s²\].
    pub acceleration: f64,
    /// Largest force in y and z \[N\].
    pub force: f64,
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            angle_margin: 0.05,
            speed: 2.5,
            acceleration: 40.0,
            force: 100.0,
        }
    }
}

/// Steps of an encoder in one period below which it may read the same value again.
const MOVING_STEPS: f64 = 8.0;
/// The force sensor: noise \[N\], range \[N\], bits.
const FORCE_SENSOR: (f64, f64, u32) = (0.2, 110.0, 12);
/// Largest jitter of a time stamp \[µs\].
const JITTER: f64 = 40.0;

/// Angle of one step of an encoder \[rad\].
pub(crate) fn encoder_step(bits: u32) -> f64 {
    core::f64::consts::TAU / (1_u64 << bits) as f64
}

/// The monitor of the core over angles, speeds, accelerations and forces, each of two joints or axes.
pub(crate) struct Supervisor {
    monitor: Monitor<f64, 8>,
    period: f64,
    encoder_step: f64,
    seen: [Joints<f64, 2>; 2],
    noise: Normal,
}

impl Supervisor {
    pub fn new(
        (period, encoder_bits): (f64, u32),
        safety: &Safety,
        required: &[JointMotion<2>],
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let interval = micros(period);
        let angle = |i: usize| {
            let range = required
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], m| {
                    [low.min(m.q[i]), high.max(m.q[i])]
                });
            let margin = safety.angle_margin;
            // One sample may stay the same by chance, two do not.
            MonitoredChannel::range(Quantity::Angle, range[0] - margin, range[1] + margin)
                .frozen_after(interval + interval / 2)
        };
        let speed = MonitoredChannel::magnitude(Quantity::Speed, safety.speed);
        let acceleration = MonitoredChannel::magnitude(Quantity::Acceleration, safety.acceleration);
        let force = MonitoredChannel::magnitude(Quantity::Force, safety.force);
        let channels = [
            angle(0),
            angle(1),
            speed,
            speed,
            acceleration,
            acceleration,
            force,
            force,
        ];
        Ok(Self {
            monitor: Monitor::new(
                channels,
                Times {
                    oldest: interval,
                    period: 2 * interval,
                },
            )?,
            period,
            encoder_step: encoder_step(encoder_bits),
            seen: [required[0].q; 2],
            noise: Normal::new(seed, 1 << 20),
        })
    }

    /// One control period, by the time of the supervisor's own clock, with data that come `late` \[s\].
    pub fn look(
        &mut self,
        k: usize,
        read: &Joints<f64, 2>,
        (wanted, force): (&JointMotion<2>, Plane<f64>),
        late: f64,
    ) -> Option<Stop<f64>> {
        let h = self.period;
        let [last, before] = self.seen;
        let speed = (read - last) / h;
        let acceleration = (read - last * 2.0 + before) / (h * h);
        let force = sensed(force, &mut self.noise);
        let jitter = (5.0 * self.noise.next().abs()).min(JITTER) as u64;
        // The clock starts at a second, so that late data have a time.
        let now = 1_000_000 + k as u64 * micros(h) + JITTER as u64;
        let moving = |i: usize| wanted.qd[i].abs() * h > MOVING_STEPS * self.encoder_step;
        self.seen = [*read, last];
        let seen = Observation {
            now,
            stamp: (now - jitter).saturating_sub(micros(late)),
            values: [
                read[0],
                read[1],
                speed[0],
                speed[1],
                acceleration[0],
                acceleration[1],
                force[0],
                force[1],
            ],
            moving: [
                moving(0),
                moving(1),
                false,
                false,
                false,
                false,
                false,
                false,
            ],
        };
        self.monitor.check(&seen).err()
    }
}

fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

/// What a force sensor reads \[N\].
pub(crate) fn sensed(force: Plane<f64>, noise: &mut Normal) -> Plane<f64> {
    let (deviation, range, bits) = FORCE_SENSOR;
    let step = 2.0 * range / (1_u64 << bits) as f64;
    force.map(|f| {
        let noisy = f + deviation * noise.next();
        ((noisy / step).round() * step).clamp(-range, range)
    })
}
