//! Score tests: the gain of each candidate to first order, with all nuisance parameters refitted.

use arm_numerics::linalg::matrix::add_scaled;
use arm_numerics::{Cholesky, Matrix};

use crate::GapError;
use crate::candidates::candidate::{Candidate, price};
use crate::candidates::library::{Library, LibraryEntry};
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::score_variance::{spread, trial_scores, unlike};
use crate::fitting::step::regularise;
use crate::hypothesis::{Coordinate, Hypothesis, priors};
use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::sensitivity::normal_equations::{Normal, solve};

/// The candidates' normal equations after everything else was projected off.
pub struct ScoreTest {
    /// Products of the candidates' columns.
    gram: Matrix,
    /// Their products with the residual.
    score: Vec<f64>,
    /// Columns of each candidate.
    columns: Vec<std::ops::Range<usize>>,
    /// How much more the score of each candidate scatters between repeats than the noise allows; at least one.
    pub spread: Vec<f64>,
    /// By how much movements differ in what each candidate gains, beyond chance; see [`unlike`].
    pub unlike: Vec<f64>,
    /// Gain of each candidate needed to be named.
    pub price: Vec<f64>,
    /// Misfit for each degree of freedom that no choice of candidates would take away; at least one, and one until it is measured
    /// by [`ScoreTest::scaled`].
    pub scale: f64,
    /// Cost before any choice, and degrees of freedom of the data.
    square: f64,
    freedom: f64,
    bounds: Vec<(f64, f64)>,
    /// Least size of each candidate whose two columns are one effect at two rest angles: their sum, which no bound of a column holds.
    least: Vec<Option<f64>>,
}

/// Some candidates together.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Which, in rising order.
    pub members: Vec<usize>,
    /// Coefficients of their columns.
    pub coefficients: Vec<Vec<f64>>,
    /// Reduction of the cost.
    pub gain: f64,
    /// What is left of it when all have paid; more than zero for a choice worth making.
    pub worth: f64,
}

impl ScoreTest {
    /// Projects nuisances and named effects off.
    ///
    /// # Errors
    /// [`GapError`] where the fitted hypothesis cannot be simulated or is singular.
    pub fn new<const N: usize>(
        prepared: &PreparedSession<N>,
        fitted: &FittedHypothesis<N>,
        point: &LinearizationPoint<N>,
        library: &Library,
    ) -> Result<Self, GapError> {
        let hypothesis = &fitted.hypothesis;
        let count = library.responses.iter().map(Vec::len).sum();
        let columns = library.columns(prepared, &point.rows);
        let (known, clusters) = prepared.equations(point, fitted, columns)?;
        let mut prior = priors(hypothesis, &known);
        prior.resize(known.len() + count, None);
        let mut normal = Normal::new(&clusters, &prior);
        regularise(&mut normal.gram, hypothesis, &known);
        let base = projected_off(&normal, &known, hypothesis);
        let first = known.len();
        let solver = Cholesky::new(normal.gram.select(&base, &base)).ok_or(GapError::Singular {
            unknowns: base.len(),
        })?;
        let asked: Vec<usize> = (first..first + count).collect();
        let cross = normal.gram.select(&base, &asked);
        let share = solver.solve_columns(&cross);
        let mut gram = normal.gram.select(&asked, &asked);
        gram.add_scaled(-1.0, &share.transpose_product(&cross));
        let of_base: Vec<f64> = base.iter().map(|&i| normal.score[i]).collect();
        let mut score = normal.score[first..first + count].to_vec();
        add_scaled(&mut score, -1.0, &share.transpose_times(&of_base));

        let mut ranges = Vec::with_capacity(library.candidates.len());
        let mut bounds = Vec::with_capacity(count);
        for candidate in &library.candidates {
            let start = bounds.len();
            bounds.extend((0..candidate.width()).map(|i| candidate.bounds(i)));
            ranges.push(start..bounds.len());
        }
        let rows = prepared.rows_of_references();
        let mut score_test = Self {
            gram,
            score,
            columns: ranges,
            spread: vec![1.0; library.candidates.len()],
            unlike: vec![0.0; library.candidates.len()],
            price: library
                .candidates
                .iter()
                .map(|c| price(c.width(), c.tried, rows))
                .collect(),
            scale: 1.0,
            square: normal.square,
            freedom: normal.rows.saturating_sub(base.len() + 10).max(1) as f64,
            bounds,
            least: library
                .candidates
                .iter()
                .map(Candidate::least_of_sum)
                .collect(),
        };
        let scattered = prepared.parallel(score_test.columns.len(), |index| {
            let choice = score_test.evaluate(&[index])?;
            // The direction in which the candidate was found, on its columns and on what was projected off.
            let range = score_test.columns[index].clone();
            let found: Vec<(usize, f64)> = range.zip(choice.coefficients[0].clone()).collect();
            let own = found.iter().map(|(c, b)| (first + c, *b));
            let others = base.iter().enumerate().map(|(a, &i)| {
                let sum = found.iter();
                (i, -sum.fold(0.0, |s, (c, b)| s + b * share[(a, *c)]))
            });
            let weights: Vec<(usize, f64)> = own.chain(others).collect();
            let scores = trial_scores(&clusters, &weights);
            Some((spread(&scores), unlike(&scores)))
        });
        for (index, found) in scattered.into_iter().enumerate() {
            if let Some(found) = found {
                (score_test.spread[index], score_test.unlike[index]) = found;
            }
        }
        Ok(score_test)
    }

    /// With the misfit measured that no choice takes away, in units of which worths and smallest sizes count.
    pub fn scaled(mut self) -> Self {
        let deepest = self.search(&[], 5, 8, &|_, _| true);
        let best = deepest.iter().map(|c| c.gain).fold(0.0, f64::max);
        self.scale = ((self.square - best) / self.freedom).max(1.0);
        self
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// What some candidates explain together; `None` where they cannot be distinguished, or one would be out of its bounds.
    pub fn evaluate(&self, members: &[usize]) -> Option<Choice> {
        self.answer(members, &self.score)
    }

    /// How well a candidate replaces a named effect: the share of its response, and the coefficients.
    pub fn stand_in(&self, candidate: usize, entry: &LibraryEntry) -> Option<(f64, Choice)> {
        let shown = self.columns[entry.place].clone().zip(&entry.sizes);
        let mut score = vec![0.0; self.score.len()];
        let mut all = 0.0;
        for (column, size) in shown.clone() {
            add_scaled(&mut score, *size, self.gram.column(column));
        }
        for (column, size) in shown {
            all += score[column] * size;
        }
        let choice = self.answer(&[candidate], &score)?;
        (all > 0.0).then(|| (choice.gain / all, choice))
    }

    /// What some candidates explain of something with the given products with their columns.
    fn answer(&self, members: &[usize], score: &[f64]) -> Option<Choice> {
        let columns: Vec<usize> = members
            .iter()
            .flat_map(|&m| self.columns[m].clone())
            .collect();
        let bounds = |i: usize| self.bounds[columns[i]];
        let (steps, gain) = solve(&self.gram, score, &columns, &bounds)?;
        let mut rest = steps.as_slice();
        let coefficients: Vec<Vec<f64>> = members
            .iter()
            .map(|&m| {
                let (own, others) = rest.split_at(self.columns[m].len());
                rest = others;
                own.to_vec()
            })
            .collect();
        let is_possible = |(&m, own): (&usize, &Vec<f64>)| {
            self.least[m].is_none_or(|least| own.iter().sum::<f64>() >= least)
        };
        if !std::iter::zip(members, &coefficients).all(is_possible) {
            return None;
        }
        let price: f64 = members
            .iter()
            .map(|&m| self.spread[m] * self.price[m])
            .sum();
        Some(Choice {
            members: members.to_vec(),
            coefficients,
            gain,
            worth: gain / self.scale - price,
        })
    }

    /// The best choices that extend `from`, up to `depth` candidates more, by a beam of the given width.
    ///
    /// All choices that were met are returned, the most worth first. A candidate without a gain alone is met
    /// with others beside it.
    pub fn search(
        &self,
        from: &[usize],
        depth: usize,
        width: usize,
        allowed: &dyn Fn(&[usize], usize) -> bool,
    ) -> Vec<Choice> {
        let mut all: Vec<Choice> = Vec::new();
        let mut beam = vec![from.to_vec()];
        for _ in 0..depth {
            let mut next: Vec<Choice> = Vec::new();
            for members in &beam {
                for candidate in 0..self.len() {
                    if members.contains(&candidate) || !allowed(members, candidate) {
                        continue;
                    }
                    let mut longer = members.clone();
                    longer.push(candidate);
                    longer.sort_unstable();
                    if next.iter().any(|c| c.members == longer) {
                        continue;
                    }
                    next.extend(self.evaluate(&longer));
                }
            }
            next.sort_by(|a, b| {
                b.worth
                    .total_cmp(&a.worth)
                    .then_with(|| a.members.cmp(&b.members))
            });
            all.extend(next.iter().take(8 * width).cloned());
            beam = next.into_iter().take(width).map(|c| c.members).collect();
        }
        all.sort_by(|a, b| {
            b.worth
                .total_cmp(&a.worth)
                .then_with(|| a.members.cmp(&b.members))
        });
        all
    }

    /// Smallest sizes of a candidate that would have been named, each alone, in the units of its free parameters.
    ///
    /// A rest angle that is free with a size makes it easier to detect, but is no size of its own.
    pub fn smallest_seen(&self, candidate: usize, sizes: usize) -> Vec<f64> {
        let price = self.scale * self.spread[candidate] * self.price[candidate];
        let mut columns = self.columns[candidate].clone();
        let own = columns.by_ref().take(sizes).map(|c| self.gram[(c, c)]);
        let mut information: Vec<f64> = own.collect();
        for column in columns {
            information[0] = information[0].max(self.gram[(column, column)]);
        }
        let least = information.into_iter().map(|i| match i > 0.0 {
            true => libm::sqrt(price / i),
            false => f64::INFINITY,
        });
        least.collect()
    }

    /// Squared cosine between what two candidates would show, after everything else was refitted.
    pub fn likeness(&self, a: usize, b: usize) -> f64 {
        let (i, j) = (self.columns[a].start, self.columns[b].start);
        let (aa, bb) = (self.gram[(i, i)], self.gram[(j, j)]);
        if aa > 0.0 && bb > 0.0 {
            let ab = self.gram[(i, j)];
            ab * ab / (aa * bb)
        } else {
            0.0
        }
    }
}

impl<const N: usize> PreparedSession<'_, N> {
    /// Number of rows with one trial of each group.
    pub fn rows_of_references(&self) -> usize {
        let mut seen = Vec::new();
        let mut rows = 0;
        for &trial in &self.fitted {
            if !seen.contains(&self.group_of[trial]) {
                seen.push(self.group_of[trial]);
                let told = self.valid_segments[trial].rows_per_channel(self.session.channels());
                rows += told.iter().sum::<usize>();
            }
        }
        rows.max(1)
    }
}
/// What is always refitted and can be: what nothing excites is left out, and what would leave its bounds.
fn projected_off<const N: usize>(
    normal: &Normal,
    known: &[Coordinate],
    hypothesis: &Hypothesis<N>,
) -> Vec<usize> {
    let free = |&i: &usize| {
        let (value, pull) = (hypothesis.get(known[i].target), normal.score[i]);
        !(value <= known[i].lower && pull < 0.0 || value >= known[i].upper && pull > 0.0)
    };
    (0..known.len())
        .filter(|&i| normal.gram[(i, i)] > 0.0)
        .filter(free)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns that are one spring at two rest angles, and one of another effect.
    fn scored(score: [f64; 3]) -> ScoreTest {
        ScoreTest {
            gram: Matrix::diagonal(&[1.0; 3]),
            score: score.to_vec(),
            columns: vec![0..2, 2..3],
            spread: vec![1.0; 2],
            unlike: vec![0.0; 2],
            price: vec![1.0; 2],
            scale: 1.0,
            square: 100.0,
            freedom: 50.0,
            bounds: vec![(f64::NEG_INFINITY, f64::INFINITY); 3],
            least: vec![Some(0.0), None],
        }
    }

    #[test]
    fn a_spring_of_less_than_no_stiffness_is_no_choice() {
        assert!(scored([3.0, -2.0, 5.0]).evaluate(&[0]).is_some());
        let softer = scored([2.0, -3.0, 5.0]);
        assert!(softer.evaluate(&[0]).is_none() && softer.evaluate(&[0, 1]).is_none());
        assert!(softer.evaluate(&[1]).is_some());
    }
}
