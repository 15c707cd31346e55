//! Estimation of the noise of a session, from deviations between repeats or from the residuals of a hypothesis.

use std::sync::Arc;

use arm_numerics::statistics::extent::extent;
use arm_numerics::{Cholesky, Matrix};

use crate::GapError;
use crate::data::course::Channels;
use crate::data::noise::{NoiseModel, Thinned, dot};
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::precision::decided;
use crate::linearization::linear_response::Response;
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::rows::Columns;

impl<const N: usize> PreparedSession<'_, N> {
    /// Reads the noise anew: what repeats differ in, or without repeats what a hypothesis leaves.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for series that no noise can be read off.
    pub fn measure_noise(&mut self, point: &LinearizationPoint<N>) -> Result<(), GapError> {
        let observed_share = self.observed_share();
        let mut deviations = Vec::new();
        // For each deviation what a trial may differ by without noise.
        let mut shifts: Vec<Arc<Vec<Thinned>>> = Vec::new();
        for repeats in self.repeats(point) {
            let own = point.own.iter();
            let columns = own.map(|r| Thinned::of(&r.0[repeats.group], &repeats.samples));
            let columns = Arc::new(columns.collect::<Vec<_>>());
            for deviation in repeats.deviations() {
                deviations.push(deviation);
                shifts.push(Arc::clone(&columns));
            }
        }
        self.repeated = !deviations.is_empty();
        let range = self.ranges(&point.residuals);
        self.noise = if self.repeated {
            self.noise_of((&deviations, &[]), &shifts, (&range, &observed_share))?
                .weighed(&self.courses)
        } else {
            self.noise_of_residuals(point, (&range, &observed_share))?
        };
        Ok(())
    }

    /// Reads the noise off what a model that explains the data leaves of all fitted trials, which is more than repeats differ in: of slow
    /// noise a trial of ten seconds holds few independent samples. What the model lacks is in it too.
    ///
    /// # Errors
    /// As [`PreparedSession::responses_at`].
    pub fn measure_noise_left(
        &mut self,
        point: &LinearizationPoint<N>,
        fitted: &FittedHypothesis<N>,
    ) -> Result<(), GapError> {
        let named = self.responses_at(point, &fitted.hypothesis, &fitted.named())?;
        let each: Vec<&Response> = named.iter().collect();
        let (coordinates, clusters) =
            self.equations_with(point, fitted, (&each, &Columns::default()));
        let Some((free, factor)) = decided(fitted, &coordinates, &clusters) else {
            return Ok(());
        };
        let mut responses = self.responses_to(point, &point.coordinates)?;
        responses.extend(named);
        let spread = factor.spread();
        let (mut deviations, mut taken, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
        let known = |trial: usize| self.courses[trial].weight == 1.0;
        let each = fitted.residuals.iter().zip(&self.fitted);
        for (residuals, &trial) in each.filter(|&(_, &trial)| known(trial)) {
            let (group, samples) = (self.group_of[trial], &self.valid_segments[trial]);
            let picked = |r: &Response| Thinned::of(&r.0[group], samples);
            let columns: Vec<Thinned> = free.iter().map(|&i| picked(&responses[i])).collect();
            taken.extend(spread.iter().map(|shares| sum(&columns, shares)));
            deviations.push(Thinned::of(residuals, samples));
            shifts.push(Arc::new(point.own.iter().map(picked).collect()));
        }
        if deviations.is_empty() {
            return Ok(());
        }
        let (range, observable_share) = (self.ranges(&point.residuals), self.observed_share());
        let noise = self.noise_of((&deviations, &taken), &shifts, (&range, &observable_share))?;
        self.noise = noise.weighed(&self.courses);
        Ok(())
    }

    /// The size of each channel.
    fn ranges(&self, residuals: &[Channels]) -> Vec<f64> {
        let range = |c: usize| {
            // An arm that swings freely has no torque to show, but its inertia has.
            let seen = self.fitted.iter().flat_map(|&t| &self.courses[t].seen[c]);
            let all = seen.chain(residuals.iter().flat_map(|r| &r[c]));
            let (low, high) = extent(all.copied());
            (high - low).max(0.0)
        };
        (0..self.session.channels()).map(range).collect()
    }

    /// The share of the samples of each channel that are observable.
    fn observed_share(&self) -> Vec<f64> {
        let channels = self.session.channels();
        let all: usize = self
            .fitted
            .iter()
            .map(|&t| self.valid_segments[t].len())
            .sum();
        let counts = self
            .fitted
            .iter()
            .map(|&t| self.valid_segments[t].rows_per_channel(channels));
        let sum = counts.fold(vec![0; channels], |sum, own| {
            std::iter::zip(sum, own).map(|(a, b)| a + b).collect()
        });
        sum.into_iter()
            .map(|n: usize| n as f64 / all.max(1) as f64)
            .collect()
    }

    /// The noise of deviations, and how far each is shifted, found in turns: as much is taken for a shift as the noise and
    /// what is known of shifts allow.
    ///
    /// * `fitted` - the like of [`NoiseModel::of`]'s `taken`, of what is common to all deviations
    fn noise_of(
        &self,
        (deviations, fitted): (&[Thinned], &[Thinned]),
        shifts: &[Arc<Vec<Thinned>>],
        (range, observable_share): (&[f64], &[f64]),
    ) -> Result<NoiseModel, GapError> {
        /// Alternations: the noise weights the fit of the shifts of trials, and residuals without the shifts give the noise.
        const ITERATIONS: usize = 3;
        let known: Vec<f64> = self
            .session
            .by_trial()
            .iter()
            .map(|c| c.prior.map_or(f64::INFINITY, |(_, sd)| sd))
            .collect();
        // The torques of one force vary together. What they leave over between them, no noise of the force is in: it would count most, and
        // there the noise of speeds makes all that resists too small.
        let apart = self.session.compares_contact_torques();
        let of = |deviations: &[Thinned], taken: &[Thinned]| {
            let noise = NoiseModel::of(deviations, taken, range, observable_share)?;
            Ok::<_, GapError>(if apart { noise.uncorrelated() } else { noise })
        };
        let mut noise = of(deviations, fitted)?;
        for _ in 0..ITERATIONS {
            if known.is_empty() {
                break;
            }
            let mut clean = deviations.to_vec();
            let mut taken = fitted.to_vec();
            for (deviation, columns) in clean.iter_mut().zip(shifts) {
                let whitening = noise.whitening_at(deviation.observed());
                let white = |series: &Thinned| noise.rows(series.channels.clone(), &whitening);
                let row = white(deviation);
                let each = columns.iter().map(white);
                let whitened: Vec<Vec<f64>> = each.collect();
                let k = known.len();
                let gram = Matrix::from_fn(k, k, |a, b| {
                    let own = if a == b {
                        1.0 / (known[a] * known[a])
                    } else {
                        0.0
                    };
                    dot(&whitened[a], &whitened[b]) + own
                });
                let score: Vec<f64> = whitened.iter().map(|w| -dot(w, &row)).collect();
                let Some(solver) = Cholesky::new(gram) else {
                    continue;
                };
                add(deviation, columns, &solver.solve(&score));
                taken.extend(solver.spread().iter().map(|shares| sum(columns, shares)));
            }
            noise = of(&clean, &taken)?;
        }
        Ok(noise)
    }
}

/// Shares of columns, which are some, together.
fn sum(columns: &[Thinned], shares: &[f64]) -> Thinned {
    let mut series = columns[0].clone();
    series.channels.iter_mut().for_each(|c| c.fill(0.0));
    add(&mut series, columns, shares);
    series
}

/// Adds shares of columns, each with its channels, to a series.
fn add(series: &mut Thinned, columns: &[Thinned], shares: &[f64]) {
    for (share, column) in shares.iter().zip(columns) {
        let values = series.channels.iter_mut().flatten();
        for (value, part) in values.zip(column.channels.iter().flatten()) {
            *value += share * part;
        }
    }
}
