//! The path on which the robot leads the handle, from its angles.

use arm_core::Plane;
use arm_ident::regression::measured_motion::low_pass;

use crate::GapError;

/// Bandwidth of the path, in bandwidths of the comparison: a robot that shakes at the edge of the comparison must keep its whole swing, or
/// its forces are missed by newtons.
const WIDEST: f64 = 4.0;
/// Narrower ones, narrowest first, where the angles of the robot are read with noise.
const NARROWER: [f64; 4] = [1.0, 1.4, 2.0, 2.8];
/// Share of the sampling rate that the widest band may be: where samples hold hardly more, the path is as it is, for to take little noise
/// away would round what the robot does from one sample to the next.
const LARGEST: f64 = 0.4;
/// Share of the sampling rate above which the path of the quietest trial is noise.
const QUIET: f64 = 0.3;
/// Share of the noise of the force, in power, that noise of the path may become in the contact: more of it would be read as a softer one.
const HARMLESS: f64 = 0.05;
/// Most of the power that a narrower band takes away, in that of the noise.
const NOISE_ALONE: f64 = 2.0;

/// The path of the handle, low-passed without phase.
///
/// A stiff contact turns steps of coarse encoders into simulated forces that did not act. Where these are large, the path keeps the
/// narrowest band outside of which there is only noise.
/// * `noise` - see [`path_noise`]
/// * `forces` - force on the arm along y and z as measured \[N\], and stiffness of the contact along both \[N/m\]
/// * `band` - of the comparison \[Hz\]
///
/// # Errors
/// [`GapError::Numerics`] for a trial too short for the filters.
pub(super) fn handle_path(
    points: &[Plane<f64>],
    (noise, forces, stiffness): (Plane<f64>, &[Vec<f64>], Plane<f64>),
    band: f64,
    rate: f64,
) -> Result<Vec<Plane<f64>>, GapError> {
    if WIDEST * band >= LARGEST * rate {
        return Ok(points.to_vec());
    }
    let axes = axes_of(points);
    let of_force = densities(forces, QUIET * rate, rate, mean)?;
    let counts = |a: usize| stiffness[a] * stiffness[a] * noise[a] > HARMLESS * of_force[a];
    let mut kept = None;
    if counts(0) || counts(1) {
        for factor in NARROWER {
            let taken = densities(&axes, factor * band, rate, mean)?;
            if (0..2).all(|a| taken[a] <= NOISE_ALONE * noise[a]) {
                kept = Some(factor);
                break;
            }
        }
    }
    let factor = kept.unwrap_or(WIDEST);
    let smooth = low_pass(factor * band, rate)?.both_ways_all(&axes)?;
    Ok((0..points.len())
        .map(|i| [smooth[0][i], smooth[1][i]])
        .collect())
}

/// Noise of the path along y and z, in power for each hertz \[m²/Hz\]: what the quietest trial has at the top of its band, half of the time
/// at least. A fast movement still moves there, and a jolted one for moments.
///
/// * `paths` - with the sampling rate of each \[Hz\]
///
/// # Errors
/// [`GapError::Numerics`] for a trial too short for the filters.
pub(super) fn path_noise<'a>(
    paths: impl Iterator<Item = (&'a [Plane<f64>], f64)>,
) -> Result<Plane<f64>, GapError> {
    let mut least = [f64::INFINITY; 2];
    for (points, rate) in paths {
        let own = densities(&axes_of(points), QUIET * rate, rate, usual)?;
        for (least, own) in std::iter::zip(&mut least, own) {
            *least = least.min(own);
        }
    }
    Ok(least)
}

fn axes_of(points: &[Plane<f64>]) -> Vec<Vec<f64>> {
    let axis = |a: usize| points.iter().map(|p| p[a]).collect();
    vec![axis(0), axis(1)]
}

/// Power of each channel above a cutoff, for each hertz up to half of the sampling rate.
///
/// * `typical` - the typical value of squares
fn densities(
    channels: &[Vec<f64>],
    cutoff: f64,
    rate: f64,
    typical: impl Fn(Vec<f64>) -> f64,
) -> Result<Vec<f64>, GapError> {
    let low = low_pass(cutoff, rate)?.both_ways_all(channels)?;
    let power = |(channel, low): (&Vec<f64>, &Vec<f64>)| {
        let squares = std::iter::zip(channel, low).map(|(c, l)| (c - l) * (c - l));
        typical(squares.collect()) / (0.5 * rate - cutoff)
    };
    Ok(std::iter::zip(channels, &low).map(power).collect())
}

fn mean(squares: Vec<f64>) -> f64 {
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// The mean square of normal deviates with the median of these squares.
fn usual(mut squares: Vec<f64>) -> f64 {
    /// Median of the square of a standard normal deviate.
    const MEDIAN: f64 = 0.4549;
    let half = squares.len() / 2;
    *squares.select_nth_unstable_by(half, f64::total_cmp).1 / MEDIAN
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 100.0;

    /// A movement of 0.2 m within 4 s, with an oscillation of 6 Hz and pseudo-random numbers added.
    fn path(swing: f64, noise: f64) -> Vec<Plane<f64>> {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / (1_u64 << 24) as f64 - 0.5
        };
        let slow = |t: f64| 0.1 * libm::sin(core::f64::consts::TAU * 0.25 * t);
        (0..800)
            .map(|i| {
                let t = f64::from(i) / RATE;
                let y = slow(t) + swing * libm::sin(core::f64::consts::TAU * 6.0 * t);
                [y + noise * random(), 0.5 * slow(t) + noise * random()]
            })
            .collect()
    }

    fn off(led: &[Plane<f64>], from: &[Plane<f64>]) -> f64 {
        let inner = std::iter::zip(led, from).skip(50).take(700);
        inner.fold(0.0, |most, (a, b)| f64::max(most, (a[0] - b[0]).abs()))
    }

    fn widest(points: &[Plane<f64>]) -> Vec<Vec<f64>> {
        let filter = low_pass(WIDEST * 5.0, RATE).unwrap();
        filter.both_ways_all(&axes_of(points)).unwrap()
    }

    /// Beside a trial that is as noisy and does not swing.
    fn led(points: &[Plane<f64>], noise: f64) -> Vec<Plane<f64>> {
        let forces = axes_of(&path(0.0, 1.0));
        let trials = [points.to_vec(), path(0.0, noise)];
        let noise = path_noise(trials.iter().map(|t| (&t[..], RATE))).unwrap();
        handle_path(points, (noise, &forces, [9000.0; 2]), 5.0, RATE).unwrap()
    }

    #[test]
    fn steps_of_coarse_encoders_are_taken_out_and_a_swing_is_kept() {
        let coarse = 5e-4;
        let quiet = path(0.0, 0.0);
        let (as_read, smoothed) = (path(0.0, coarse), led(&path(0.0, coarse), coarse));
        assert!(off(&as_read, &quiet) > 2.4e-4 && off(&smoothed, &quiet) < 1.7e-4);
        // Of a swing of 2 mm at 6 Hz next to nothing is lost.
        assert!(off(&led(&path(2e-3, coarse), coarse), &path(2e-3, 0.0)) < 2.5e-4);
    }

    /// A movement that swings beyond 0.3 of the sampling rate is none, where another trial is quiet.
    #[test]
    fn a_fast_movement_is_not_noise() {
        let shaken: Vec<_> = (0..800)
            .map(|i| {
                [
                    1e-3 * libm::sin(core::f64::consts::TAU * 35.0 * f64::from(i) / RATE),
                    0.0,
                ]
            })
            .collect();
        let widest = widest(&shaken);
        assert!(
            led(&shaken, 1e-7)
                .iter()
                .zip(&widest[0])
                .all(|(p, w)| p[0] == *w)
        );
    }

    /// Nor is one that is jolted, though all are.
    #[test]
    fn a_jolted_movement_is_not_noise() {
        let jolted: Vec<_> = path(0.0, 0.0)
            .into_iter()
            .enumerate()
            .map(|(i, p)| [p[0] + 1e-3 * f64::from(u8::from(i % 200 == 100)), p[1]])
            .collect();
        let noise = path_noise([(&jolted[..], RATE)].into_iter()).unwrap();
        let forces = axes_of(&path(0.0, 1.0));
        let led = handle_path(&jolted, (noise, &forces, [9000.0; 2]), 5.0, RATE).unwrap();
        let widest = widest(&jolted);
        assert!(led.iter().zip(&widest[0]).all(|(p, w)| p[0] == *w));
    }

    #[test]
    fn fine_encoders_leave_the_widest_band() {
        let fine = path(2e-3, 1e-7);
        let widest = widest(&fine);
        assert!(
            led(&fine, 1e-7)
                .iter()
                .zip(&widest[0])
                .all(|(p, w)| p[0] == *w)
        );
    }
}
