//! Buffer of the inputs of a run, computed for several steps at a time in SIMD lanes.

use arm_core::Scalar;

use crate::Integrator;
use crate::closed_chain::state::Input;
use crate::integrators::step::Inputs;

/// Steps that are computed ahead.
const AHEAD: usize = 16;

/// The drive at the points of time that the steps of an integrator need.
pub(crate) struct InputBuffer<T, const N: usize> {
    /// From the start of step `first` on.
    block: Vec<Input<T, N>>,
    first: usize,
    /// Points of time a step: 1, or 2 where its middle is needed.
    points: usize,
}

/// The drive of some steps.
#[derive(Clone, Copy)]
pub(crate) struct Ahead<'a, T, const N: usize> {
    pub steps: usize,
    points: usize,
    inputs: &'a [Input<T, N>],
}

impl<T: Scalar, const N: usize> Ahead<'_, T, N> {
    /// The drive of the steps that remain after some.
    pub fn after(self, steps: usize) -> Self {
        Self {
            steps: self.steps - steps,
            inputs: &self.inputs[steps * self.points..],
            ..self
        }
    }

    /// What drives one of them, counted from zero.
    #[inline(always)]
    pub fn step(&self, step: usize) -> Inputs<'_, T, N> {
        let at = step * self.points;
        Inputs {
            start: &self.inputs[at],
            middle: &self.inputs[at + self.points / 2],
            end: &self.inputs[at + self.points],
        }
    }
}

impl<T: Scalar, const N: usize> InputBuffer<T, N> {
    pub fn new(integrator: Integrator) -> Self {
        let points = match integrator {
            Integrator::SemiImplicitEuler => 1,
            Integrator::Rk4 | Integrator::Imex => 2,
        };
        Self {
            block: Vec::with_capacity(AHEAD * points + 1),
            first: 0,
            points,
        }
    }

    /// What drives a step, the first has number 1, and the steps after it: as many as are known, at most `most`.
    ///
    /// * `compute` - appends the drive at given numbers of half steps
    #[inline(always)]
    pub fn ahead(
        &mut self,
        number: usize,
        most: usize,
        mut compute: impl FnMut(&[usize], &mut Vec<Input<T, N>>),
    ) -> Ahead<'_, T, N> {
        if self.block.is_empty() || number >= self.first + AHEAD {
            self.fill(number, &mut compute);
        }
        let steps = most.min(self.first + AHEAD - number);
        let from = (number - self.first) * self.points;
        Ahead {
            steps,
            points: self.points,
            inputs: &self.block[from..=from + steps * self.points],
        }
    }

    fn fill(&mut self, number: usize, compute: &mut impl FnMut(&[usize], &mut Vec<Input<T, N>>)) {
        // The start of the next step is the end of the last.
        let known = match self.block.last() {
            Some(&last) if number == self.first + AHEAD => {
                self.block[0] = last;
                1
            }
            _ => 0,
        };
        self.block.truncate(known);
        self.first = number;
        let mut at = [0; 2 * AHEAD + 1];
        for (i, at) in at.iter_mut().enumerate() {
            *at = 2 * (number - 1) + 2 / self.points * i;
        }
        compute(&at[known..AHEAD * self.points + 1], &mut self.block);
    }
}
