//! Joint motion for the regressors, from measured angles.
//!
//! Speeds are those measured where there are some. Elsewhere angles are low-passed with a zero-phase Butterworth filter of
//! order [`ORDER`] and differentiated by central differences. Speeds gained so are fit for motor encoders; with camera noise
//! they misread dry friction, and the motion has to be simulated instead (`simulated`), or the cutoff lowered
//! ([`relative_speed_noise`]).

use arm_core::effect::Effect;
use arm_core::{Joints, Plane};

use crate::error::IdentError;
use crate::regression::kinematics::Kinematics;
use crate::regression::trial::{Model, Trial};
use arm_numerics::signal::derivative;
use arm_numerics::signal::filter::Butterworth;

/// Order of the low-pass filter, counted for a single pass; zero-phase filtering passes twice.
pub const ORDER: usize = 4;

/// Lowest cutoff that is chosen by itself \[Hz\], the thesis' own.
const LEAST_CUTOFF: f64 = 5.0;
/// Highest cutoff that is chosen by itself \[Hz\]; an arm does not move faster.
const LARGEST_CUTOFF: f64 = 30.0;

/// The low-pass that motion and torque share: −3 dB of both passes together at `cutoff` \[Hz\].
///
/// # Errors
/// [`NumericsError::OutOfRange`](arm_numerics::NumericsError::OutOfRange) unless the cutoff lies between 0 and half the sampling rate.
pub fn low_pass(cutoff: f64, rate: f64) -> Result<Butterworth, IdentError> {
    Ok(Butterworth::for_both_ways(ORDER, cutoff, rate)?)
}

/// How far a measured path of the first joint is from the place of the base \[m\], low-passed at 5 Hz, or a fifth of a low sampling rate:
/// what is faster would be noise in its acceleration.
///
/// # Errors
/// [`IdentError`] for a path too short for the filter or not finite.
pub fn displacement_of_base(
    path: &[Plane<f64>],
    place: Plane<f64>,
    rate: f64,
) -> Result<Vec<Plane<f64>>, IdentError> {
    let filter = low_pass(LEAST_CUTOFF.min(0.2 * rate), rate)?;
    let axis = |a: usize| path.iter().map(|p| p[a] - place[a]).collect::<Vec<_>>();
    let smooth = filter.both_ways_all(&[axis(0), axis(1)])?;
    let pairs = std::iter::zip(&smooth[0], &smooth[1]);
    Ok(pairs.map(|(&y, &z)| [y, z]).collect())
}

/// Bandwidth of the motion, in bandwidths of the rows.
///
/// The rows are low-passed as a whole, so every factor of a column may be filtered only that once: the motion itself keeps
/// a band so wide that its own filter does not count, yet narrow enough for differentiation.
const MOTION_BAND: f64 = 3.0;

/// Cutoff of the low-pass before differentiation, for rows that are low-passed at `cutoff` \[Hz\].
pub fn motion_cutoff(cutoff: f64, rate: f64) -> f64 {
    (MOTION_BAND * cutoff).min(0.4 * rate)
}

/// Measured angles as they are, with speeds and accelerations from low-passed ones.
///
/// * `cutoff` - of the rows in which the motion is used \[Hz\], see [`motion_cutoff`]
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter or a cutoff above half the sampling rate.
pub fn measured<const N: usize>(
    trial: &Trial<N>,
    cutoff: f64,
) -> Result<Kinematics<N>, IdentError> {
    let band = motion_cutoff(cutoff, trial.rate);
    let filter = low_pass(band, trial.rate)?;
    let step = 1.0 / trial.rate;
    let mut motion = Kinematics {
        q: trial.q.clone(),
        qd: vec![Joints::zeros(); trial.len()],
        qdd: vec![Joints::zeros(); trial.len()],
        base: base_acceleration(trial, &filter)?,
        rest: speed_noise(trial, band).map(slowest),
        force: None,
    };
    for j in 0..N {
        let qd = speed(trial, j, &filter)?;
        let qdd = match &trial.speed {
            Some(_) => derivative::first(&qd, step)?,
            None => derivative::second(&filter.both_ways(&channel(&trial.q, j))?, step)?,
        };
        for i in 0..trial.len() {
            motion.qd[i][j] = qd[i];
            motion.qdd[i][j] = qdd[i];
        }
    }
    Ok(motion)
}

/// Low-passed speed of one joint \[rad/s\]: the measured one where there is one, else the derivative of the angle.
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub(crate) fn speed<const N: usize>(
    trial: &Trial<N>,
    joint: usize,
    filter: &Butterworth,
) -> Result<Vec<f64>, IdentError> {
    match &trial.speed {
        Some(speed) => Ok(filter.both_ways(&channel(speed, joint))?),
        None => Ok(derivative::first(
            &filter.both_ways(&channel(&trial.q, joint))?,
            1.0 / trial.rate,
        )?),
    }
}

/// Acceleration of the first joint \[m/s²\], from its low-passed path where that was measured.
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub(crate) fn base_acceleration<const N: usize>(
    trial: &Trial<N>,
    filter: &Butterworth,
) -> Result<Option<Vec<Plane<f64>>>, IdentError> {
    let Some(path) = &trial.base else {
        return Ok(None);
    };
    let axis = |a: usize| -> Result<Vec<f64>, IdentError> {
        let along: Vec<f64> = path.iter().map(|p| p[a]).collect();
        Ok(derivative::second(
            &filter.both_ways(&along)?,
            1.0 / trial.rate,
        )?)
    };
    let (y, z) = (axis(0)?, axis(1)?);
    Ok(Some(y.into_iter().zip(z).map(|(y, z)| [y, z]).collect()))
}

/// One joint's values.
fn channel<const N: usize>(rows: &[Joints<f64, N>], joint: usize) -> Vec<f64> {
    rows.iter().map(|row| row[joint]).collect()
}

/// Standard deviation of the speed that measurement noise leaves below a cutoff, for each joint \[rad/s\].
///
/// The variance σ² of the noise is estimated from third differences, where motion vanishes and white noise has 20 σ². An ideal
/// low-pass of a measured speed leaves the share `2 f_c/f_s` of it; of an angle, the speed has the variance
/// `σ² (2/f_s) (2π)² f_c³/3`.
///
/// * `cutoff` - of the low-pass that the speed went through \[Hz\]
pub fn speed_noise<const N: usize>(trial: &Trial<N>, cutoff: f64) -> [f64; N] {
    let per_rate = 2.0 * cutoff / trial.rate;
    let (rows, gain) = match &trial.speed {
        Some(speed) => (speed, per_rate),
        None => {
            let omega = 2.0 * core::f64::consts::PI * cutoff;
            (&trial.q, per_rate * omega * omega / 3.0)
        }
    };
    core::array::from_fn(|j| {
        let third = |w: &[Joints<f64, N>]| w[3][j] - 3.0 * w[2][j] + 3.0 * w[1][j] - w[0][j];
        let (sum, count) = rows
            .windows(4)
            .fold((0.0, 0.0), |(s, n), w| (s + third(w) * third(w), n + 1.0));
        let variance: f64 = if count > 0.0 { sum / count / 20.0 } else { 0.0 };
        libm::sqrt(variance * gain)
    })
}

/// Noise of each joint's speed over the speed, both root mean square over all trials, for rows low-passed at `cutoff` \[Hz\].
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub fn relative_speed_noise<const N: usize>(
    trials: &[&Trial<N>],
    cutoff: f64,
) -> Result<[f64; N], IdentError> {
    let (mut noise, mut moving) = ([0.0; N], [0.0; N]);
    for trial in trials {
        let band = motion_cutoff(cutoff, trial.rate);
        let (filter, own) = (low_pass(band, trial.rate)?, speed_noise(trial, band));
        for j in 0..N {
            noise[j] += own[j] * own[j] * trial.len() as f64;
            moving[j] += speed(trial, j, &filter)?.iter().map(|v| v * v).sum::<f64>();
        }
    }
    Ok(core::array::from_fn(|j| {
        if moving[j] > 0.0 {
            libm::sqrt(noise[j] / moving[j])
        } else {
            0.0
        }
    }))
}

/// Noise of a speed above this share of the speed biases estimates from speeds by more than their intervals.
pub const QUIET: f64 = 0.05;
/// Lowest cutoff that is chosen by itself because of noise \[Hz\].
const LOWEST_CUTOFF: f64 = 0.5;
/// Periods of the cutoff frequency that the shortest trial has at least, where the cutoff is lowered because of noise.
const FEWEST_PERIODS: f64 = 10.0;
/// Factor between candidates.
const SPACING: f64 = 1.5;

/// Cutoff frequencies to choose from \[Hz\]: from the thesis' own 5 Hz upwards by half, to a quarter of the lowest sampling rate.
///
/// A low cutoff distorts fast motion (the filter does not commute with products of angles), a high one passes noise.
pub fn candidates<const N: usize>(trials: &[&Trial<N>]) -> Vec<f64> {
    let rate = trials.iter().map(|t| t.rate).fold(f64::INFINITY, f64::min);
    let mut list = vec![LEAST_CUTOFF.min(rate / 4.0)];
    while list[list.len() - 1] * SPACING <= (rate / 4.0).min(LARGEST_CUTOFF) {
        list.push(list[list.len() - 1] * SPACING);
    }
    list
}

/// The [`candidates`] for measured motion: where speeds are noise to a good part, lower ones, down to the first that is quiet.
///
/// # Errors
/// [`IdentError`] for a trial too short for the filter.
pub fn candidates_of_measured<const N: usize>(
    trials: &[&Trial<N>],
) -> Result<Vec<f64>, IdentError> {
    let mut list = candidates(trials);
    let shortest = trials
        .iter()
        .map(|t| t.len() as f64 / t.rate)
        .fold(f64::INFINITY, f64::min);
    let lowest = f64::max(LOWEST_CUTOFF, FEWEST_PERIODS / shortest);
    while list[0] / SPACING >= lowest && !is_quiet(&relative_speed_noise(trials, list[0])?) {
        list.insert(0, list[0] / SPACING);
    }
    Ok(list)
}

/// Whether estimates from speeds with this relative noise have a negligible bias, see [`QUIET`].
pub fn is_quiet(relative_noise: &[f64]) -> bool {
    relative_noise.iter().all(|&share| share <= QUIET)
}

/// A joint moves where its speed is this many standard deviations of the speed's noise; dry friction is smoothed over as many.
const DEAD_BAND: f64 = 3.0;

/// Slowest speed that counts as motion \[rad/s\], with this noise of the speed.
pub(crate) fn slowest(noise: f64) -> f64 {
    /// At any noise.
    const LEAST: f64 = 1e-4;
    f64::max(DEAD_BAND * noise, LEAST)
}

/// The model with smooth dry friction that changes its sign no faster than the noise of measured speeds.
pub(crate) fn widened<'a, const N: usize>(
    model: &Model<N>,
    trials: impl Iterator<Item = &'a Trial<N>>,
    cutoff: f64,
) -> Model<N> {
    let mut model = model.clone();
    for trial in trials {
        let noise = speed_noise(trial, motion_cutoff(cutoff, trial.rate));
        for effect in model.fitted.iter_mut().chain(&mut model.held) {
            let noise = noise.get(effect.index).copied().unwrap_or(0.0);
            if !effect.is_dry() {
                widen(effect, DEAD_BAND * noise);
            }
        }
    }
    model
}

/// Raises the smoothing speed of an effect that has one, within its bounds.
fn widen(effect: &mut Effect<f64>, least: f64) {
    for (value, parameter) in effect
        .parameters
        .iter_mut()
        .zip(effect.kind.info().parameters)
    {
        if parameter.name == "smoothing" {
            *value = value.max(least).min(parameter.max);
        }
    }
}
