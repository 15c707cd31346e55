//! Decides whether dry friction sticks: compares the smooth and the set-valued law by simulated runs.
//!
//! Torques cannot decide. Where a joint sticks nothing follows from its row, so the set-valued law would be judged by fewer of them.

use arm_core::effect::Effect;
use arm_sim::longest_step;

use crate::error::IdentError;
use crate::regression::measured_motion::low_pass;
use crate::regression::simulated_motion::{USUAL_STEP, simulated};
use crate::regression::trial::{Model, Trial};
use crate::threads::parallel;

/// Models with set-valued friction in place of fitted smooth friction whose smoothing speed is the default: that serves an explicit step and is no
/// property of an arm, see `arm-core`. First in joints that are nearly as steep as the usual step follows, which `armrs simulate` and `record`
/// solve as set-valued, then in all.
pub(crate) fn sticking<const N: usize>(model: &Model<N>) -> Vec<Model<N>> {
    let steep = set_valued(model, |effect| {
        NEARLY * longest_step(&model.chain, effect) < USUAL_STEP
    });
    let all = set_valued(model, |effect| effect.parameters[0] > 0.0);
    let mut models: Vec<Model<N>> = steep.into_iter().chain(all).collect();
    models.dedup_by(|a, b| a.fitted == b.fitted);
    models
}

/// The model with set-valued friction in place of some of its fitted smooth friction with the default smoothing; `None` where there is none.
fn set_valued<const N: usize>(
    model: &Model<N>,
    chosen: impl Fn(&Effect<f64>) -> bool,
) -> Option<Model<N>> {
    let mut other = model.clone();
    let mut changed = false;
    for effect in &mut other.fitted {
        if let Some(smoothing) = effect.kind.smoothed_by()
            && is_default(effect, smoothing)
            && chosen(effect)
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

/// Share of the longest step below which the usual one has to be, or friction is called steep; estimates of a joint that sticks are not those of its law.
const NEARLY: f64 = 0.5;

/// Standard deviations by which the set-valued law must describe the trials better on the whole.
const PLAINLY: f64 = 3.0;

/// Whether the first of two fitted models describes the simulated runs plainly better than the second.
///
/// Twice the logarithm of the ratio of likelihoods of angles and forces is a sum over trials; how it scatters between them tells what is
/// chance (Vuong 1989). The variances are those that the differences themselves have. What stays the same in a trial, as offsets do, does
/// not count.
///
/// * `fitted` - each model and the delay of its force channels \[s\]
/// * `cutoff` - of the common low-pass \[Hz\]
/// * `threads` - over which trials are spread; the result has the same bits for any number
///
/// # Errors
/// [`IdentError`] for a trial that cannot be simulated or is too short for the filter.
pub(crate) fn is_plainly_better<const N: usize>(
    fitted: [(&Model<N>, f64); 2],
    trials: &[&Trial<N>],
    (cutoff, threads): (f64, usize),
) -> Result<bool, IdentError> {
    let mut logarithms = [Vec::new(), Vec::new()];
    for ((model, delay), logarithms) in fitted.into_iter().zip(&mut logarithms) {
        let one = |k: usize| squares(model, trials[k], (cutoff, delay));
        let own = parallel(threads, trials.len(), one);
        let own: Vec<Vec<f64>> = own.into_iter().collect::<Result<_, _>>()?;
        *logarithms = likelihoods(&own, trials, cutoff);
    }
    let [better, worse] = logarithms;
    let gains: Vec<f64> = std::iter::zip(better, worse).map(|(a, b)| a - b).collect();
    Ok(is_plain(&gains))
}

/// Whether a sum is more than [`PLAINLY`] of its standard deviations, which the scatter of its terms tells.
fn is_plain(gains: &[f64]) -> bool {
    let count = gains.len() as f64;
    let sum: f64 = gains.iter().sum();
    let scatter = |v: &f64| (v - sum / count) * (v - sum / count);
    let variance = gains.iter().map(scatter).sum::<f64>() * count / (count - 1.0);
    gains.len() > 1 && sum > PLAINLY * libm::sqrt(variance)
}

/// Twice the logarithm of the likelihood of each trial, but for a constant.
fn likelihoods<const N: usize>(
    squares: &[Vec<f64>],
    trials: &[&Trial<N>],
    cutoff: f64,
) -> Vec<f64> {
    let valid = |t: &Trial<N>| t.valid.iter().filter(|v| **v).count() as f64;
    let count: f64 = trials.iter().map(|t| valid(t)).sum();
    let variances: Vec<f64> = (0..N + 2)
        .map(|c| squares.iter().map(|own| own[c]).sum::<f64>() / count)
        .collect();
    let one = |(own, trial): (&Vec<f64>, &&Trial<N>)| -> f64 {
        // A band has room for so many independent samples.
        let independent = f64::min(2.0 * cutoff / trial.rate, 1.0);
        let channels = std::iter::zip(own, &variances).filter(|(_, v)| **v > 0.0);
        let each = channels.map(|(square, v)| valid(trial) * libm::log(*v) + square / v);
        -independent * each.sum::<f64>()
    };
    std::iter::zip(squares, trials).map(one).collect()
}

/// Sums of squares of what simulated angles and forces of a trial differ by from the measured ones, low-passed, without their means.
fn squares<const N: usize>(
    model: &Model<N>,
    trial: &Trial<N>,
    (cutoff, delay): (f64, f64),
) -> Result<Vec<f64>, IdentError> {
    let course = simulated(model, trial, cutoff, None)?;
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
    fn what_the_scatter_between_trials_explains_is_not_plain() {
        assert!(is_plain(&[3.0, 4.0, 3.0, 2.0, 3.0, 3.0, 4.0, 2.0]));
        assert!(!is_plain(&[3.0, 9.0, -3.0, 3.0]));
        assert!(!is_plain(&[50.0]), "one trial tells of no scatter");
        assert!(!is_plain(&[-3.0, -3.1, -3.0]));
    }

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
        let speeds = |laws: [Effect<f64>; 2]| -> Vec<[f64; 2]> {
            let models = sticking(&model(laws.into()));
            let of = |m: &Model<1>| [0, 1].map(|i| m.fitted[i].parameters[smoothing]);
            models.iter().map(of).collect()
        };
        assert_eq!(speeds([of(0.2, default), of(0.2, 0.05)]), [[0.0, 0.05]]);
        assert!(speeds([of(0.0, default), of(0.2, 0.0)]).is_empty());
        // 40 N m at 0.01 rad/s slow down 0.0325 kg m² at 1.2e5 /s, more than a step of 0.25 ms follows: first that joint by itself.
        let steep = speeds([of(40.0, default), of(0.2, default)]);
        assert_eq!(steep, [[0.0, default], [0.0, 0.0]]);
    }
}
