//! Joint motion for the regressors, from measured angles.
//!
//! Angles are low-passed with a zero-phase Butterworth filter of order [`ORDER`] and differentiated by central
//! differences. Speeds gained so are fit for motor encoders; with camera noise they read dry friction as zero, and the
//! motion has to be simulated instead (`simulated`).

use arm_core::Joints;

use crate::derivative;
use crate::equation::Kinematics;
use crate::error::IdentError;
use crate::filter::Butterworth;
use crate::trial::Trial;

/// Order of the low-pass filter, counted for a single pass; zero-phase filtering passes twice.
pub const ORDER: usize = 4;

/// Lowest cutoff that is chosen by itself \[Hz\], the thesis' own.
const LEAST_CUTOFF: f64 = 5.0;
/// Highest cutoff that is chosen by itself \[Hz\]; an arm does not move faster.
const LARGEST_CUTOFF: f64 = 30.0;

/// The low-pass that motion and torque share: −3 dB of both passes together at `cutoff` \[Hz\].
///
/// # Errors
/// [`IdentError::OutOfRange`] unless the cutoff lies between 0 and half the sampling rate.
pub fn low_pass(cutoff: f64, rate: f64) -> Result<Butterworth, IdentError> {
    Butterworth::for_both_ways(ORDER, cutoff, rate)
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
    let filter = low_pass(motion_cutoff(cutoff, trial.rate), trial.rate)?;
    let step = 1.0 / trial.rate;
    let mut motion = Kinematics {
        q: trial.q.clone(),
        qd: vec![Joints::zeros(); trial.len()],
        qdd: vec![Joints::zeros(); trial.len()],
    };
    for j in 0..N {
        let raw: Vec<f64> = trial.q.iter().map(|q| q[j]).collect();
        let q = filter.both_ways(&raw)?;
        let qd = derivative::first(&q, step)?;
        let qdd = derivative::second(&q, step)?;
        for i in 0..trial.len() {
            motion.qd[i][j] = qd[i];
            motion.qdd[i][j] = qdd[i];
        }
    }
    Ok(motion)
}

/// Standard deviation of the speed that measurement noise leaves after [`measured`], for each joint \[rad/s\].
///
/// The variance σ² of the angle noise is read off third differences, where motion vanishes and white noise has 20 σ².
/// Through an ideal low-pass its speed has the variance `σ² (2/f_s) (2π)² f_c³/3`.
pub fn speed_noise<const N: usize>(trial: &Trial<N>, cutoff: f64) -> [f64; N] {
    let cutoff = motion_cutoff(cutoff, trial.rate);
    core::array::from_fn(|j| {
        let third = |w: &[Joints<f64, N>]| w[3][j] - 3.0 * w[2][j] + 3.0 * w[1][j] - w[0][j];
        let (sum, count) = trial
            .q
            .windows(4)
            .fold((0.0, 0.0), |(s, n), w| (s + third(w) * third(w), n + 1.0));
        let angle: f64 = if count > 0.0 { sum / count / 20.0 } else { 0.0 };
        let two_pi = 2.0 * core::f64::consts::PI;
        libm::sqrt(angle * 2.0 / trial.rate * two_pi * two_pi * cutoff * cutoff * cutoff / 3.0)
    })
}

/// Cutoff frequencies to choose from \[Hz\]: from the thesis' own 5 Hz upwards by half, to a quarter of the lowest sampling rate.
///
/// A low cutoff bends fast motion (the filter does not commute with products of angles), a high one lets noise in.
pub fn candidates<const N: usize>(trials: &[&Trial<N>]) -> Vec<f64> {
    let rate = trials.iter().map(|t| t.rate).fold(f64::INFINITY, f64::min);
    let mut list = vec![LEAST_CUTOFF.min(rate / 4.0)];
    while list[list.len() - 1] * 1.5 <= (rate / 4.0).min(LARGEST_CUTOFF) {
        list.push(list[list.len() - 1] * 1.5);
    }
    list
}
