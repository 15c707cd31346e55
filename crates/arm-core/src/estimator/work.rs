//! The work on a full window.

use super::information::Row;
use super::schedule::{Work, split};
use super::{Decision, Estimate, Estimator};
use crate::numeric::covariance::copy_triangle;
use crate::numeric::scalar::Real;

/// Share of the prior's variance that the data must have taken away before an unknown counts as identified.
const MEASURED: f64 = 0.9;
/// Windows over which the size of the residual is averaged.
const LONG: f64 = 100.0;
/// Largest correlation between neighbouring windows that is used.
const MOST_CORRELATED: f64 = 0.9;

impl<T: Real, const N: usize, const P: usize, const E: usize> Estimator<T, N, P, E> {
    /// What a period can afford of the work on the full window, at least one unit.
    pub(super) fn work(&mut self) {
        let (mut left, mut first) = (self.tuning.budget, true);
        loop {
            let cost = self.work.cost([N, P]);
            if !first && (self.work == Work::Idle || cost > left) {
                return;
            }
            self.work_once();
            left = left.saturating_sub(cost);
            first = false;
        }
    }

    /// One unit of work.
    #[inline(never)]
    fn work_once(&mut self) {
        self.work = match self.work {
            Work::Idle => Work::Idle,
            Work::Wait(0) => Work::Row(0),
            Work::Wait(periods) => Work::Wait(periods - 1),
            Work::Row(number) => {
                self.row = match number.checked_sub(1) {
                    None => self.forget(),
                    Some(j) => self.windows.full().mean(j, &self.tuning),
                };
                self.absorb(0, split(P));
                Work::Rest(number)
            }
            Work::Rest(number) => {
                self.absorb(split(P), P);
                if number < N {
                    Work::Row(number + 1)
                } else {
                    Work::Copy
                }
            }
            Work::Copy => {
                self.bounded.set(&self.information);
                self.fixed = [false; P];
                Work::Solve
            }
            Work::Solve => self.solve(),
            Work::Fix { unknown, upper } => {
                if let Some(prior) = self.priors.get(unknown) {
                    let to = if upper { prior.max } else { prior.min };
                    self.bounded.fix(unknown, to);
                }
                if let Some(fixed) = self.fixed.get_mut(unknown) {
                    *fixed = true;
                }
                Work::Solve
            }
            Work::Publish => {
                self.publish();
                Work::Deviations(0)
            }
            Work::Deviations(first) => {
                self.judge(first);
                if first + N < P {
                    Work::Deviations(first + N)
                } else {
                    // The last rows are short, which leaves time for this.
                    copy_triangle(&mut self.covariance.root, &self.bounded.u);
                    Work::Idle
                }
            }
        }
    }

    /// Takes in what some unknowns have of the row in work.
    fn absorb(&mut self, first: usize, end: usize) {
        if let Some(row) = &mut self.row {
            self.information.absorb(row, first, end);
        }
    }

    /// Forgets; returns the prior row of the next unknown.
    fn forget(&mut self) -> Option<Row<T, P>> {
        if self.tuning.fade >= T::ONE {
            return None;
        }
        self.information.fade(self.tuning.fade);
        let unknown = self.prior_row;
        self.prior_row = if unknown + 1 < P { unknown + 1 } else { 0 };
        let prior = self.priors.get(unknown)?;
        let mut columns = [T::ZERO; P];
        *columns.get_mut(unknown)? = T::ONE;
        Some(Row {
            columns,
            value: prior.mean,
            weight: self.tuning.refresh / prior.sd.squared(),
        })
    }

    /// Solves, and finds the unknown that lies farthest outside its bounds; when none does, the values stand.
    fn solve(&mut self) -> Work {
        self.bounded.solve(&mut self.solution);
        let values = &self.solution;
        let mut next = Work::Publish;
        let mut most = T::ZERO;
        for i in 0..P {
            let prior = &self.priors[i];
            let within = values[i].max(prior.min).min(prior.max);
            let outside = (values[i] - within).squared() * self.bounded.sharpness(i);
            if outside > most && !self.fixed[i] {
                most = outside;
                let upper = values[i] > prior.max;
                next = Work::Fix { unknown: i, upper };
            }
        }
        if next != Work::Publish {
            return next;
        }
        if !values.iter().all(|value| value.is_finite()) {
            return self.forget_all();
        }
        next
    }

    /// Starts anew from the priors: what was learned holds a value that is not finite.
    #[cold]
    #[inline(never)]
    fn forget_all(&mut self) -> Work {
        self.information
            .restart(self.priors.iter().map(|p| (p.mean, p.sd)));
        for (estimate, prior) in self.estimates.iter_mut().zip(&self.priors) {
            *estimate = Estimate::of_prior(prior);
        }
        self.covariance.restart(self.priors.iter().map(|p| p.sd));
        self.residual = [T::ZERO; 2];
        self.last_residual = [None; N];
        self.judged = T::ZERO;
        self.excess = T::ONE;
        self.restart();
        Work::Idle
    }

    /// Publishes the new values, and counts what they leave of the window.
    fn publish(&mut self) {
        for i in 0..P {
            let prior = &self.priors[i];
            self.estimates[i].value = self.solution[i].max(prior.min).min(prior.max);
            self.deviations[i] = (T::ONE / self.information.d[i]).sqrt();
        }
        self.judged = (self.judged + T::ONE).min(T::of(LONG));
        let (mut square, mut product, mut count) = (T::ZERO, T::ZERO, T::ZERO);
        for j in 0..N {
            let Some(row) = self.windows.full().mean(j, &self.tuning) else {
                self.last_residual[j] = None;
                continue;
            };
            let pairs = row.columns.iter().zip(&self.estimates);
            let rest = pairs.fold(row.value, |r, (&c, e)| r - c * e.value);
            square += row.weight * rest.squared();
            product += row.weight * rest * self.last_residual[j].unwrap_or(T::ZERO);
            count += T::ONE;
            self.last_residual[j] = Some(rest);
        }
        if count > T::ZERO {
            let share = T::ONE / self.judged;
            let [old_square, old_product] = self.residual;
            self.residual = [
                old_square + share * (square / count - old_square),
                old_product + share * (product / count - old_product),
            ];
        }
        let [square, product] = self.residual;
        let alike = T::if_less(T::ZERO, square, product / square, T::ZERO);
        let alike = alike.max(T::ZERO).min(T::of(MOST_CORRELATED));
        self.excess = (square.max(T::ONE) * (T::ONE + alike) / (T::ONE - alike)).sqrt();
    }

    /// How certain some unknowns are, from one on, and by what; their rows of the root of the next covariance.
    fn judge(&mut self, first: usize) {
        // Where fewer are left, some before are computed again.
        let first = first.min(P.saturating_sub(N));
        let places = self.bounded.u.get_mut(first..);
        let Some(rows) = places.and_then(|rows| rows.first_chunk_mut::<N>()) else {
            return;
        };
        self.information.inverse_rows(first, rows);
        let estimates = self.estimates.iter_mut().zip(&self.priors).zip(&self.fixed);
        for (((estimate, prior), &fixed), row) in estimates.skip(first).zip(rows) {
            let mut variance = T::ZERO;
            for (place, &sd) in row.iter_mut().zip(&self.deviations) {
                *place = *place * sd;
                variance += place.squared();
            }
            let sd = variance.sqrt() * self.excess;
            let left = (sd / prior.sd).squared();
            estimate.sd = sd.min(prior.sd);
            estimate.decided_by = if fixed {
                Decision::Bound
            } else if left < T::of(1.0 - MEASURED) {
                Decision::Data
            } else {
                Decision::Prior
            };
        }
    }
}
