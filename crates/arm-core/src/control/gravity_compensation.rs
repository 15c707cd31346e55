//! The torque that carries an arm, its weight and its passive moments, with an uncertainty.

use crate::effect::{Motion, States};
use crate::numeric::covariance::Covariance;
use crate::numeric::scalar::Real;
use crate::regression::Equation;
use crate::{Invalid, Joints, check};

/// Torques and what they may be wrong by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityCompensation<T, const N: usize> {
    /// Torque of each joint on its distal segment \[N m\].
    pub torque: Joints<T, N>,
    /// Its standard deviation \[N m\].
    pub sd: Joints<T, N>,
    /// Whether it lies within the envelope about the torque of the arm that was expected.
    pub within: bool,
}

/// An arm that was identified: the unknowns of an [`Equation`] and the covariance of their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensation<T, const N: usize, const P: usize, const E: usize> {
    equation: Equation<T, N, P, E>,
    values: [T; P],
    covariance: Covariance<T, P>,
}

impl<T: Real, const N: usize, const P: usize, const E: usize> Compensation<T, N, P, E> {
    /// From an identification.
    ///
    /// * `values` - in the order of the unknowns
    /// * `covariance` - symmetric; only its lower triangle is read. What is known exactly has a row of zeros.
    ///
    /// # Errors
    /// [`Invalid`] for values that are not finite, and a covariance that is none: then its error is negative in some
    /// direction.
    pub fn new(
        equation: Equation<T, N, P, E>,
        values: [T; P],
        covariance: &[[T; P]; P],
    ) -> Result<Self, Invalid> {
        for i in 0..P {
            check::finite("value of unknown", i, values[i])?;
            for &value in covariance[i].iter().take(i + 1) {
                check::finite("covariance of unknown", i, value)?;
            }
        }
        Ok(Self {
            equation,
            values,
            covariance: factorised(covariance)?,
        })
    }

    /// The torques that carry the arm at rest, or with what its effects resist with at the speeds of `motion`.
    ///
    /// Give a motion without speed for the weight and the passive moments alone.
    ///
    /// * `memory` - the states of each effect; zeros where none has any
    pub fn carry(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
    ) -> GravityCompensation<T, N> {
        let values = |i: usize| [self.values.get(i).copied().unwrap_or(T::ZERO); 2];
        let ([torque, _], sd) = self
            .equation
            .carried(motion, memory, values, &self.covariance);
        GravityCompensation {
            within: true,
            torque,
            sd,
        }
    }
}

/// The root of a covariance, from the last unknown to the first.
fn factorised<T: Real, const P: usize>(
    covariance: &[[T; P]; P],
) -> Result<Covariance<T, P>, Invalid> {
    let Covariance { mut root } = Covariance::independent([T::ZERO; P]);
    for k in (0..P).rev() {
        for i in (0..P).rev().filter(|&i| i <= k) {
            let mut value = covariance[k][i];
            for m in k + 1..P {
                value -= root[i][m] * root[k][m];
            }
            if i == k {
                // Rounding may leave a little less than nothing of a variance that others explain.
                let rounding = covariance[k][k] * T::of(ROUNDING);
                check::at_least_zero("variance of unknown", k, value + rounding)?;
                root[k][k] = value.max(T::ZERO).sqrt();
            } else if root[k][k] > T::ZERO {
                root[i][k] = value / root[k][k];
            }
        }
    }
    Ok(Covariance { root })
}

/// Share of a variance that may be lost to rounding.
const ROUNDING: f64 = 1e-4;
