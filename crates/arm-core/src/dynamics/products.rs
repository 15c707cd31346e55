//! Products of masses and lengths that the dynamics need at every instant.

use core::array::from_fn;

use crate::dynamics::gravity::weight_moments;
use crate::{Chain, Lanes, Plane, Scalar};

/// Products of the parameters of a [`Chain`], computed once for a run.
#[derive(Clone, Copy, Debug)]
pub struct Products<T, const N: usize> {
    /// Lengths \[m\].
    pub(crate) length: [T; N],
    /// `a_i X_k` and `a_i H_k` at `[k][i]`, for i < k \[kg m²\].
    pub(crate) coupling: [[Plane<T>; N]; N],
    /// The diagonal of the inertia matrix in link angles, rotors included \[kg m²\].
    pub(crate) diagonal: [T; N],
    /// Rotor inertia at each joint \[kg m²\].
    pub(crate) rotor: [T; N],
    /// One over the first pivot of the inertia matrix, which no angle changes.
    pub(crate) first: T,
    /// Moments of the weight of a link and of all beyond it, with the link level and upright \[N m\].
    pub(crate) weight: [Plane<T>; N],
}

impl<T: Scalar, const N: usize> Products<T, N> {
    /// The products of an arm.
    #[inline(always)]
    pub fn of(chain: &Chain<T, N>) -> Self {
        let (a, rotor) = (from_fn(|i| chain.segments[i].length), chain.rotor);
        let product = |i: usize, k: usize| [a[i] * chain.x[k], a[i] * chain.h[k]];
        let pair = |k, i| if i < k { product(i, k) } else { [T::ZERO; 2] };
        // A rotor turns with the angle between two links.
        let own: [T; N] = from_fn(|k| chain.j[k] + rotor[k]);
        let diagonal: [T; N] = from_fn(|k| match rotor.get(k + 1) {
            Some(&next) => own[k] + next,
            None => own[k],
        });
        Self {
            length: a,
            coupling: from_fn(|k| from_fn(|i| pair(k, i))),
            diagonal,
            rotor,
            first: diagonal.first().map_or(T::ONE, |&first| T::ONE / first),
            weight: from_fn(|i| weight_moments(chain, i)),
        }
    }
}

impl<const L: usize, const N: usize> Products<Lanes<L>, N> {
    /// The products of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Products<f64, N> {
        let plane = |of: &Plane<Lanes<L>>| [of[0].0[lane], of[1].0[lane]];
        Products {
            length: from_fn(|i| self.length[i].0[lane]),
            coupling: from_fn(|k| from_fn(|i| plane(&self.coupling[k][i]))),
            diagonal: from_fn(|k| self.diagonal[k].0[lane]),
            rotor: from_fn(|k| self.rotor[k].0[lane]),
            first: self.first.0[lane],
            weight: from_fn(|i| plane(&self.weight[i])),
        }
    }
}
