//! Root mean square with pairwise sums.

/// Terms that are summed one after the other; longer sums are halved.
const BLOCK: usize = 128;
/// Running sums within a block.
const WIDTH: usize = 8;

/// A sum in pairs: its rounding error grows with the logarithm of the number of terms. The order is that of NumPy's sums, with whose
/// last digits results have been published.
pub fn pairwise_sum(terms: &[f64]) -> f64 {
    let n = terms.len();
    if n < WIDTH {
        return terms.iter().fold(-0.0, |sum, v| sum + v);
    }
    if n > BLOCK {
        let half = n / 2 - (n / 2) % WIDTH;
        return pairwise_sum(&terms[..half]) + pairwise_sum(&terms[half..]);
    }
    let mut sums = [0.0; WIDTH];
    sums.copy_from_slice(&terms[..WIDTH]);
    let whole = n - n % WIDTH;
    for row in terms[WIDTH..whole].chunks_exact(WIDTH) {
        for (sum, v) in sums.iter_mut().zip(row) {
            *sum += v;
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    let block = ((a + b) + (c + d)) + ((e + f) + (g + h));
    terms[whole..].iter().fold(block, |sum, v| sum + v)
}

/// Root of the mean square; `None` of nothing.
pub fn root_mean_square(values: &[f64]) -> Option<f64> {
    let squares: Vec<f64> = values.iter().map(|v| v * v).collect();
    let mean = pairwise_sum(&squares) / values.len() as f64;
    (!values.is_empty()).then(|| libm::sqrt(mean))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_right_at_every_length() {
        for n in 0..1000 {
            let terms: Vec<f64> = (0..n).map(f64::from).collect();
            assert_eq!(pairwise_sum(&terms), f64::from(n * (n - 1) / 2));
        }
    }

    #[test]
    fn three_and_four_are_five_halves_of_root_two() {
        assert_eq!(root_mean_square(&[3.0, 4.0]), Some(libm::sqrt(12.5)));
        assert_eq!(root_mean_square(&[]), None);
    }
}
