//! Newton's method for the equation of motion at one instant.

use arm_core::Joints;
use arm_sim::{ImplicitFriction, SmoothFriction};
use nalgebra::SMatrix;

use crate::linearization::plant::Balance;

/// The unknown at which nothing is missing, or as little as can be.
pub(super) struct Solved<const N: usize> {
    pub at: Joints<f64, N>,
    pub there: Balance<N>,
    /// The inverse slope that led there.
    pub inverse: SMatrix<f64, N, N>,
    pub exact: bool,
}

/// Solves for the unknown at which nothing is missing; `None` where that leads beyond all numbers.
///
/// First with given inverse slopes, one after the other and corrected on the way (Broyden 1965), which is enough for what is
/// smooth or small; then with slopes of its own and shorter steps, for friction that reverses and a contact that opens.
///
/// * `missing` - the torque missing at an unknown
/// * `nudge` - increment of the unknown for a difference quotient
pub(super) fn newton<const N: usize>(
    start: Joints<f64, N>,
    [first, second]: [&SMatrix<f64, N, N>; 2],
    missing: impl Fn(&Joints<f64, N>) -> (Joints<f64, N>, Balance<N>),
    nudge: f64,
) -> Option<Solved<N>> {
    /// Torque that may be missing, and that is missing at most where a step finds no better \[N m\].
    const TOLERANCES: (f64, f64) = (1e-7, 1e-3);
    /// Share of what is missing that a step of a good slope leaves at most.
    const GOOD: f64 = 0.3;
    /// Most rounds.
    const ROUNDS: usize = 30;
    /// Lengths of a step that are tried, each half the one before: to a 32nd.
    const HALVINGS: usize = 6;
    // What is not a number is larger than anything.
    let larger = |most: f64, v: &f64| {
        if v.is_nan() || v.abs() > most {
            v.abs()
        } else {
            most
        }
    };
    let size = |r: &Joints<f64, N>| r.iter().fold(0.0, larger);
    let (mut at, (mut left, mut there)) = (start, missing(&start));
    let (mut inverse, mut fallback) = (*first, (first != second).then_some(second));
    for _ in 0..ROUNDS {
        if size(&left) < TOLERANCES.0 {
            break;
        }
        let step = inverse * left;
        let next = at + step;
        let (rest, balance) = missing(&next);
        if size(&rest) < GOOD * size(&left) {
            let answered = inverse * (left - rest);
            let along = step.dot(&answered);
            if along > 0.0 {
                inverse += (step - answered) * (step.transpose() * inverse) / along;
            }
            (at, left, there) = (next, rest, balance);
            continue;
        }
        if let Some(given) = fallback.take() {
            inverse = *given;
            continue;
        }
        let mut slope = SMatrix::<f64, N, N>::zeros();
        for j in 0..N {
            let mut beside = at;
            beside[j] += nudge;
            slope.set_column(j, &((left - missing(&beside).0) / nudge));
        }
        inverse = slope.try_inverse()?;
        let whole = inverse * left;
        let mut share = 1.0;
        let better = (0..HALVINGS).find_map(|_| {
            let next = at + whole * share;
            let (rest, balance) = missing(&next);
            share *= 0.5;
            (size(&rest) < size(&left)).then_some((next, rest, balance))
        });
        let Some((next, rest, balance)) = better else {
            break;
        };
        (at, left, there) = (next, rest, balance);
    }
    size(&left).is_finite().then(|| Solved {
        at,
        there,
        inverse,
        exact: size(&left) < TOLERANCES.1,
    })
}

/// What is missing at an unknown where joints have dry friction.
pub(super) struct MissingTorque<const N: usize> {
    /// Torque missing, friction apart \[N m\].
    pub torque: Joints<f64, N>,
    /// Speeds at the end of the step \[rad/s\].
    pub speed: Joints<f64, N>,
    /// The balance of the equation of motion there.
    pub there: Balance<N>,
}

/// Solves for the accelerations at which nothing is missing but what dry friction resists with; `None` where that leads beyond all
/// numbers.
///
/// The torques besides friction are made linear with a slope that is corrected on the way (Broyden 1965); friction obeys its law in each
/// linear problem.
///
/// * `slope` - torque per unit of acceleration, and `reach` the change of speed that it makes \[s\]
/// * `smooth`, `near` - smooth friction, and speeds near which joints end \[rad/s\]
/// * `missing` - what is missing at accelerations
pub(super) fn slide<const N: usize>(
    start: Joints<f64, N>,
    (mut slope, reach): (SMatrix<f64, N, N>, f64),
    (smooth, near): (&[SmoothFriction], &Joints<f64, N>),
    missing: impl Fn(&Joints<f64, N>) -> MissingTorque<N>,
) -> Option<Slid<N>> {
    /// Increment of speed for a difference quotient \[rad/s\].
    const NUDGE: f64 = 1e-5;
    /// Residual torque at which the solution is good enough, and at most where no step helps \[N m\].
    const TOLERANCES: (f64, f64) = (1e-7, 1e-3);
    /// Most rounds: six with the slope of the start and eight with one that is taken anew.
    const ROUNDS: usize = 14;
    /// Rounds after which the slope is taken anew, for a contact that opens and the end of a range.
    const RENEWED: usize = 6;
    let (mut at, mut now, mut speed) = (start, missing(&start), *near);
    let mut answered = f64::INFINITY;
    for round in 0..ROUNDS {
        if round == RENEWED {
            for j in 0..N {
                let mut beside = at;
                beside[j] += NUDGE / reach;
                slope.set_column(
                    j,
                    &((now.torque - missing(&beside).torque) / (NUDGE / reach)),
                );
            }
        }
        let friction = ImplicitFriction {
            set_valued: now.there.friction,
            smooth,
        };
        let end = friction.solve(&(slope / reach), (&now.speed, &now.torque), &speed)?;
        speed = end.speed;
        let change = (speed - now.speed) / reach;
        answered = (slope * change).amax();
        if !answered.is_finite() {
            return None;
        }
        if answered < TOLERANCES.0 {
            break;
        }
        at += change;
        let next = missing(&at);
        let gained = now.torque - next.torque;
        slope += (gained - slope * change) * change.transpose() / change.norm_squared();
        now = next;
    }
    Some(Slid {
        at,
        speed,
        there: now.there,
        slope,
        exact: answered < TOLERANCES.1,
    })
}

/// A solution with dry friction, with the slope that led there.
pub(super) struct Slid<const N: usize> {
    pub at: Joints<f64, N>,
    /// Zero where set-valued friction holds a joint \[rad/s\].
    pub speed: Joints<f64, N>,
    pub there: Balance<N>,
    pub slope: SMatrix<f64, N, N>,
    pub exact: bool,
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Motion;

    use super::*;

    fn balance(friction: f64) -> Balance<1> {
        Balance {
            torque: Joints::zeros(),
            resisted: Joints::zeros(),
            friction: Joints::repeat(friction),
            force: [0.0; 2],
            motion: Motion::new(0.0, Joints::zeros(), Joints::zeros()),
        }
    }

    /// Solves for the zero of a function of one number from 0, with an inverse slope of one.
    fn solved(missing: impl Fn(f64) -> f64) -> Option<Solved<1>> {
        let one = SMatrix::<f64, 1, 1>::identity();
        let missing = |x: &Joints<f64, 1>| (Joints::repeat(missing(x[0])), balance(0.0));
        newton(Joints::zeros(), [&one; 2], missing, 1e-7)
    }

    #[test]
    fn what_is_smooth_is_solved_with_corrected_slopes_and_what_is_not_with_its_own() {
        let root = |missing: fn(f64) -> f64| {
            let solved = solved(missing).expect("numbers");
            assert!(solved.exact && missing(solved.at[0]).abs() < 1e-7);
            solved.at[0]
        };
        assert!((root(|x| 0.8 - x - 0.1 * x * x) - 0.744).abs() < 1e-3);
        // A slope a hundred times as steep as the one given, and a contact that opens.
        assert!((root(|x| 5.0 - 100.0 * x) - 0.05).abs() < 1e-9);
        assert!((root(|x| 1.0 - 50.0 * f64::max(x - 0.3, 0.0) - 0.1 * x) - 0.3194).abs() < 1e-3);
    }

    #[test]
    fn what_has_no_solution_is_not_exact_and_what_leaves_all_numbers_is_none() {
        let stuck = solved(|x| 1.0 + x * x).expect("numbers");
        assert!(!stuck.exact && (1.0 + stuck.at[0] * stuck.at[0]) < 2.0);
        assert!(solved(|_| f64::NAN).is_none());
    }

    #[test]
    fn a_joint_that_slides_sticks_where_friction_holds_what_pulls_it() {
        // Unit inertia, friction up to 1 N m, steps of 0.01 s, speed 0 before.
        let slid = |pull: f64| {
            let missing = |next: &Joints<f64, 1>| MissingTorque {
                torque: Joints::repeat(pull - next[0]),
                speed: next * 0.01,
                there: balance(1.0),
            };
            let (slope, still) = ((SMatrix::identity(), 0.01), Joints::zeros());
            let slid = slide(still, slope, (&[], &still), missing).expect("numbers");
            assert!(slid.exact);
            (slid.at[0], slid.speed[0])
        };
        assert_eq!(slid(0.9), (0.0, 0.0));
        for (pull, faster) in [(1.5, 0.5), (-1.5, -0.5)] {
            let (found, speed) = slid(pull);
            assert!((found - faster).abs() < 1e-7 && (speed - 0.01 * faster).abs() < 1e-9);
        }
    }
}
