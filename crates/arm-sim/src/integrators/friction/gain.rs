//! Feedback gain of friction that grows with the joint force.

use arm_core::Joints;

/// Solution of `(1 − G) x = b`, and the determinant of its matrix.
pub(super) fn newton<const N: usize>(
    gains: &[[f64; N]; N],
    b: &Joints<f64, N>,
) -> (Joints<f64, N>, f64) {
    let mut m = *gains;
    for (i, row) in m.iter_mut().enumerate() {
        for (k, value) in row.iter_mut().enumerate() {
            *value = if i == k { 1.0 - *value } else { -*value };
        }
    }
    let (mut x, mut determinant) = (*b, 1.0);
    for k in 0..N {
        determinant *= m[k][k];
        for i in k + 1..N {
            let factor = m[i][k] / m[k][k];
            for c in k..N {
                m[i][c] -= factor * m[k][c];
            }
            x[i] -= factor * x[k];
        }
    }
    for k in (0..N).rev() {
        for c in k + 1..N {
            x[k] -= m[k][c] * x[c];
        }
        x[k] /= m[k][k];
    }
    (x, determinant)
}

/// The joint whose friction adds most to itself, and how much.
pub(super) fn strongest<const N: usize>(gains: &[[f64; N]; N]) -> (usize, f64) {
    let mut most = (0, gains.first().map_or(0.0, |row| row[0]));
    for (j, row) in gains.iter().enumerate() {
        if row[j] > most.1 {
            most = (j, row[j]);
        }
    }
    most
}
