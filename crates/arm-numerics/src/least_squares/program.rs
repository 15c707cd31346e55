//! The statement of a convex least-squares problem: `min ‖R x − z‖²` under bounds, linear constraints and second-order cones.

use crate::error::{NumericsError, check_finite, check_len};
use crate::least_squares::factor::Factor;
pub use crate::least_squares::outcome::{Outcome, Reason, Route, Status};
use crate::linalg::matrix::{Matrix, max_abs, norm};

/// `‖A x + b‖ ≤ cᵀx + d`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cone {
    /// `k × p`.
    pub a: Matrix,
    /// `k`.
    pub b: Vec<f64>,
    /// `p`.
    pub c: Vec<f64>,
    /// Constant on the right.
    pub d: f64,
}

/// A convex least-squares problem, built step by step; it can be solved repeatedly.
///
/// ```
/// use arm_numerics::Matrix;
/// use arm_numerics::least_squares::program::{Program, Status};
/// let program = Program::new(Matrix::identity(2), vec![1.0, -2.0])?.bounds(&[0.0, 0.0], &[f64::INFINITY; 2])?;
/// let outcome = program.solve()?;
/// assert_eq!(outcome.status, Status::Solved);
/// assert_eq!(outcome.x[1], 0.0);
/// assert_eq!(outcome.active, [0, -1]);
/// # Ok::<(), arm_numerics::NumericsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Program {
    pub(crate) r: Matrix,
    pub(crate) z: Vec<f64>,
    pub(crate) scale: Vec<f64>,
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    pub(crate) equalities: Vec<(Vec<f64>, f64)>,
    pub(crate) inequalities: Vec<(Vec<f64>, f64)>,
    pub(crate) cones: Vec<Cone>,
}

impl Program {
    /// `min ‖R x − z‖²`, no constraint yet.
    ///
    /// * `r` - `m × p`
    /// * `z` - `m`
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn new(r: Matrix, z: Vec<f64>) -> Result<Self, NumericsError> {
        check_len("z", z.len(), r.rows())?;
        check_finite("r", r.as_slice())?;
        check_finite("z", &z)?;
        let p = r.cols();
        // Without a scale of the caller's: every column alone could explain all of z with x̃ = 1.
        let level = if max_abs(&z) > 0.0 { norm(&z) } else { 1.0 };
        let scale = r
            .column_norms()
            .iter()
            .map(|&n| if n > 0.0 { level / n } else { 1.0 })
            .collect();
        let (lower, upper) = (vec![f64::NEG_INFINITY; p], vec![f64::INFINITY; p]);
        Ok(Self {
            r,
            z,
            scale,
            lower,
            upper,
            equalities: Vec::new(),
            inequalities: Vec::new(),
            cones: Vec::new(),
        })
    }

    /// The problem of a factor.
    ///
    /// # Errors
    /// As [`Program::new`].
    pub fn of(factor: &Factor) -> Result<Self, NumericsError> {
        factor.check()?;
        Self::new(factor.r.clone(), factor.z.clone())
    }

    /// Column scaling: `x = S x̃`. Use the prior standard deviations, or the expected magnitude of each parameter. Without it the column norms of `R` are used.
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`]; [`NumericsError::OutOfRange`] for a scale that is not positive.
    pub fn scale(mut self, scale: &[f64]) -> Result<Self, NumericsError> {
        check_len("scale", scale.len(), self.r.cols())?;
        check_finite("scale", scale)?;
        if let Some(&found) = scale.iter().find(|&&s| s <= 0.0) {
            return Err(NumericsError::OutOfRange {
                name: "scale",
                found,
                min: f64::MIN_POSITIVE,
                max: f64::MAX,
            });
        }
        self.scale = scale.to_vec();
        Ok(self)
    }

    /// `lower ≤ x ≤ upper`, `p` each; infinite where there is none, equal to fix a parameter.
    ///
    /// # Errors
    /// [`NumericsError::Length`]; [`NumericsError::Bounds`] for NaN, a lower bound above the upper one, `+∞` below or `−∞` above.
    pub fn bounds(mut self, lower: &[f64], upper: &[f64]) -> Result<Self, NumericsError> {
        check_len("lower", lower.len(), self.r.cols())?;
        check_len("upper", upper.len(), self.r.cols())?;
        for (index, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
            let ordered = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !ordered {
                return Err(NumericsError::Bounds {
                    index,
                    lower,
                    upper,
                });
            }
        }
        self.lower = lower.to_vec();
        self.upper = upper.to_vec();
        Ok(self)
    }

    /// Adds `rowᵀx = value`.
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn equal(mut self, row: &[f64], value: f64) -> Result<Self, NumericsError> {
        self.equalities.push(self.linear(row, value)?);
        Ok(self)
    }

    /// Adds `rowᵀx ≤ limit`.
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn at_most(mut self, row: &[f64], limit: f64) -> Result<Self, NumericsError> {
        self.inequalities.push(self.linear(row, limit)?);
        Ok(self)
    }

    /// Adds a second-order cone.
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn cone(mut self, cone: Cone) -> Result<Self, NumericsError> {
        check_len("cone.a (columns)", cone.a.cols(), self.r.cols())?;
        check_len("cone.b", cone.b.len(), cone.a.rows())?;
        check_len("cone.c", cone.c.len(), self.r.cols())?;
        check_finite("cone.a", cone.a.as_slice())?;
        check_finite("cone.b", &cone.b)?;
        check_finite("cone.c", &cone.c)?;
        check_finite("cone.d", &[cone.d])?;
        self.cones.push(cone);
        Ok(self)
    }

    fn linear(&self, row: &[f64], value: f64) -> Result<(Vec<f64>, f64), NumericsError> {
        check_len("row", row.len(), self.r.cols())?;
        check_finite("row", row)?;
        check_finite("value", &[value])?;
        Ok((row.to_vec(), value))
    }
}
