//! Factors that condensation makes: of a matrix, of a problem with more rows, of one with fewer parameters.

use crate::error::{NumericsError, check_finite, check_len};
use crate::least_squares::condense::Condenser;
use crate::least_squares::factor::Factor;
use crate::linalg::matrix::{Matrix, add_scaled};

impl Factor {
    /// Factor of a problem given as a matrix, for small problems and tests; data are streamed through [`Condenser`].
    ///
    /// * `y` - `n × p`
    /// * `b` - `n`
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`].
    pub fn of(y: &Matrix, b: &[f64]) -> Result<Self, NumericsError> {
        check_len("b", b.len(), y.rows())?;
        let mut condenser = Condenser::new(y.cols());
        let mut row = vec![0.0; y.cols()];
        for i in 0..y.rows() {
            for j in 0..y.cols() {
                row[j] = y[(i, j)];
            }
            condenser.push(&row, b[i])?;
        }
        Ok(condenser.finish())
    }

    /// The problem with independent prior rows `x_j/sd_j ≈ mean_j/sd_j` added; an infinite `sd_j` adds none.
    ///
    /// # Errors
    /// [`NumericsError::Length`]; [`NumericsError::OutOfRange`] if an `sd` is not positive; [`NumericsError::NotFinite`] for a mean.
    pub fn with_prior(&self, mean: &[f64], sd: &[f64]) -> Result<Self, NumericsError> {
        let p = self.parameters();
        check_len("mean", mean.len(), p)?;
        check_len("sd", sd.len(), p)?;
        let mut condenser = Condenser::new(p);
        condenser.merge_factor(self)?;
        let mut row = vec![0.0; p];
        for j in 0..p {
            // Written so that NaN is refused too.
            if sd[j].is_nan() || sd[j] <= 0.0 {
                return Err(NumericsError::OutOfRange {
                    name: "sd",
                    found: sd[j],
                    min: 0.0,
                    max: f64::INFINITY,
                });
            }
            if sd[j].is_finite() {
                row[j] = 1.0 / sd[j];
                condenser.push(&row, mean[j] / sd[j])?;
                row[j] = 0.0;
            }
        }
        Ok(Self {
            rows: self.rows,
            ..condenser.finish()
        })
    }

    /// The problem in the parameters `keep` alone, the others held at their values in `x`.
    ///
    /// * `keep` - indices, in the order that the new problem shall have
    /// * `x` - `p` values; those of kept parameters are not read
    ///
    /// # Errors
    /// [`NumericsError::Length`], [`NumericsError::NotFinite`]; [`NumericsError::OutOfRange`] for an index that is too large or given twice.
    pub fn restricted(&self, keep: &[usize], x: &[f64]) -> Result<Self, NumericsError> {
        let p = self.parameters();
        check_len("x", x.len(), p)?;
        let mut kept = vec![false; p];
        for &j in keep {
            if j >= p || kept[j] {
                return Err(NumericsError::OutOfRange {
                    name: "keep",
                    found: j as f64,
                    min: 0.0,
                    max: p as f64 - 1.0,
                });
            }
            kept[j] = true;
        }
        let mut z = self.z.clone();
        for j in (0..p).filter(|&j| !kept[j]) {
            add_scaled(&mut z, -x[j], self.r.column(j));
        }
        check_finite("x", &z)?;
        let smaller = Self::of(&self.r.select_columns(keep), &z)?;
        Ok(Self {
            rho2: smaller.rho2 + self.rho2,
            rows: self.rows,
            ..smaller
        })
    }
}
