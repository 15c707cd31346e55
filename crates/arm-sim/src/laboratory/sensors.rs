//! Sensor readings of a run.

use arm_core::{Joints, Reading};

use crate::laboratory::noise::{Normal, SensorNoise};
use crate::{Experiment, Recording, SimulationError, cubic_weights};

/// One channel of a sensor: noise, then quantisation, then saturation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorChannel {
    /// Standard deviation of the noise, in the unit of the channel; zero for none.
    pub deviation: f64,
    /// Time in which the correlation of the noise falls to 1/e \[s\]; zero for white noise.
    pub correlation_time: f64,
    /// Largest magnitude that is read; infinite for no limit.
    pub range: f64,
    /// Bits over the whole range from −range to range; `None` for no quantisation.
    pub bits: Option<u32>,
}

impl SensorChannel {
    /// A channel that reads the true value.
    pub const IDEAL: Self = Self {
        deviation: 0.0,
        correlation_time: 0.0,
        range: f64::INFINITY,
        bits: None,
    };

    /// A channel with white noise and nothing else.
    pub const fn white(deviation: f64) -> Self {
        Self {
            deviation,
            ..Self::IDEAL
        }
    }

    fn validate(&self) -> Result<(), SimulationError> {
        let refuse = |name, found, allowed| {
            Err(SimulationError::Setting {
                name,
                found,
                allowed,
            })
        };
        for (name, found) in [
            ("deviation of sensor noise", self.deviation),
            ("correlation time of sensor noise", self.correlation_time),
        ] {
            if !(found >= 0.0 && found.is_finite()) {
                return refuse(name, found, "zero or more");
            }
        }
        if self.range.is_nan() || self.range <= 0.0 {
            return refuse("range of a sensor", self.range, "more than zero");
        }
        match self.bits {
            Some(bits) if !(1..=52).contains(&bits) => {
                refuse("bits of a sensor", f64::from(bits), "1 to 52")
            }
            Some(_) if self.range.is_infinite() => {
                refuse("range of a quantised sensor", self.range, "finite")
            }
            _ => Ok(()),
        }
    }

    fn read(&self, value: f64) -> f64 {
        let quantised = match self.bits {
            Some(bits) => {
                let step = 2.0 * self.range / (1u64 << bits) as f64;
                (value / step).round() * step
            }
            None => value,
        };
        quantised.clamp(-self.range, self.range)
    }
}

/// The sensors of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors<const N: usize> {
    /// Samples a second \[Hz\].
    pub rate: f64,
    /// Number from which all noise follows.
    pub seed: u64,
    /// Joint angles of the arm \[rad\].
    pub angle: [SensorChannel; N],
    /// Force on the arm, y and z \[N\].
    pub force: [SensorChannel; 2],
    /// Moment on the arm \[N m\].
    pub moment: SensorChannel,
    /// Joint angles of the robot \[rad\].
    pub robot: [SensorChannel; 2],
    /// Torques of motors in the joints \[N m\].
    pub torque: [SensorChannel; N],
}

impl<const N: usize> Sensors<N> {
    /// Sensors that read the truth at 50 Hz, the rate of the thesis.
    pub fn ideal() -> Self {
        Self {
            rate: 50.0,
            seed: 0,
            angle: [SensorChannel::IDEAL; N],
            force: [SensorChannel::IDEAL; 2],
            moment: SensorChannel::IDEAL,
            robot: [SensorChannel::IDEAL; 2],
            torque: [SensorChannel::IDEAL; N],
        }
    }

    /// Channels in the order of their random streams: a channel that is added later leaves the noise of the others as it is.
    fn channels(&self) -> impl Iterator<Item = (u64, &SensorChannel)> {
        let group = |first: u64, channels| std::iter::zip(first.., channels);
        group(0, self.force.as_slice())
            .chain(group(2, std::slice::from_ref(&self.moment)))
            .chain(group(4, self.robot.as_slice()))
            .chain(group(16, self.angle.as_slice()))
            .chain(group(1 << 16, self.torque.as_slice()))
    }

    /// Reads a run: `experiment` for its effects and the delay of the force channels, `recording` for what happened.
    ///
    /// For every sample in this order: the physical value, with forces interpolated at their delayed time; the effects
    /// that distort readings, as listed in the experiment; noise; quantisation; saturation. Between recorded samples
    /// values are interpolated by a cubic through four of them, before the first and after the last they hold, so a run
    /// should be recorded at least as finely as it is read.
    ///
    /// # Errors
    /// [`SimulationError`] for a rate, a channel or a recording that cannot be used.
    pub fn read(
        &self,
        experiment: &Experiment<N>,
        recording: &Recording<N>,
    ) -> Result<Readings<N>, SimulationError> {
        if !(self.rate > 0.0 && self.rate.is_finite()) {
            return Err(SimulationError::Setting {
                name: "rate of the sensors",
                found: self.rate,
                allowed: "a positive number of hertz",
            });
        }
        let interval = 1.0 / self.rate;
        let mut noises = Vec::new();
        for (stream, channel) in self.channels() {
            channel.validate()?;
            let (deviation, time) = (channel.deviation, channel.correlation_time);
            let normal = Normal::new(self.seed, stream);
            noises.push((channel, SensorNoise::new(normal, deviation, time, interval)));
        }
        let clock = Clock::of(&recording.time)?;
        if recording.force_on_arm.is_empty() {
            return Err(SimulationError::Samples {
                name: "contact force",
                sample: 1,
                problem: "the motion alone was recorded",
            });
        }
        let delay = experiment.altered()?.force_delay;

        let mut readings = Readings::default();
        let has_robot = !recording.robot_q.is_empty();
        let has_motors = recording.torque.drive.iter().any(|t| *t != 0.0);
        for k in 0.. {
            let time = k as f64 * interval;
            if time > clock.end() {
                break;
            }
            let at = |column: &[f64], width: usize, entry: usize, time: f64| {
                clock.value(time, |sample| column[width * sample + entry])
            };
            let mut reading = Reading::<f64, N> {
                time,
                q: Joints::from_fn(|j, _| at(&recording.q, N, j, time)),
                force_on_arm: [0, 1].map(|i| at(&recording.force_on_arm, 2, i, time - delay)),
                moment_on_arm: at(&recording.moment_on_arm, 1, 0, time - delay),
            };
            for effect in &experiment.effects {
                effect.distort(&mut reading);
            }
            let mut channels = noises.iter_mut();
            let mut sense = |value: f64| match channels.next() {
                Some((channel, noise)) => channel.read(value + noise.next()),
                None => value,
            };
            readings.time.push(time);
            readings
                .force_on_arm
                .extend(reading.force_on_arm.map(&mut sense));
            readings.moment_on_arm.push(sense(reading.moment_on_arm));
            for i in 0..2 {
                let value = if has_robot {
                    at(&recording.robot_q, 2, i, time)
                } else {
                    0.0
                };
                let read = sense(value);
                readings.robot_q.extend(has_robot.then_some(read));
            }
            readings.q.extend(reading.q.iter().map(|q| sense(*q)));
            for j in 0..N {
                let read = sense(at(&recording.torque.drive, N, j, time));
                readings.torque.extend(has_motors.then_some(read));
            }
        }
        Ok(readings)
    }
}

/// What the sensors read, ready to be written as a trial; columns as in [`Recording`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings<const N: usize> {
    /// Time \[s\], `(n)`.
    pub time: Vec<f64>,
    /// Joint angles \[rad\], `(n, N)`.
    pub q: Vec<f64>,
    /// Force on the arm \[N\], `(n, 2)`.
    pub force_on_arm: Vec<f64>,
    /// Moment on the arm \[N m\], `(n)`.
    pub moment_on_arm: Vec<f64>,
    /// Joint angles of the robot \[rad\], `(n, 2)`; empty without a robot.
    pub robot_q: Vec<f64>,
    /// Torques of motors \[N m\], `(n, N)`; empty where none drives.
    pub torque: Vec<f64>,
}

/// The even times of a recording.
struct Clock {
    interval: f64,
    last: usize,
}

impl Clock {
    fn of(times: &[f64]) -> Result<Self, SimulationError> {
        if times.len() < 4 {
            return Err(SimulationError::Samples {
                name: "recording",
                sample: times.len(),
                problem: "at least four samples are needed",
            });
        }
        let last = times.len() - 1;
        Ok(Self {
            interval: times[last] / last as f64,
            last,
        })
    }

    fn end(&self) -> f64 {
        (self.last as f64 + ROUNDING) * self.interval
    }

    /// A column at any time; exactly a recorded value at its time.
    fn value(&self, time: f64, column: impl Fn(usize) -> f64) -> f64 {
        let place = (time / self.interval).clamp(0.0, self.last as f64);
        let nearest = place.round();
        if (place - nearest).abs() <= ROUNDING {
            return column(nearest as usize);
        }
        let first = (place.floor() as usize).clamp(1, self.last - 2) - 1;
        let weights = cubic_weights(place - first as f64);
        let four = weights.into_iter().zip(first..);
        four.map(|(weight, sample)| weight * column(sample)).sum()
    }
}

/// Part of an interval that counts as none: times are products of decimal numbers.
const ROUNDING: f64 = 1e-6;
