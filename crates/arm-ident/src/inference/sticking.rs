//! Whether dry friction sticks: the smooth law and the set-valued one are compared by the motion and the force of simulated runs.
//!
//! Torques cannot decide. Where a joint sticks nothing follows from its row, so the set-valued law would be judged by fewer of them.

use arm_core::effect::Effect;
use arm_numerics::least_squares::outcome::Outcome;

use crate::error::IdentError;
use crate::regression::measured_motion::low_pass;
use crate::regression::simulated_motion::simulated;
use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::{Unknown, delay};
use crate::threads::parallel;

/// The model with set-valued friction in place of fitted smooth friction whose smoothing speed is the default: that serves an explicit
/// step and is no property of an arm, see `arm-core`. `None` without such an effect.
pub(crate) fn sticking<const N: usize>(model: &Model<N>) -> Option<Model<N>> {
    let mut other = model.clone();
    let mut changed = false;
    for effect in other.fitted.iter_mut().filter(|e| e.parameters[0] > 0.0) {
        if let Some(smoothing) = effect.kind.smoothed_by()
            && is_default(effect, smoothing)
        {
            effect.parameters[smoothing] = 0.0;
            changed = true;
        }
    }
    changed.then_some(other)
}

fn is_default(effect: &Effect<f64>, parameter: usize) -> bool {
    effect.parameters[parameter] == effect.kind.info().parameters[parameter].default
}

/// How far simulated runs are from what was measured: twice the negative logarithm of the likelihood of angles and forces, but for a
/// constant, with the variances that the differences themselves have. What stays the same in a trial, as offsets do, does not count.
///
/// * `cutoff` - of the common low-pass \[Hz\]
/// * `threads` - over which trials are spread; the result has the same bits for any number
///
/// # Errors
/// [`IdentError`] for a trial that cannot be simulated or is too short for the filter.
pub(crate) fn misfit<const N: usize>(
    (model, unknowns, found): (&Model<N>, &[Unknown], &Outcome),
    trials: &[&Trial<N>],
    (cutoff, threads): (f64, usize),
) -> Result<f64, IdentError> {
    let delay = delay(unknowns, &found.x);
    let one = |k: usize| squares(model, trials[k], (cutoff, delay));
    let mut squares = vec![0.0; N + 2];
    for own in parallel(threads, trials.len(), one) {
        for (sum, own) in squares.iter_mut().zip(own?) {
            *sum += own;
        }
    }
    let valid = |t: &&Trial<N>| t.valid.iter().filter(|v| **v).count() as f64;
    let count: f64 = trials.iter().map(valid).sum();
    let duration: f64 = trials.iter().map(|t| valid(t) / t.rate).sum();
    // A band has room for so many independent samples.
    let independent = f64::min(2.0 * cutoff * duration, count);
    let logarithms = squares.iter().filter(|s| **s > 0.0);
    Ok(independent * logarithms.map(|s| libm::log(s / count)).sum::<f64>())
}

/// Sums of squares of what simulated angles and forces of a trial differ by from the measured ones, low-passed, without their means.
fn squares<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    (cutoff, delay): (f64, f64),
) -> Result<Vec<f64>, IdentError> {
    let course = simulated(model, trial, cutoff)?;
    let mut differences = vec![Vec::with_capacity(trial.len()); N + 2];
    let (angles, forces) = (course.angles_at_samples(), course.force_at_samples());
    for (i, (q, force)) in angles.zip(forces).enumerate() {
        for j in 0..N {
            differences[j].push(trial.q[i][j] - q[j]);
        }
        let measured = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
        let delayed = course.change_by_delay(delay, i);
        for axis in 0..2 {
            differences[N + axis].push(measured[axis] - force[axis] - delayed[axis]);
        }
    }
    let smooth = low_pass(cutoff, trial.rate)?.both_ways_all(&differences)?;
    let square = |channel: &Vec<f64>| {
        let counted = || {
            channel
                .iter()
                .zip(&trial.valid)
                .filter(|(_, valid)| **valid)
        };
        let mean = counted().map(|(v, _)| v).sum::<f64>() / counted().count().max(1) as f64;
        counted().map(|(v, _)| (v - mean) * (v - mean)).sum()
    };
    Ok(smooth.iter().map(square).collect())
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;
    use arm_core::{Chain, Contact, Segment};

    use super::*;

    #[test]
    fn only_the_default_smoothing_of_friction_that_was_found_is_taken_for_none() {
        let of = |torque: f64, smoothing: f64| {
            Effect::<f64>::new(Kind::Coulomb, 0).with(&[torque, smoothing])
        };
        let segment = Segment {
            length: 0.3,
            mass: 1.0,
            com: [0.15, 0.0],
            inertia: 0.01,
        };
        let model = |fitted: Vec<Effect<f64>>| Model::<1> {
            chain: Chain::new([segment], [0.0; 2], [0.0, -9.81]).expect("an arm"),
            segment_uncertainty: 0.1,
            fitted,
            held: Vec::new(),
            contact: Contact::new([1e4; 2], [25.0; 2]),
        };
        let smoothing = Kind::Coulomb.smoothed_by().expect("smooth");
        let default = Kind::Coulomb.info().parameters[smoothing].default;
        let changed = sticking(&model(vec![of(0.2, default), of(0.2, 0.05)])).expect("one sticks");
        let speeds: Vec<f64> = changed
            .fitted
            .iter()
            .map(|e| e.parameters[smoothing])
            .collect();
        assert_eq!(speeds, [0.0, 0.05]);
        assert!(sticking(&model(vec![of(0.0, default), of(0.2, 0.0)])).is_none());
    }
}
