//! What is read of a trial.

use crate::effect::{Hidden, Law, Sensing};
use crate::little_known::Slip;
use crate::motion::STEPS;
use crate::random::Random;
use crate::rig::Plane;
use crate::run::Truth;

/// Noise of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Of an angle of the arm \[rad\].
    pub angle: f64,
    /// Of a force \[N\].
    pub force: f64,
    /// Correlation of one sample with the next: 0 for white noise.
    pub memory: f64,
    /// Samples a second \[Hz\].
    pub rate: f64,
    /// Smallest step of a force \[N\] and of an angle \[rad\], 0 for none.
    pub quantum: [f64; 2],
    /// Of a joint angle of the robot \[rad\], besides the steps of its encoder.
    pub encoder: f64,
}

/// One part of a turn of a robot's encoder: 20 bit.
const ENCODER: f64 = core::f64::consts::TAU / (1 << 20) as f64;

/// What the calibration left, within what it promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// \[rad\]
    pub angle_offset: Vec<f64>,
    /// \[N\]
    pub force_bias: Plane,
    /// Relative.
    pub force_gain: Plane,
    /// Of the forces behind the angles \[s\].
    pub delay: f64,
}

/// What a calibration promises: the defaults of a data set.
pub mod tolerance {
    /// \[°\]
    pub const ANGLE_OFFSET: f64 = 0.3;
    /// \[N\]
    pub const FORCE_BIAS: f64 = 0.2;
    /// Relative.
    pub const FORCE_GAIN: f64 = 0.01;
    /// \[s\]
    pub const TIME_DELAY: f64 = 0.005;
    /// \[m\]
    pub const PLACEMENT: f64 = 0.001;
}

impl Calibration {
    /// Half of what is allowed is a standard deviation, and nothing lies beyond it.
    pub fn draw(joints: usize, random: &mut Random) -> Self {
        let mut error = |allowed: f64| 0.5 * allowed * random.limited_normal(2.0);
        Self {
            angle_offset: (0..joints)
                .map(|_| error(tolerance::ANGLE_OFFSET.to_radians()))
                .collect(),
            force_bias: [error(tolerance::FORCE_BIAS), error(tolerance::FORCE_BIAS)],
            force_gain: [error(tolerance::FORCE_GAIN), error(tolerance::FORCE_GAIN)],
            delay: error(tolerance::TIME_DELAY),
        }
    }

    /// No errors.
    pub fn perfect(joints: usize) -> Self {
        Self {
            angle_offset: vec![0.0; joints],
            force_bias: [0.0; 2],
            force_gain: [0.0; 2],
            delay: 0.0,
        }
    }
}

/// What stands in a file, a row a sample.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    /// \[s\]
    pub time: Vec<f64>,
    /// \[rad\]
    pub q: Vec<Vec<f64>>,
    /// Force on the arm \[N\].
    pub force_on_arm: Vec<Plane>,
    /// \[rad\]
    pub robot: Vec<Plane>,
}

impl Noise {
    /// Reads at another rate; slow noise keeps the time in which it fades.
    pub fn resample(&mut self, rate: f64) {
        self.memory = libm::pow(self.memory, self.rate / rate);
        self.rate = rate;
    }
}

impl Readings {
    /// Keeps the first part of a trial.
    pub fn keep(&mut self, part: f64) {
        let count = libm::round(part * self.time.len() as f64) as usize;
        self.time.truncate(count);
        self.q.truncate(count);
        self.force_on_arm.truncate(count);
        self.robot.truncate(count);
    }
}

/// Reads a trial.
///
/// * `elapsed` - part of the session that is over when it begins, and when it ends
/// * `slip` - what slips in this trial
pub fn read(
    truth: &Truth,
    hidden: &[Hidden],
    calibration: &Calibration,
    noise: &Noise,
    (elapsed, slip): ([f64; 2], Option<Slip>),
    random: &mut Random,
) -> Readings {
    let faults: Vec<(&Hidden, Sensing)> = hidden
        .iter()
        .filter_map(|h| match h.law {
            Law::Sensing(fault) => Some((h, fault)),
            _ => None,
        })
        .collect();
    let late = faults.iter().fold(calibration.delay, |sum, (_, fault)| {
        if let Sensing::Delay(delay) = fault {
            sum + delay
        } else {
            sum
        }
    });
    let forces = lagging(truth, &faults);
    let joints = calibration.angle_offset.len();
    let mut angle_noise: Vec<_> = (0..joints)
        .map(|_| Coloured::new(noise.angle, noise.memory))
        .collect();
    let mut force_noise = [Coloured::new(noise.force, noise.memory); 2];
    let records = libm::round(STEPS / noise.rate) as usize / truth.kept;
    let samples = (truth.q.len() - 1) / records + 1;
    let mut readings = Readings::default();
    for k in 0..samples {
        let time = k as f64 / noise.rate;
        let mut q = truth.q[k * records].clone();
        let mut force = between(&forces, (time - late) * STEPS / truth.kept as f64);
        let passed = elapsed[0] + (elapsed[1] - elapsed[0]) * k as f64 / samples as f64;
        for (hidden, fault) in &faults {
            distort(hidden, *fault, (time, passed), &mut q, &mut force);
        }
        if let Some(Slip::Angle(start, joint, by)) = slip
            && time >= start
        {
            q[joint] += by;
        }
        for (j, q) in q.iter_mut().enumerate() {
            let read = *q + calibration.angle_offset[j] + angle_noise[j].next(random);
            *q = quantised(read, noise.quantum[1]);
        }
        for c in 0..2 {
            let read = (1.0 + calibration.force_gain[c]) * force[c]
                + calibration.force_bias[c]
                + force_noise[c].next(random);
            force[c] = quantised(read, noise.quantum[0]);
        }
        let robot = truth.robot[k * records]
            .map(|q| quantised(q + noise.encoder * random.normal(), ENCODER));
        readings.time.push(time);
        readings.q.push(q);
        readings.force_on_arm.push(force);
        readings.robot.push(robot);
    }
    readings
}

fn distort(
    hidden: &Hidden,
    fault: Sensing,
    (time, passed): (f64, f64),
    q: &mut [f64],
    force: &mut Plane,
) {
    let (joint, channel) = (hidden.joint.unwrap_or(0), hidden.channel.unwrap_or(0));
    match fault {
        Sensing::Bias(bias) => force[channel] += bias,
        Sensing::Drift(rate) => force[channel] += rate * time,
        Sensing::Gain(gain) => force[channel] *= 1.0 + gain,
        Sensing::Turn(angle) => {
            let ((sin, cos), [y, z]) = (libm::sincos(angle), *force);
            *force = [y * cos - z * sin, y * sin + z * cos];
        }
        Sensing::Offset(offset) => q[joint] += offset,
        Sensing::WarmingAngle([gain, about]) => q[joint] += gain * passed * (q[joint] - about),
        // Before sampling: see `lagging` and `late`.
        Sensing::Delay(_) | Sensing::Hysteresis(_) => {}
    }
}

/// Forces after the play operator of a sensor with hysteresis.
fn lagging(truth: &Truth, faults: &[(&Hidden, Sensing)]) -> Vec<Plane> {
    let mut forces = truth.force_on_arm.clone();
    for (hidden, fault) in faults {
        if let Sensing::Hysteresis(width) = fault {
            let c = hidden.channel.unwrap_or(0);
            let mut held = forces[0][c];
            for force in &mut forces {
                held = held.clamp(force[c] - width, force[c] + width);
                force[c] = held;
            }
        }
    }
    forces
}

/// A value between two records; before the first and after the last it stands.
fn between(forces: &[Plane], place: f64) -> Plane {
    let place = place.clamp(0.0, (forces.len() - 1) as f64);
    let first = (place as usize).min(forces.len() - 2);
    let part = place - first as f64;
    core::array::from_fn(|c| forces[first][c] + part * (forces[first + 1][c] - forces[first][c]))
}

fn quantised(value: f64, quantum: f64) -> f64 {
    if quantum > 0.0 {
        libm::round(value / quantum) * quantum
    } else {
        value
    }
}

/// White noise, or a first-order autoregression, of a given standard deviation.
#[derive(Clone, Copy, Debug)]
struct Coloured {
    deviation: f64,
    memory: f64,
    last: Option<f64>,
}

impl Coloured {
    fn new(deviation: f64, memory: f64) -> Self {
        Self {
            deviation,
            memory,
            last: None,
        }
    }

    fn next(&mut self, random: &mut Random) -> f64 {
        let fresh = self.deviation * random.normal();
        let value = match self.last {
            None => fresh,
            Some(last) => self.memory * last + (1.0 - self.memory * self.memory).sqrt() * fresh,
        };
        self.last = Some(value);
        value
    }
}
