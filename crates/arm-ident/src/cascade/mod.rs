//! The cascade of thesis section 3.5.1: wrist, elbow, shoulder, one small problem a joint, quasi-static.
//!
//! Joint j has the unknowns `m_j l_j`, `m_{j+1}`, a constant passive moment `τ_pj` and a dissipative torque `d_j`:
//!
//! `g [cosθ_j, a_j cosθ_j] [m_j l_j, m_{j+1}]ᵀ + τ_pj + d_j s_j = (JᵀF)_j − g Σ_{k>j} cosθ_k X_k − g a_j cosθ_j Σ_{k>j+1} m_k`
//!
//! with θ_j = q_1 + … + q_j, F the force **on the arm**, s_j the direction of motion (−1 … 1, by the law of the effect), `X_k = m_k l_k + a_k Σ_{i>k} m_i`
//! from the steps before, and bounds `l_b ≤ π ≤ u_b` (equation 3.30).
//!
//! Where this departs from the text:
//! - one sign for F throughout (equations 3.18 and 3.23 contradict each other), and `cos123` where 3.24 has `cos12`;
//! - the first two columns are multiples of each other: only X_j can be read from data. What `m_j l_j` and `m_{j+1}` come out
//!   as is the point of the line `X_j = const` that lies nearest to the model, or a bound, and is labelled so;
//! - d_j is a regression on the direction of motion in the same problem. The mean of |residual| (equation 3.32) is 0.8 σ
//!   where there is no friction at all;
//! - where a joint with dry friction rests or turns, friction is anything between −d_j and d_j: these rows of that joint are left
//!   out. They would bias d_j towards zero, and X_j with it. The other joints' rows of the same samples do not depend on d_j, and stay;
//! - the same zero-phase low-pass acts on torque and regressors;
//! - inertia, which the text neglects, counts as an error of the measurement: each step adds the effect of the model's inertia
//!   on its estimate to the uncertainty, so that the intervals of a movement that is not quasi-static hold the true values.
//!
//! The joint method (`joint`) is better in every respect; the cascade is for comparison with the thesis.

mod covariance;
pub mod quasi_static;
mod rows;
mod step;
mod summary;
mod unknowns;

use crate::error::IdentError;
use crate::inference::estimate::Identified;
use crate::inference::independent_blocks::cluster_ranges;
use crate::regression::measured_motion::candidates;
use crate::regression::preprocessing::Pieces;
use crate::regression::rows::RegressionRows;
use crate::regression::trial::{Model, Role, Tolerance, Trial};
use crate::regression::unknown::calibration;
use arm_numerics::NumericsError;

use self::rows::Building;
use self::step::{FEWEST, condensed, informed, step};
use self::summary::summarise;
use self::unknowns::{neglected_inertia, own, unknowns};
use arm_numerics::Condenser;
use arm_numerics::error::check_range;

/// Choices of the cascade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Cutoff of the common low-pass \[Hz\]; 5 Hz, the thesis' own, when absent.
    pub cutoff: Option<f64>,
    /// Half width of the box `l_b … u_b` around the model, in its standard deviations.
    pub bound_width: f64,
    /// Tolerances of the calibration: they widen the intervals, and the calibration is not refitted.
    pub tolerance: Tolerance,
    /// Probability of the intervals.
    pub level: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cutoff: None,
            bound_width: 3.0,
            tolerance: Tolerance::default(),
            level: 0.95,
        }
    }
}

/// Identifies by the cascade on the trials whose role is [`Role::Fit`]; the others are only explained.
///
/// Fitted effects of kind `coulomb` are the dissipative torques. The passive moment of a joint is free where
/// `constant_moment` is fitted there, else it is zero (thesis section 3.5.2). Other fitted effects keep the
/// values of the model. Inertia is left out, that of motors too.
///
/// # Errors
/// [`IdentError`] when there is nothing to fit on, no force or torque acts, or a trial is too short for the filter.
pub fn identify<const N: usize>(
    model: &Model<N>,
    trials: &[Trial<N>],
    options: &Options,
) -> Result<Identified<N>, IdentError> {
    check_range("bound_width", options.bound_width, [0.0, f64::MAX])?;
    let fit: Vec<&Trial<N>> = trials.iter().filter(|t| t.role == Role::Fit).collect();
    let loaded = fit.iter().filter(|t| !t.is_unloaded()).count();
    if loaded == 0 {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "trials with role fit in which a force or torque acts",
            found: 0,
            expected: 1,
        }));
    }
    let mut unknowns = unknowns(model, options.bound_width);
    if unknowns.is_empty() {
        return Err(IdentError::Numerics(NumericsError::TooFew {
            name: "unknowns",
            found: 0,
            expected: 1,
        }));
    }
    unknowns.extend(calibration::<N>(&options.tolerance, &fit));
    unknowns.push(neglected_inertia());
    let cutoff = options.cutoff.unwrap_or(candidates(&fit)[0]);
    let prepared = trials
        .iter()
        .map(|t| Building::new((model, &unknowns), t, cutoff)?.filtered(cutoff))
        .collect::<Result<Vec<Pieces>, _>>()?;
    let fitted: Vec<&Pieces> = prepared
        .iter()
        .zip(trials)
        .filter(|(_, t)| t.role == Role::Fit)
        .map(|(p, _)| p)
        .collect();
    let ranges = cluster_ranges(&fitted)?;

    let mut x: Vec<f64> = unknowns.iter().map(|u| u.mean).collect();
    let mut steps = Vec::with_capacity(N);
    for joint in (0..N).rev() {
        let mut clusters = ranges
            .iter()
            .map(|cluster| condensed::<N>(cluster, joint, unknowns.len()))
            .collect::<Result<Vec<_>, _>>()?;
        if informed(&clusters) < FEWEST {
            clusters.fill(Condenser::new(unknowns.len()).finish());
        }
        let series: Vec<&RegressionRows> = fitted.iter().flat_map(|p| p.iter()).collect();
        steps.push(step::<N>(
            &unknowns,
            own(model, &unknowns, joint),
            (joint, clusters, &series),
            &mut x,
        )?);
    }
    summarise(
        model,
        &unknowns,
        &steps,
        (&x, options.level, cutoff),
        &prepared,
    )
}
