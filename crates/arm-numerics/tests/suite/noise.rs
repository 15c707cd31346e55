//! Seeded random numbers, the same on every platform.

use arm_numerics::Matrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

pub struct Noise(ChaCha8Rng);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform in (−1, 1).
    pub fn uniform(&mut self) -> f64 {
        2.0 * ((self.0.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64 - 1.0
    }

    /// Standard normal (polar method of Marsaglia).
    pub fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (self.uniform(), self.uniform());
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * libm::log(s) / s).sqrt();
            }
        }
    }

    pub fn matrix(&mut self, rows: usize, cols: usize) -> Matrix {
        Matrix::from_fn(rows, cols, |_, _| self.uniform())
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.uniform()).collect()
    }

    /// Stationary `x_t = ρ x_{t−1} + √(1−ρ²) e_t` of unit variance.
    pub fn slow(&mut self, rho: f64, n: usize) -> Vec<f64> {
        let mut x = self.normal();
        let step = (1.0 - rho * rho).sqrt();
        (0..n)
            .map(|_| {
                let now = x;
                x = rho * x + step * self.normal();
                now
            })
            .collect()
    }
}

/// Largest difference of two slices.
pub fn gap(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    most(a.iter().zip(b).map(|(x, y)| x - y))
}

/// Largest of some sizes; one that is not a number is the result, so that no bound holds.
pub fn most(values: impl IntoIterator<Item = f64>) -> f64 {
    let sizes = values.into_iter().map(f64::abs);
    sizes.fold(0.0, |m, d| if d <= m || m.is_nan() { m } else { d })
}
