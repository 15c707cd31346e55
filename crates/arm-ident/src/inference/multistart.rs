//! Multistart: repeats a fit that may be in a wrong minimum, and keeps the better one.
//!
//! What follows slopes ends in the hollow in which it starts. A parameter at a bound or rounds that come to no rest are its marks; they are no proof,
//! for friction may well be zero. So nothing is lost by another start but time, and what ends between all bounds is left as it is.

/// How far from its bound a parameter is at each further start, as a share of how far it was at the first.
const SHARES: [f64; 2] = [1.0, 0.1];
/// A parameter that was at its bound from the start leaves it by this, in its own unit: about what joints of arms have.
const INSIDE: f64 = 0.1;

/// Ends that differ by less are the same, and the first of them counts: twice the logarithm of a likelihood.
const SAME: f64 = 1e-2;

/// Where a fit ended.
pub(crate) trait Ended: Sized {
    /// Of each parameter that may leave its bound, its value and −1 at the least, +1 at the greatest, 0 between.
    fn parameters(&self) -> Vec<(f64, i8)>;
    /// Whether the estimate stands; false when the rounds ran out.
    fn settled(&self) -> bool;
    /// What the fit makes small, in squared deviations of the noise.
    fn objective(&self) -> f64;

    /// An end at which the fit was still moving is none.
    fn better_than(&self, other: &Self) -> bool {
        match (self.settled(), other.settled()) {
            (true, false) => true,
            (false, true) => false,
            _ => self.objective() < other.objective() - SAME,
        }
    }
}

/// The best of a fit and of those that start again from elsewhere.
///
/// * `start`, `limits` - of the parameters of the first fit
/// * `fit` - ends, or not, from given values of the parameters and, for all that is no parameter here, from where another fit ended
pub(crate) fn best<T: Ended>(
    first: T,
    start: &[f64],
    limits: &[[f64; 2]],
    fit: impl Fn(&T, &[f64]) -> Option<T>,
) -> T {
    let mut best = first;
    for share in SHARES {
        let Some(values) = elsewhere(&best, (start, limits), share) else {
            break;
        };
        if let Some(other) = fit(&best, &values)
            && other.better_than(&best)
        {
            best = other;
        }
    }
    best
}

/// Another start: parameters at a bound are where they started or, if that was the bound, a little inside, and the others where they ended.
/// Where none is at a bound but the fit did not settle, all go half the way back.
fn elsewhere<T: Ended>(
    ended: &T,
    (start, limits): (&[f64], &[[f64; 2]]),
    share: f64,
) -> Option<Vec<f64>> {
    let found = ended.parameters();
    let at_bound = found.iter().any(|(_, active)| *active != 0);
    if !at_bound && ended.settled() {
        return None;
    }
    let from = |((&(value, active), &start), &[low, high]): ((&(f64, i8), &f64), &[f64; 2])| {
        let inside = if low < start && start < high {
            start - value
        } else {
            -f64::from(active) * INSIDE.min(0.5 * (high - low))
        };
        match (at_bound, active) {
            (true, 0) => value,
            (true, _) => value + share * inside,
            (false, _) => value + 0.5 * share * (start - value),
        }
    };
    Some(found.iter().zip(start).zip(limits).map(from).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct At(Vec<f64>, f64, bool);

    impl Ended for At {
        fn parameters(&self) -> Vec<(f64, i8)> {
            let side = |&v: &f64| (v, i8::from(v >= 2.0) - i8::from(v <= 0.0));
            self.0.iter().map(side).collect()
        }

        fn settled(&self) -> bool {
            self.2
        }

        fn objective(&self) -> f64 {
            self.1
        }
    }

    const LIMITS: [[f64; 2]; 2] = [[0.0, 2.0]; 2];

    #[test]
    fn what_ends_between_its_bounds_starts_once() {
        let first = At(vec![1.0, 0.5], 3.0, true);
        let end = best(first, &[0.3, 0.3], &LIMITS, |_, _| panic!("another start"));
        assert_eq!(end.0, [1.0, 0.5]);
    }

    #[test]
    fn a_parameter_at_its_bound_starts_again_where_it_started_and_then_nearer() {
        let starts = std::cell::RefCell::new(Vec::new());
        // The first other start is worse, the second better.
        let end = best(
            At(vec![0.0, 0.5], 3.0, true),
            &[1.0, 0.2],
            &LIMITS,
            |_, from| {
                starts.borrow_mut().push(from.to_vec());
                Some(At(from.to_vec(), 6.0 * from[0], true))
            },
        );
        assert_eq!(*starts.borrow(), [[1.0, 0.5], [0.1, 0.5]]);
        assert_eq!(end.0, [0.1, 0.5]);
        // One that started at its bound is led inside, and what is no better by more than rounding changes nothing.
        let end = best(
            At(vec![0.0, 2.0], 3.0, true),
            &[0.0, 2.0],
            &LIMITS,
            |_, from| {
                assert!(
                    from[0] > 0.0 && from[0] <= INSIDE && from[1] < 2.0 && from[1] >= 2.0 - INSIDE
                );
                Some(At(vec![0.7; 2], 3.0 - 0.5 * SAME, true))
            },
        );
        assert_eq!(end.0, [0.0, 2.0]);
    }

    #[test]
    fn what_does_not_settle_goes_half_way_back_and_gives_way_to_what_does() {
        let end = best(
            At(vec![1.0, 0.5], 3.0, false),
            &[0.5, 0.5],
            &LIMITS,
            |_, from| {
                assert_eq!(from, [0.75, 0.5]);
                Some(At(from.to_vec(), 4.0, true))
            },
        );
        assert_eq!(end.0, [0.75, 0.5]);
        let end = best(At(vec![1.0; 2], 3.0, false), &[0.5; 2], &LIMITS, |_, _| {
            None
        });
        assert_eq!(end.0, [1.0; 2]);
    }
}
