//! Student's t distribution and the upper tail of chi-square.

use crate::error::{NumericsError, check_range};
use std::f64::consts::PI;

/// Steps of the continued fraction; it needs about the square root of the degrees of freedom.
const FRACTION_STEPS: usize = 100_000;

/// The value that a t-distributed number stays below with `probability`.
///
/// # Errors
/// [`NumericsError::OutOfRange`] unless `1e-300 ≤ probability ≤ 1 − ε` and `0.1 ≤ dof ≤ 1e9`.
pub fn student_t_quantile(probability: f64, dof: f64) -> Result<f64, NumericsError> {
    check_range("probability", probability, [1e-300, 1.0 - f64::EPSILON])?;
    check_range("dof", dof, [0.1, 1e9])?;
    let upper = probability > 0.5;
    let both = 2.0
        * if upper {
            1.0 - probability
        } else {
            probability
        };
    if both >= 1.0 {
        return Ok(0.0);
    }
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high, dof) > both && high < f64::MAX / 4.0 {
        low = high;
        high *= 2.0;
    }
    // Newton's method, by bisection where it would leave the bracket.
    let mut t = 0.5 * (low + high);
    for _ in 0..200 {
        let excess = tail(t, dof) - both;
        if excess > 0.0 {
            low = t;
        } else {
            high = t;
        }
        let newton = t + excess / (2.0 * density(t, dof));
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let done = (next - t).abs() <= 2.0 * f64::EPSILON * t;
        t = next;
        if done {
            break;
        }
    }
    Ok(if upper { t } else { -t })
}

/// Probability that `|T| > t`: the regularised incomplete beta function `I_x(dof/2, ½)` at `x = dof/(dof + t²)`.
///
/// Relative accuracy about 1e-12 (continued fraction after Lentz; Press et al., *Numerical Recipes*, 6.4).
fn tail(t: f64, dof: f64) -> f64 {
    let ratio = t * t / dof;
    if !ratio.is_finite() {
        return 0.0;
    }
    let (a, b) = (0.5 * dof, 0.5);
    let (x, y) = (1.0 / (1.0 + ratio), ratio / (1.0 + ratio));
    // x^a (1−x)^b / B(a, b)
    let front =
        libm::exp(ln_gamma_ratio(a) - a * libm::log1p(ratio) + b * libm::log(y)) / PI.sqrt();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(a, b, x) / a
    } else {
        1.0 - front * fraction(b, a, y) / b
    }
}

fn density(t: f64, dof: f64) -> f64 {
    libm::exp(ln_gamma_ratio(0.5 * dof) - 0.5 * (dof + 1.0) * libm::log1p(t * t / dof))
        / (dof * PI).sqrt()
}

/// `ln Γ(a + ½) − ln Γ(a)`, by its asymptotic series where the difference of two large logarithms would lose digits.
fn ln_gamma_ratio(a: f64) -> f64 {
    if a < 30.0 {
        return libm::lgamma(a + 0.5) - libm::lgamma(a);
    }
    let u = 1.0 / a;
    let u2 = u * u;
    0.5 * libm::log(a) - u * (0.125 - u2 * (1.0 / 192.0 - u2 * (1.0 / 640.0 - u2 * 17.0 / 14336.0)))
}

/// The continued fraction of the incomplete beta function.
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut h = d;
    for step in 1..FRACTION_STEPS {
        let m = step as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / guard(1.0 + even * d);
        c = guard(1.0 + even / c);
        h *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / guard(1.0 + odd * d);
        c = guard(1.0 + odd / c);
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h
}

/// Probability that a chi-square variable with `dof` degrees of freedom exceeds `x`.
pub fn chi_square_tail(x: f64, dof: usize) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    // Q(k + 2) = Q(k) + (x/2)^(k/2) e^(−x/2) / Γ(k/2 + 1), from Q(1) or Q(2) up.
    let half = 0.5 * x;
    let (mut tail, mut term, mut k) = if dof % 2 == 1 {
        let first = libm::erfc(libm::sqrt(half));
        let term = libm::sqrt(half / core::f64::consts::PI) * 2.0 * libm::exp(-half);
        (first, term, 1)
    } else {
        (libm::exp(-half), half * libm::exp(-half), 2)
    };
    while k < dof {
        tail += term;
        k += 2;
        term *= half / (0.5 * k as f64);
    }
    tail.clamp(0.0, 1.0)
}
