//! The laws of one joint from the samples in which it moves.
//!
//! Dry friction holds a joint at rest with whatever is needed. A regression over all samples takes that for a spring that is too soft and
//! for friction that is too small, the more so the longer the joint rests.

use arm_core::effect::{Effect, Local};
use arm_core::{Chain, Joints, Pose, inverse_dynamics, static_torque};
use arm_ident::regression::kinematics::Kinematics;
use arm_ident::regression::measured_motion::measured;
use arm_ident::regression::trial::{Role, Trial};
use arm_ident::regression::unknown::spring;
use arm_numerics::linalg::matrix::add_scaled;
use arm_numerics::{Cholesky, Matrix};

use crate::GapError;
use crate::data::noise::dot;
use crate::data::passive_law::LIKELY;

/// Speed above which a joint moves \[rad/s\]: three times the default smoothing of dry laws, 0.01 rad/s, which are whole by then.
const MOVES: f64 = 0.03;
/// Independent samples for each number, at least.
const FEWEST: f64 = 5.0;

/// What one joint resists with in its moving samples.
struct Moving {
    q: Vec<f64>,
    qd: Vec<f64>,
    torque: Vec<f64>,
    /// Samples per independent sample, as filters correlate them.
    alike: f64,
}

/// The laws of a joint, none of them negative, with the standard deviations of their sizes; `None` where it moves too little.
///
/// * `chain` - the arm as it was identified
/// * `laws` - what the joint may have, springs at rest in the middle of the measured angles
/// * `friction` - its dry friction from resting samples, with its standard deviation: it is kept where the joint moves one way only,
///   since it cannot be distinguished from a rest angle then
pub(super) fn laws_in_motion<const N: usize>(
    chain: &Chain<f64, N>,
    trials: &[InMotion<'_, N>],
    (joint, laws, friction): (usize, &[Effect<f64>], WithStd),
) -> Option<Vec<WithStd>> {
    let seen = moving(chain, trials, joint);
    let dry = laws.iter().position(|law| law.kind == friction.0.kind);
    let Some(dry) = dry else {
        return seen.best(laws);
    };
    if let Some(found) = seen.best(laws)
        && found[dry].0.parameters[0] > LIKELY * found[dry].1
    {
        return Some(found);
    }
    let mut others = laws.to_vec();
    others.remove(dry);
    let mut found = seen.without(&friction.0).best(&others)?;
    found.insert(dry, friction);
    Some(found)
}

/// A trial with the motion that was measured in it.
pub(super) struct InMotion<'a, const N: usize> {
    trial: &'a Trial<N>,
    motion: Kinematics<N>,
    /// Samples per independent sample, as filters correlate them.
    alike: f64,
}

/// The fit trials with their motion.
///
/// * `cutoff` - of the motion \[Hz\]
///
/// # Errors
/// [`GapError`] for a trial too short for the filter.
pub(super) fn in_motion<const N: usize>(
    trials: &[Trial<N>],
    cutoff: f64,
) -> Result<Vec<InMotion<'_, N>>, GapError> {
    let fit = trials.iter().filter(|t| t.role == Role::Fit);
    let one = |trial| {
        let (motion, alike) = (measured(trial, cutoff)?, 0.5 * trial.rate / cutoff);
        Ok(InMotion {
            trial,
            motion,
            alike,
        })
    };
    fit.map(one).collect()
}

/// A law with the standard deviation of its size.
pub(super) type WithStd = (Effect<f64>, f64);

fn moving<const N: usize>(
    chain: &Chain<f64, N>,
    trials: &[InMotion<'_, N>],
    joint: usize,
) -> Moving {
    let mut seen = Moving {
        q: Vec::new(),
        qd: Vec::new(),
        torque: Vec::new(),
        alike: 1.0,
    };
    for of in trials {
        let (trial, motion) = (of.trial, &of.motion);
        seen.alike = f64::max(seen.alike, of.alike);
        for i in 0..trial.len() {
            let (q, qd, qdd) = (&motion.q[i], &motion.qd[i], &motion.qdd[i]);
            if !trial.valid[i] || qd[joint].abs() <= MOVES {
                continue;
            }
            let pose = Pose::new(q);
            let motors = trial.torque.as_ref().map_or_else(Joints::zeros, |t| t[i]);
            let force = trial.force_on_arm.as_ref().map_or([0.0; 2], |f| f[i]);
            let moment = trial.moment_on_arm.as_ref().map_or(0.0, |m| m[i]);
            let torque = motors + static_torque(chain, &pose, force, moment)
                - inverse_dynamics(chain, &pose, qd, qdd);
            seen.q.push(q[joint]);
            seen.qd.push(qd[joint]);
            seen.torque.push(torque[joint]);
        }
    }
    seen
}

/// Laws that were fitted, each with the standard deviation of its size, and what they leave.
struct Found {
    laws: Vec<WithStd>,
    squares: f64,
}

impl Moving {
    /// The laws that leave least, none of them negative; `None` where the samples do not decide them.
    fn best(&self, laws: &[Effect<f64>]) -> Option<Vec<WithStd>> {
        let fits = (1..1_usize << laws.len()).filter_map(|subset| {
            let own: Vec<usize> = (0..laws.len()).filter(|l| subset >> l & 1 == 1).collect();
            let included: Vec<_> = own.iter().map(|&l| laws[l]).collect();
            let found = self.fit(&included)?;
            let possible = found.laws.iter().all(|(law, _)| law.parameters[0] >= 0.0);
            possible.then_some((own, found))
        });
        let (own, found) = fits.min_by(|(_, a), (_, b)| a.squares.total_cmp(&b.squares))?;
        let absent = |l: usize| {
            let mut law = laws[l];
            law.parameters[0] = 0.0;
            (law, f64::INFINITY)
        };
        let of = |l: usize| {
            let place = own.iter().position(|&o| o == l);
            place.map_or_else(|| absent(l), |place| found.laws[place])
        };
        Some((0..laws.len()).map(of).collect())
    }

    /// The same without what a law resists with.
    fn without(&self, law: &Effect<f64>) -> Self {
        let rest = (0..self.torque.len()).map(|i| self.torque[i] - law.torque(&self.local(i)));
        Self {
            q: self.q.clone(),
            qd: self.qd.clone(),
            torque: rest.collect(),
            alike: self.alike,
        }
    }

    /// Least squares; `None` where the samples do not decide every number.
    fn fit(&self, laws: &[Effect<f64>]) -> Option<Found> {
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut rests: Vec<Option<(usize, usize)>> = Vec::new();
        let count = self.torque.len();
        for law in laws {
            let mut unit = *law;
            unit.parameters[0] = 1.0;
            let column = (0..count).map(|i| unit.torque(&self.local(i))).collect();
            columns.push(column);
            // Beside a spring a torque that does not change: its rest angle.
            rests.push(spring(law).map(|(_, rest)| (rest, 0)));
        }
        for rest in rests.iter_mut().flatten() {
            rest.1 = columns.len();
            columns.push(vec![1.0; count]);
        }
        let independent = count as f64 / self.alike;
        if independent < FEWEST * columns.len() as f64 {
            return None;
        }
        let a = Matrix::from_fn(count, columns.len(), |i, k| columns[k][i]);
        let factor = Cholesky::new(a.transpose_product(&a))?;
        let (x, inverse) = (
            factor.solve(&a.transpose_times(&self.torque)),
            factor.inverse(),
        );
        let mut left = a.times(&x);
        add_scaled(&mut left, -1.0, &self.torque);
        let squares = dot(&left, &left);
        let variance = squares / (independent - columns.len() as f64) / count as f64 * independent;
        let fitted = |(k, law): (usize, &Effect<f64>)| {
            let mut law = *law;
            law.parameters[0] = x[k];
            if let Some((rest, constant)) = rests[k]
                && x[k] > 0.0
            {
                law.parameters[rest] -= x[constant] / x[k];
            }
            (law, libm::sqrt(variance * self.alike * inverse[(k, k)]))
        };
        let laws = laws.iter().enumerate().map(fitted).collect();
        Some(Found { laws, squares })
    }

    fn local(&self, i: usize) -> Local<f64> {
        Local::moving(self.q[i], self.qd[i])
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    /// A joint that swings by 0.3 rad, with a spring of 0.9 N m/rad that rests at 0.1 rad, 0.2 N m of friction and 0.05 N m s/rad.
    fn swinging() -> Moving {
        let at = |i: usize| 0.01 * i as f64;
        let q: Vec<f64> = (0..1000).map(|i| 0.3 * libm::sin(at(i))).collect();
        let qd: Vec<f64> = (0..1000).map(|i| 0.3 * libm::cos(at(i))).collect();
        let torque = |(q, qd): (&f64, &f64)| 0.9 * (q - 0.1) + 0.2 * qd.signum() + 0.05 * qd;
        let torque = std::iter::zip(&q, &qd).map(torque).collect();
        Moving {
            q,
            qd,
            torque,
            alike: 10.0,
        }
    }

    #[test]
    fn the_laws_of_a_moving_joint_are_what_they_were() {
        let laws = [
            Effect::new(Kind::Viscous, 0),
            Effect::new(Kind::Coulomb, 0).with(&[0.0, 0.0]),
            Effect::new(Kind::Elastic, 0).with(&[0.0, 0.3]),
        ];
        let found = swinging().fit(&laws).expect("enough samples");
        let sizes = found.laws.iter().map(|(law, _)| law.parameters[0]);
        for (size, expected) in sizes.zip([0.05, 0.2, 0.9]) {
            assert!((size - expected).abs() < 1e-9, "{size}");
        }
        assert!((found.laws[2].0.parameters[1] - 0.1).abs() < 1e-9);
        let mut few = swinging();
        few.alike = 60.0;
        assert!(few.fit(&laws).is_none(), "16 samples for 4 numbers");
        few.alike = 45.0;
        assert!(few.fit(&laws).is_some(), "22 samples for 4 numbers");
    }

    #[test]
    fn a_joint_moves_from_three_times_the_default_smoothing_on() {
        let speeds = [0.0, 0.029, -0.029, 0.031, -0.031];
        let column = |of: fn(f64) -> f64| speeds.map(|v| Joints::from([of(v)])).to_vec();
        let still = |_: f64| 0.0;
        let trial = Trial::new(100.0, column(still));
        let motion = Kinematics {
            q: column(still),
            qd: column(|v| v),
            qdd: column(still),
            base: None,
            rest: [0.0],
            force: None,
        };
        let trials = [InMotion {
            trial: &trial,
            motion,
            alike: 1.0,
        }];
        let segment = arm_core::Segment {
            length: 0.3,
            mass: 1.0,
            com: [0.15, 0.0],
            inertia: 0.01,
        };
        let chain = Chain::<f64, 1>::new([segment], [0.0; 2], [0.0; 2]).expect("an arm");
        assert_eq!(moving(&chain, &trials, 0).qd, [0.031, -0.031]);
    }
}
