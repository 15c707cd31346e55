//! Numerical rank: null space, base parameters and their grouping.
//!
//! Columns are scaled first (by prior standard deviations: then a singular value above 1 means that the data beat the prior; or by the column norms:
//! then the rank is a property of the movement alone). The rank is counted in the singular values; a column-pivoted QR factor picks base columns and gives
//! the dependence of the others on them, `W₂ = W₁ β` (Gautier 1991): only `x_base + β x_dependent` can be known.

use crate::error::IdentError;
use arm_numerics::error::{check_finite, check_least, check_len, check_range};
use arm_numerics::linalg::matrix::{Matrix, dot, norm};
use arm_numerics::linalg::orthogonal::{Qr, solve_upper};
use arm_numerics::linalg::svd::Svd;

/// Coefficients below this (in scaled units) are rounding and left out of combinations.
const NO_SHARE: f64 = 1e-9;

/// How columns are scaled and where the rank is cut.
#[derive(Debug, Clone, PartialEq)]
pub struct RankOptions {
    /// One scale a column, `x = S x̃`; `None` scales each column to unit length.
    pub scale: Option<Vec<f64>>,
    /// Number of data rows behind the factor; only sets the default tolerance.
    pub rows: usize,
    /// A singular value counts if it is above `tolerance · σ₁`; `None` takes `max(rows, p) · ε`.
    pub tolerance: Option<f64>,
}

/// A combination of parameters that the data can determine: `x[base] + Σ coefficient · x[index]`, in the caller's units.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// The parameter that represents the group.
    pub base: usize,
    /// The parameters that cannot be distinguished from it, with coefficients.
    pub others: Vec<(usize, f64)>,
}

/// What [`analyse`] found. Indices are those of the columns given.
#[derive(Debug, Clone, PartialEq)]
pub struct RankReport {
    /// Number of independent combinations.
    pub rank: usize,
    /// Singular values of the scaled factor, largest first.
    pub singular_values: Vec<f64>,
    /// Condition number of the scaled factor; infinite if a singular value is zero.
    pub condition: f64,
    /// Relative threshold that was applied.
    pub tolerance: f64,
    /// The scale that was applied.
    pub scale: Vec<f64>,
    /// Orthonormal basis of the null space in scaled units, `p × (p − rank)`.
    pub null_space: Matrix,
    /// Columns chosen as base, in increasing order.
    pub base: Vec<usize>,
    /// The other columns, in increasing order.
    pub dependent: Vec<usize>,
    /// One combination per base column, in the order of `base`.
    pub combinations: Vec<Combination>,
}

/// Rank and base parameters of a problem.
///
/// * `r` - `m × p`, usually the triangular factor of the stacked regressor
///
/// # Errors
/// [`NumericsError::Length`](arm_numerics::NumericsError::Length), [`NumericsError::NotFinite`](arm_numerics::NumericsError::NotFinite), [`NumericsError::OutOfRange`](arm_numerics::NumericsError::OutOfRange) for a scale or tolerance that is not positive.
pub fn analyse(r: &Matrix, options: &RankOptions) -> Result<RankReport, IdentError> {
    let p = r.cols();
    check_finite("r", r.as_slice())?;
    let scale = match &options.scale {
        Some(scale) => scale.clone(),
        None => r
            .column_norms()
            .iter()
            .map(|&n| if n > 0.0 { 1.0 / n } else { 1.0 })
            .collect(),
    };
    check_len("scale", scale.len(), p)?;
    for &s in &scale {
        check_range("scale", s, [f64::MIN_POSITIVE, f64::MAX])?;
    }
    let tolerance = options
        .tolerance
        .unwrap_or(f64::EPSILON * options.rows.max(p) as f64);
    check_range("tolerance", tolerance, [0.0, 1.0])?;

    let scaled = r.scaled_columns(&scale);
    check_finite("scaled r", scaled.as_slice())?;
    let svd = Svd::of(scaled.clone());
    let rank = svd.rank(tolerance);
    let qr = Qr::pivoted(scaled);
    let mut base = qr.pivots[..rank].to_vec();
    let mut dependent = qr.pivots[rank..].to_vec();
    base.sort_unstable();
    dependent.sort_unstable();
    Ok(RankReport {
        rank,
        condition: svd.condition(),
        tolerance,
        null_space: svd.v.select_columns(&(rank..p).collect::<Vec<_>>()),
        singular_values: svd.sigma,
        combinations: combinations(&qr, rank, &scale),
        scale,
        base,
        dependent,
    })
}

/// `β = R₁₁⁻¹ R₁₂`, back in the caller's units.
fn combinations(qr: &Qr, rank: usize, scale: &[f64]) -> Vec<Combination> {
    let leading = qr.leading(rank);
    let mut out: Vec<Combination> = qr.pivots[..rank]
        .iter()
        .map(|&base| Combination {
            base,
            others: Vec::new(),
        })
        .collect();
    for k in rank..qr.pivots.len() {
        let dependent = qr.pivots[k];
        let mut beta: Vec<f64> = (0..rank).map(|i| qr.r(i, k)).collect();
        solve_upper(&leading, rank, &mut beta);
        for (combination, b) in out.iter_mut().zip(beta) {
            if b.abs() > NO_SHARE {
                combination
                    .others
                    .push((dependent, b * scale[combination.base] / scale[dependent]));
            }
        }
    }
    for combination in &mut out {
        combination.others.sort_by_key(|other| other.0);
    }
    out.sort_by_key(|combination| combination.base);
    out
}

impl RankReport {
    /// Share of a linear function `wᵀx` that lies in the null space, in scaled units: 0 means determined by the data, 1 untouched by them.
    ///
    /// # Errors
    /// [`NumericsError::Length`](arm_numerics::NumericsError::Length), [`NumericsError::NotFinite`](arm_numerics::NumericsError::NotFinite); [`NumericsError::TooFew`](arm_numerics::NumericsError::TooFew) if `w` is zero.
    pub fn undetermined_share(&self, w: &[f64]) -> Result<f64, IdentError> {
        check_len("w", w.len(), self.scale.len())?;
        check_finite("w", w)?;
        let scaled: Vec<f64> = w.iter().zip(&self.scale).map(|(w, s)| w * s).collect();
        let length = norm(&scaled);
        check_least("nonzero elements of w", usize::from(length > 0.0), 1)?;
        let inside: Vec<f64> = (0..self.null_space.cols())
            .map(|j| dot(self.null_space.column(j), &scaled))
            .collect();
        Ok(norm(&inside) / length)
    }

    /// One vector per dependent column that changes no prediction: 1 for it, `−β` for its partners; in the caller's units.
    pub fn trades(&self) -> Vec<Combination> {
        self.dependent
            .iter()
            .map(|&dependent| {
                let partner = |c: &Combination| {
                    let coefficient = c.others.iter().find(|other| other.0 == dependent)?.1;
                    Some((c.base, -coefficient))
                };
                Combination {
                    base: dependent,
                    others: self.combinations.iter().filter_map(partner).collect(),
                }
            })
            .collect()
    }

    /// The null space in words, one line per dependent column: "m2 and m1*l1 trade 1 : -0.322".
    ///
    /// # Errors
    /// [`NumericsError::Length`](arm_numerics::NumericsError::Length) unless there is one name a column.
    pub fn describe_trades(&self, names: &[&str]) -> Result<Vec<String>, IdentError> {
        check_len("names", names.len(), self.scale.len())?;
        let line = |trade: &Combination| {
            let Some((&(last, _), before)) = trade.others.split_last() else {
                return format!("{} does not act on the data", names[trade.base]);
            };
            let mut who = names[trade.base].to_owned();
            for &(index, _) in before {
                who = format!("{who}, {}", names[index]);
            }
            let shares: String = trade
                .others
                .iter()
                .map(|&(_, c)| format!(" : {}", short(c)))
                .collect();
            format!("{who} and {} trade 1{shares}", names[last])
        };
        Ok(self.trades().iter().map(line).collect())
    }
}

/// Four significant digits, no trailing zeros.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if digits.abs() >= 1e-4 && digits.abs() < 1e6 {
        format!("{digits}")
    } else {
        format!("{digits:e}")
    }
}
