//! Fit of free swings by simulation.
//!
//! Effects are selected by the equation of motion at every sample. The size of a loss is better estimated from the amplitudes
//! of the oscillation: short runs are simulated from starts of their own, which are fitted with everything else (multiple shooting),
//! and the angles are compared. A law that is not exact near rest then still takes the energy that the arm loses.

use arm_core::Joints;
use arm_numerics::linalg::matrix::add_scaled;
use arm_numerics::statistics::autoregressive::effective_samples;
use arm_numerics::{Cholesky, Matrix};

use crate::data::course::Channels;
use crate::data::noise::dot;
use crate::fitting::fit::FittedHypothesis;
use crate::fitting::precision::Precision;
use crate::hypothesis::priors;
use crate::hypothesis::{Coordinate, Hypothesis};
use crate::measurement_model::free_run::{CHANGE, State, slope_into};
use crate::prepared_session::PreparedSession;
use crate::sensitivity::normal_equations::solve;

/// Length of a run \[s\].
const WINDOW: f64 = 2.0;
/// Most steps of Gauss and Newton's method.
const MOST_STEPS: usize = 8;
/// Most halvings of a step.
const HALVINGS: usize = 4;
/// A step that lowers the cost by less than this share is the last.
const LEAST_GAIN: f64 = 1e-3;
/// Floor of the residual \[rad\]: the last digit of an encoder.
const LEAST: f64 = 1e-6;

/// One run: its trial, first sample and number of samples.
type Window = (usize, usize, usize);

/// A run linearised: what its own start leaves of the residual and of the columns, and how the start follows.
struct Piece {
    slopes: Matrix,
    starts: Matrix,
    residual: Vec<f64>,
}

/// A step tried from where the runs were linearised.
struct Step<const N: usize> {
    /// What is fitted afterwards, and the share of the cost that it gains; `None` where no step lowers the cost.
    next: Option<(Swing<N>, f64)>,
    /// Normal equations of what is common to all runs.
    gram: Matrix,
    /// What each run adds to their right-hand side.
    scores: Vec<Vec<f64>>,
}

/// What is fitted.
#[derive(Clone)]
struct Swing<const N: usize> {
    hypothesis: Hypothesis<N>,
    states: Vec<State<N>>,
    residuals: Vec<Vec<f64>>,
}

impl<const N: usize> PreparedSession<'_, N> {
    /// Fits nuisances and named effects of free swings anew, by the angles of simulated runs.
    ///
    /// `None` where the arm is not free, or cannot be followed; then what was fitted before stands.
    pub fn refined(&self, fitted: &FittedHypothesis<N>) -> Option<(Hypothesis<N>, Precision)> {
        if !self.session.swings_freely() {
            return None;
        }
        let coordinates: Vec<Coordinate> = self
            .session
            .nuisances()
            .into_iter()
            .chain(fitted.named())
            .collect();
        let windows = self.windows();
        let state = |&(trial, start, _): &Window| {
            let motion = self.courses[trial].motion()?;
            Some((motion.q[start], motion.qd[start]))
        };
        let states = windows.iter().map(state).collect::<Option<Vec<_>>>()?;
        let mut swing = self.swung(&windows, fitted.hypothesis.clone(), states)?;
        let mut last = None;
        for _ in 0..MOST_STEPS {
            let pieces = self.pieces(&windows, &swing, &coordinates)?;
            let weights = self.weights(&windows, &swing)?;
            let step = self.step(&windows, &swing, (&coordinates, &pieces, &weights))?;
            last = Some((step.gram, step.scores));
            let Some((next, gained)) = step.next else {
                break;
            };
            swing = next;
            if gained < LEAST_GAIN {
                break;
            }
        }
        let (gram, scores) = last?;
        let inverse = Cholesky::new(gram)?.inverse();
        let sd = (0..coordinates.len())
            .map(|i| {
                let row = inverse.column(i);
                // Runs differ by more than their noise where the model is not exact.
                let between: f64 = scores.iter().map(|s| dot(row, s)).map(|d| d * d).sum();
                libm::sqrt(f64::max(inverse[(i, i)], between))
            })
            .collect();
        Some((swing.hypothesis, Precision { coordinates, sd }))
    }

    /// Stretches of the fitted trials, one after the other; a rest shorter than half of one is left out.
    fn windows(&self) -> Vec<Window> {
        let mut out = Vec::new();
        for &trial in &self.fitted {
            let (valid, rate) = (&self.session.trials[trial].valid, self.courses[trial].rate);
            let length = libm::round(WINDOW * rate) as usize;
            let mut start = 0;
            for i in 0..=valid.len() {
                let ends = i == valid.len() || !valid[i];
                if ends || i - start == length {
                    if i - start >= length / 2 {
                        out.push((trial, start, i - start));
                    }
                    start = if ends { i + 1 } else { i };
                }
            }
        }
        out
    }

    /// Measured less simulated angles of one run.
    fn left(
        &self,
        hypothesis: &Hypothesis<N>,
        &(trial, start, count): &Window,
        state: &State<N>,
    ) -> Option<Vec<f64>> {
        let course = &self.courses[trial];
        let shown: Channels = self
            .session
            .angles(hypothesis, course, (start, count), state)
            .ok()?;
        let q = &self.session.trials[trial].q;
        let each = (0..N).flat_map(|j| (0..count).map(move |i| (j, i)));
        let rows = each.map(|(j, i)| q[start + i][j] - shown[j][i]);
        let rows: Vec<f64> = rows.collect();
        rows.iter().all(|v| v.is_finite()).then_some(rows)
    }

    fn swung(
        &self,
        windows: &[Window],
        hypothesis: Hypothesis<N>,
        states: Vec<State<N>>,
    ) -> Option<Swing<N>> {
        let each = self.parallel(windows.len(), |w| {
            self.left(&hypothesis, &windows[w], &states[w])
        });
        Some(Swing {
            residuals: each.into_iter().collect::<Option<Vec<_>>>()?,
            hypothesis,
            states,
        })
    }

    /// Every run linearised.
    fn pieces(
        &self,
        windows: &[Window],
        swing: &Swing<N>,
        coordinates: &[Coordinate],
    ) -> Option<Vec<Piece>> {
        let one = |w: usize| {
            let (window, state, residual) = (&windows[w], &swing.states[w], &swing.residuals[w]);
            let mut starts = Matrix::zeros(residual.len(), 2 * N);
            for column in 0..2 * N {
                let (mut moved, change) = (*state, CHANGE[column / N]);
                let part = if column < N {
                    &mut moved.0
                } else {
                    &mut moved.1
                };
                part[column % N] += change;
                let other = self.left(&swing.hypothesis, window, &moved)?;
                slope_into(starts.column_mut(column), residual, &other, change);
            }
            let mut slopes = Matrix::zeros(residual.len(), coordinates.len());
            for (column, c) in coordinates.iter().enumerate() {
                let value = swing.hypothesis.get(c.target);
                let change = if value + c.step > c.upper {
                    -c.step
                } else {
                    c.step
                };
                let moved = swing.hypothesis.clone().with(c.target, value + change);
                let other = self.left(&moved, window, state)?;
                slope_into(slopes.column_mut(column), residual, &other, change);
            }
            Some(Piece {
                slopes,
                starts,
                residual: residual.clone(),
            })
        };
        self.parallel(windows.len(), one).into_iter().collect()
    }

    /// One over the variance of each run's joints, larger by as much as the residual is correlated in time; repeated by sample.
    fn weights(&self, windows: &[Window], swing: &Swing<N>) -> Option<Vec<Vec<f64>>> {
        let square = |w: usize, j: usize| {
            let count = windows[w].2;
            let own = &swing.residuals[w][j * count..(j + 1) * count];
            dot(own, own) / count as f64
        };
        let mean: Vec<f64> = (0..N)
            .map(|j| (0..windows.len()).map(|w| square(w, j)).sum::<f64>() / windows.len() as f64)
            .collect();
        let one = |w: usize| {
            let count = windows[w].2;
            let mut out = vec![0.0; N * count];
            for j in 0..N {
                let samples = j * count..(j + 1) * count;
                let own = &swing.residuals[w][samples.clone()];
                let effective = effective_samples(own).ok()?.max(1.0);
                // No run has more than a hundred times the weight of their mean.
                let variance = square(w, j) + 0.01 * mean[j] + LEAST * LEAST;
                let weight = effective / count as f64 / variance;
                out[samples].fill(weight);
            }
            Some(out)
        };
        (0..windows.len()).map(one).collect()
    }

    /// One step of Gauss and Newton's method, halved until it lowers the cost.
    fn step(
        &self,
        windows: &[Window],
        swing: &Swing<N>,
        (coordinates, pieces, weights): (&[Coordinate], &[Piece], &[Vec<f64>]),
    ) -> Option<Step<N>> {
        let n = coordinates.len();
        let mut gram = Matrix::zeros(n, n);
        let mut score = vec![0.0; n];
        let (mut scores, mut followers) = (Vec::new(), Vec::new());
        for (piece, weight) in std::iter::zip(pieces, weights) {
            let own = piece.starts.scaled_rows(weight);
            let solver = Cholesky::new(own.transpose_product(&piece.starts))?;
            let follow = solver.solve_columns(&own.transpose_product(&piece.slopes));
            let free = solver.solve(&own.transpose_times(&piece.residual));
            let mut common = piece.slopes.clone();
            common.add_scaled(-1.0, &piece.starts.product(&follow));
            let common = common.scaled_rows(weight);
            gram.add_scaled(1.0, &common.transpose_product(&piece.slopes));
            let part = common.transpose_times(&piece.residual);
            add_scaled(&mut score, 1.0, &part);
            scores.push(part);
            followers.push((follow, free));
        }
        let known = priors(&swing.hypothesis, coordinates);
        for (i, prior) in known.iter().enumerate() {
            if let Some((distance, sd)) = prior {
                gram[(i, i)] += 1.0 / (sd * sd);
                score[i] -= distance / (sd * sd);
            }
        }
        let usable: Vec<usize> = (0..n).filter(|&i| gram[(i, i)] > 0.0).collect();
        let bounds = |i: usize| {
            let c = &coordinates[usable[i]];
            let value = swing.hypothesis.get(c.target);
            (c.lower - value, c.upper - value)
        };
        let (steps, _) = solve(&gram, &score, &usable, &bounds)?;
        let mut whole = vec![0.0; n];
        for (&i, step) in usable.iter().zip(steps) {
            whole[i] = step;
        }
        let cost = |s: &Swing<N>| {
            let known = priors(&s.hypothesis, coordinates).into_iter().flatten();
            let known: f64 = known.map(|(d, sd)| d * d / (sd * sd)).sum();
            let each = std::iter::zip(&s.residuals, weights);
            let data: f64 = each
                .map(|(r, w)| std::iter::zip(r, w).map(|(r, w)| w * r * r).sum::<f64>())
                .sum();
            known + data
        };
        let before = cost(swing);
        let mut share = 1.0;
        let next = (0..HALVINGS).find_map(|_| {
            let mut hypothesis = swing.hypothesis.clone();
            for (c, step) in coordinates.iter().zip(&whole) {
                let value = hypothesis.get(c.target) + share * step;
                hypothesis = hypothesis.with(c.target, value.clamp(c.lower, c.upper));
            }
            let states = std::iter::zip(&swing.states, &followers)
                .map(|((q, qd), (follow, free))| {
                    let followed = follow.times(&whole);
                    let part = |from: usize| {
                        Joints::from_fn(|j, _| share * (free[from + j] - followed[from + j]))
                    };
                    (q + part(0), qd + part(N))
                })
                .collect();
            share *= 0.5;
            let next = self.swung(windows, hypothesis, states)?;
            let gained = 1.0 - cost(&next) / before;
            (gained > 0.0).then_some((next, gained))
        });
        Some(Step { next, gram, scores })
    }
}
