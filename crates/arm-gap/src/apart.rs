//! What is not the same in every trial, or swings too fast for the common band: rhythms, the robot's ripple, and
//! disturbances of one trial.

use arm_core::effect::{Effect, KINDS, Kind, Nature};
use nalgebra::{DMatrix, DVector};

use crate::GapError;
use crate::fit::Fitted;
use crate::noise::{Stretches, dot};
use crate::normal::factor;
use crate::predict::Channels;
use crate::response::Linear;
use crate::spectrum::{coefficient, line};
use crate::study::{Study, difference};

/// An effect that stands apart from the fit of all trials.
#[derive(Clone, Debug)]
pub struct Apart {
    /// The effect; for a rhythm its phase is that of the first trial.
    pub effect: Effect<f64>,
    /// Standard deviation of its first parameter.
    pub sd: f64,
    /// The trial in which it is, for what happened once.
    pub trial: Option<usize>,
    /// What it gains, in units of twice the log-likelihood.
    pub gain: f64,
    /// Others that explain as much.
    pub rivals: Vec<(Effect<f64>, f64)>,
    /// Whether its phase is the same in every trial.
    pub locked: bool,
}

/// Gain in which two explanations of a rhythm count as equal.
const TIE: f64 = 10.0;
/// Coherence of the phases of trials above which a rhythm is locked to their start.
const LOCKED: f64 = 0.8;

impl<const N: usize> Study<'_, N> {
    /// Rhythms and ripple: a line in the spectrum of what is left, named by the pattern in which the channels follow.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis cannot be simulated.
    pub fn rhythm(&self, fitted: &Fitted<N>) -> Result<Option<Apart>, GapError> {
        let residuals = self.raw_residuals(fitted)?;
        let rate = self.courses[self.fitted[0]].rate;
        if self.fitted.iter().any(|&t| self.courses[t].rate != rate) {
            return Ok(None);
        }
        let lists: Vec<&Channels> = residuals.iter().collect();
        let Some(frequency) = line(&lists, rate) else {
            return Ok(None);
        };
        let mut best: Vec<(f64, Explained)> = Vec::new();
        for columns in self.swings(frequency) {
            if let Some(explained) = self.explain(fitted, &residuals, frequency, &columns)? {
                let worth = explained.gain - 8.0 * columns.len() as f64;
                best.push((worth, explained));
            }
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut list = best.into_iter();
        let Some((most, first)) = list.next() else {
            return Ok(None);
        };
        let rivals = list
            .filter(|(worth, other)| {
                worth + TIE > most && other.effect.kind != first.effect.kind
                    || worth + TIE > most && other.effect.index != first.effect.index
            })
            .map(|(worth, other)| (other.effect, most - worth))
            .collect();
        Ok(Some(Apart {
            effect: first.effect,
            sd: first.sd,
            trial: None,
            gain: first.gain,
            rivals,
            locked: first.locked,
        }))
    }

    fn raw_residuals(&self, fitted: &Fitted<N>) -> Result<Vec<Channels>, GapError> {
        let one = |i: usize| {
            let trial = self.fitted[i];
            let course = &self.courses[trial];
            let run = self.session.run(&fitted.hypothesis, course)?;
            let read = self.session.read_raw(&fitted.hypothesis, course, &run)?;
            Ok(difference(&course.raw, &read))
        };
        std::iter::zip(self.parallel(self.fitted.len(), one), &self.fitted)
            .map(|(outcome, &trial)| {
                outcome.map_err(|source| GapError::Simulation { trial, source })
            })
            .collect()
    }

    /// What can swing at a frequency: for each explanation the effects whose swings it adds up.
    fn swings(&self, frequency: f64) -> Vec<Vec<Effect<f64>>> {
        let mut list = Vec::new();
        for &kind in KINDS {
            match kind.probe().nature {
                Nature::Rhythm => {
                    list.extend((0..N).map(|j| vec![swinging(kind, j, 0, frequency)]));
                }
                Nature::Periodic => {
                    let axes: Vec<Effect<f64>> = kind.probe().questions[0]
                        .free
                        .iter()
                        .map(|&p| swinging(kind, 0, p, frequency))
                        .collect();
                    list.extend(axes.iter().map(|&axis| vec![axis]));
                    list.push(axes);
                }
                Nature::Lasting | Nature::Burst => {}
            }
        }
        list
    }

    /// How much of the line some swings explain, with a size and phase of their own in every trial.
    fn explain(
        &self,
        fitted: &Fitted<N>,
        residuals: &[Channels],
        frequency: f64,
        columns: &[Effect<f64>],
    ) -> Result<Option<Explained>, GapError> {
        const UNIT: f64 = 1e-3;
        let rate = self.courses[self.fitted[0]].rate;
        let channels = self.session.channels();
        // The noise of each channel next to the line.
        let beside = [-0.9, -0.6, 0.6, 0.9].map(|d| frequency + d);
        let noise: Vec<f64> = (0..channels)
            .map(|c| {
                let powers = residuals.iter().flat_map(|r| {
                    beside
                        .iter()
                        .map(move |&f| coefficient(&r[c], f, rate))
                        .map(|[a, b]| a * a + b * b)
                });
                let (sum, count) = powers.fold((0.0, 0.0), |(s, n), p| (s + p, n + 1.0));
                f64::max(sum / f64::max(count, 1.0), 1e-30)
            })
            .collect();
        let swing = |group: usize| -> Option<Vec<Vec<[f64; 2]>>> {
            let course = &self.courses[self.references[group]];
            let linear = Linear::along(self.session, &fitted.hypothesis, course).ok()??;
            columns
                .iter()
                .map(|effect| {
                    let mut changed = fitted.hypothesis.clone();
                    let mut small = *effect;
                    small.parameters = small.parameters.map(|v| if v == 1.0 { UNIT } else { v });
                    // The frequency may be one as well: it is set again.
                    small.parameters[small_frequency(effect.kind)] = frequency;
                    changed.named.push(small);
                    let response = linear.response_raw(&changed, UNIT, (false, false))?;
                    let swings = response.iter().map(|c| coefficient(c, frequency, rate));
                    Some(swings.collect())
                })
                .collect()
        };
        let swings = self.parallel(self.references.len(), swing);
        let k = columns.len();
        let (mut gain, mut sizes) = (0.0, Vec::new());
        let mut information = 0.0;
        for (residual, &trial) in residuals.iter().zip(&self.fitted) {
            let Some(swings) = &swings[self.group_of[trial]] else {
                return Ok(None);
            };
            // Complex least squares as real ones: each column turned by 0 and by 90°.
            let mut gram = DMatrix::zeros(2 * k, 2 * k);
            let mut score = DVector::zeros(2 * k);
            for c in 0..channels {
                let seen = coefficient(&residual[c], frequency, rate);
                let turned: Vec<[f64; 2]> = swings
                    .iter()
                    .flat_map(|s| [s[c], [-s[c][1], s[c][0]]])
                    .collect();
                for (a, x) in turned.iter().enumerate() {
                    score[a] += (x[0] * seen[0] + x[1] * seen[1]) / noise[c];
                    for (b, y) in turned.iter().enumerate() {
                        gram[(a, b)] += (x[0] * y[0] + x[1] * y[1]) / noise[c];
                    }
                }
            }
            information += gram[(0, 0)];
            let Some(solver) = factor(gram) else {
                return Ok(None);
            };
            let solution = solver.solve(&score);
            gain += 2.0 * solution.dot(&score);
            sizes.push(solution);
        }
        let n = sizes.len() as f64;
        let size = |a: usize| {
            let square = |s: &DVector<f64>| s[2 * a] * s[2 * a] + s[2 * a + 1] * s[2 * a + 1];
            libm::sqrt(sizes.iter().map(square).sum::<f64>() / n)
        };
        let mean = |i: usize| sizes.iter().map(|s| s[i]).sum::<f64>() / n;
        let coherence = libm::hypot(mean(0), mean(1)) / size(0).max(1e-300);
        let locked = coherence > LOCKED;
        let phase = if locked {
            libm::atan2(mean(1), mean(0))
        } else {
            libm::atan2(sizes[0][1], sizes[0][0])
        };
        // The columns are cosines, the kinds are sines.
        let phase = phase + 0.5 * core::f64::consts::PI;
        let mut effect = columns[0];
        let free = free_of(columns[0].kind);
        for (a, column) in columns.iter().enumerate() {
            let &p = free
                .iter()
                .find(|&&p| column.parameters[p] == 1.0)
                .unwrap_or(&free[0]);
            // Two axes swing in step or against each other.
            let sign = if a > 0 && mean(0) * mean(2 * a) + mean(1) * mean(2 * a + 1) < 0.0 {
                -1.0
            } else {
                1.0
            };
            effect.parameters[p] = sign * size(a);
        }
        let [f, ph] = shapes_of(effect.kind);
        effect.parameters[f] = frequency;
        effect.parameters[ph] = phase;
        Ok(Some(Explained {
            effect,
            sd: 1.0 / libm::sqrt(2.0 * information.max(1e-300)),
            gain,
            locked,
        }))
    }

    /// The clearest disturbance of a single trial; `None` when no trial stands out.
    ///
    /// A trial is compared with its repeats where it has some, else with the fitted model. Two shapes are tried: a burst
    /// of torque in a joint, and an angle sensor that slips and stays off.
    ///
    /// # Errors
    /// As [`Study::responses`].
    pub fn disturbance(&self, fitted: &Fitted<N>, scale: f64) -> Result<Option<Apart>, GapError> {
        let white: Vec<Vec<f64>> = self
            .fitted
            .iter()
            .zip(&fitted.residuals)
            .map(|(&t, r)| self.noise.whiten(r, &self.stretches[t]))
            .collect();
        let deviations: Vec<Vec<f64>> = (0..self.fitted.len())
            .map(|m| self.deviation(&white, m))
            .collect();
        let suspects: Vec<usize> = (0..self.fitted.len())
            .filter(|&m| self.has_repeat(m))
            .filter(|&m| stands_out(&deviations[m], self.session.channels(), scale))
            .collect();
        let mut best: Option<Apart> = None;
        for m in suspects {
            let trial = self.fitted[m];
            for (effect, response) in self.shapes_in(fitted, trial)? {
                let row = self.noise.whiten(&response, &self.stretches[trial]);
                let (square, along) = (dot(&row, &row), dot(&row, &deviations[m]));
                if square <= 0.0 {
                    continue;
                }
                // Of two repeats both deviate alike: the disturbed one is further from the model.
                let own = dot(&row, &white[m]).abs();
                let further = self.repeats_of(m).iter().all(|&o| {
                    let other = dot(&row, &white[o]).abs();
                    own > other
                });
                let gain = along * along / square / scale;
                if further && best.as_ref().is_none_or(|b| gain > b.gain) {
                    let mut effect = effect;
                    effect.parameters[0] = along / square;
                    best = Some(Apart {
                        effect,
                        sd: libm::sqrt(scale / square),
                        trial: Some(trial),
                        gain,
                        rivals: Vec::new(),
                        locked: false,
                    });
                }
            }
        }
        let rows = self.rows_of_references() as f64;
        let tried = (self.fitted.len() * 4 * N * 100) as f64;
        let price = crate::scan::THRESHOLD + libm::log(rows) + 2.0 * libm::log(tried);
        Ok(best.filter(|b| b.gain > price))
    }

    /// Other fitted trials with the same movement and the same samples.
    fn repeats_of(&self, m: usize) -> Vec<usize> {
        let group = self.group_of[self.fitted[m]];
        (0..self.fitted.len())
            .filter(|&o| {
                let trial = self.fitted[o];
                o != m
                    && self.group_of[trial] == group
                    && self.stretches[trial] == self.stretches[self.fitted[m]]
            })
            .collect()
    }

    fn has_repeat(&self, m: usize) -> bool {
        !self.repeats_of(m).is_empty()
    }

    /// A trial's whitened residual less the mean of its repeats, scaled to the noise of one trial.
    fn deviation(&self, white: &[Vec<f64>], m: usize) -> Vec<f64> {
        let others = self.repeats_of(m);
        if others.is_empty() {
            return white[m].clone();
        }
        let n = others.len() as f64;
        let shrink = 1.0 / libm::sqrt(1.0 + 1.0 / n);
        (0..white[m].len())
            .map(|i| {
                let mean = others.iter().map(|&o| white[o][i]).sum::<f64>() / n;
                shrink * (white[m][i] - mean)
            })
            .collect()
    }

    /// Unit disturbances of a trial with what they would show: bursts in every joint, slips of every angle sensor.
    fn shapes_in(
        &self,
        fitted: &Fitted<N>,
        trial: usize,
    ) -> Result<Vec<(Effect<f64>, Channels)>, GapError> {
        const EVERY: f64 = 0.1;
        const LONG: [f64; 3] = [0.3, 0.6, 1.2];
        const UNIT: f64 = 1e-2;
        let course = &self.courses[self.references[self.group_of[trial]]];
        let end = course.raw[0].len() as f64 / course.rate;
        let starts = (end / EVERY) as usize;
        let Some(linear) = Linear::along(self.session, &fitted.hypothesis, course)
            .map_err(|source| GapError::Simulation { trial, source })?
        else {
            return Ok(Vec::new());
        };
        let bursts: Vec<Effect<f64>> = KINDS
            .iter()
            .filter(|k| k.probe().nature == Nature::Burst)
            .flat_map(|&kind| {
                (0..N).flat_map(move |j| {
                    LONG.iter().flat_map(move |&long| {
                        (0..starts).map(move |s| {
                            Effect::new(kind, j).with(&[UNIT, EVERY * s as f64, long])
                        })
                    })
                })
            })
            .collect();
        let answered = self.parallel(bursts.len(), |i| {
            let mut changed = fitted.hypothesis.clone();
            changed.named.push(bursts[i]);
            linear.response(&changed, UNIT, (false, false))
        });
        let mut list: Vec<(Effect<f64>, Channels)> = std::iter::zip(bursts, answered)
            .filter_map(|(effect, response)| Some((effect, response?)))
            .collect();
        let count = course.raw[0].len();
        for &kind in KINDS {
            if kind.info().place != arm_core::effect::Place::AngleSensor {
                continue;
            }
            for j in 0..N {
                for s in 1..starts {
                    let first = (EVERY * s as f64 * course.rate) as usize;
                    let mut channels = vec![vec![0.0; count]; self.session.channels()];
                    for value in channels[j].iter_mut().skip(first) {
                        *value = 1.0;
                    }
                    let mut effect = Effect::new(kind, j);
                    // The time of the slip travels in the last place, which the kind does not use.
                    effect.parameters[arm_core::effect::MAX_PARAMETERS - 1] = EVERY * s as f64;
                    list.push((effect, channels));
                }
            }
        }
        for (_, channels) in &mut list {
            let length = self.session.trials[trial].len();
            for channel in channels.iter_mut() {
                let last = channel.last().copied().unwrap_or(0.0);
                channel.resize(length, last);
            }
        }
        Ok(list)
    }

    /// Leaves out what a disturbance has touched.
    pub fn leave_out(&mut self, apart: &Apart) {
        let Some(trial) = apart.trial else { return };
        let (start, end) = apart.span();
        let rate = self.courses[trial].rate;
        let touched = |&i: &usize| {
            let time = i as f64 / rate;
            time >= start - 0.2 && time <= end + 0.5
        };
        let stretches: Vec<Vec<usize>> = self.stretches[trial]
            .0
            .iter()
            .flat_map(|s| {
                let before: Vec<usize> = s
                    .iter()
                    .copied()
                    .take_while(|i| !touched(i) && (*i as f64 / rate) < end)
                    .collect();
                let after: Vec<usize> = s
                    .iter()
                    .copied()
                    .filter(|i| !touched(i) && (*i as f64 / rate) >= start)
                    .collect();
                if before.len() == s.len() {
                    vec![before]
                } else {
                    vec![before, after]
                }
            })
            .filter(|s| s.len() >= 4)
            .collect();
        self.stretches[trial] = Stretches(stretches);
        if self.stretches[trial].is_empty() {
            self.fitted.retain(|&t| t != trial);
        }
    }
}

impl Apart {
    /// Frequency \[Hz\] and phase \[rad\] of a rhythm.
    pub fn wave(&self) -> [f64; 2] {
        shapes_of(self.effect.kind).map(|p| self.effect.parameters[p])
    }

    /// Whether its kind is locked to the start of the trial by nature.
    pub fn is_periodic(&self) -> bool {
        self.effect.kind.probe().nature == Nature::Periodic
    }

    /// From when to when it lasts \[s\].
    pub fn span(&self) -> (f64, f64) {
        let p = &self.effect.parameters;
        if self.effect.kind.probe().nature == Nature::Burst {
            (p[1], p[1] + p[2])
        } else {
            (p[arm_core::effect::MAX_PARAMETERS - 1], f64::INFINITY)
        }
    }
}

struct Explained {
    effect: Effect<f64>,
    sd: f64,
    gain: f64,
    locked: bool,
}

/// Whether some second of a whitened deviation holds far more than noise.
fn stands_out(deviation: &[f64], channels: usize, scale: f64) -> bool {
    /// Rows of one window.
    const WINDOW: usize = 12;
    /// Excess in standard deviations.
    const EXCESS: f64 = 4.5;
    let samples = deviation.len() / channels.max(1);
    let at = |s: usize| {
        (0..channels).fold(0.0, |sum, c| {
            let v = deviation[c * samples + s];
            sum + v * v / scale
        })
    };
    let squares: Vec<f64> = (0..samples).map(at).collect();
    let dof = (WINDOW * channels) as f64;
    squares.windows(WINDOW).any(|w| {
        let sum: f64 = w.iter().sum();
        sum > dof + EXCESS * libm::sqrt(2.0 * dof)
    })
}

fn free_of(kind: Kind) -> &'static [usize] {
    kind.probe().questions[0].free
}

/// Positions of frequency and phase of a kind that swings.
fn shapes_of(kind: Kind) -> [usize; 2] {
    let position = |name: &str| {
        let parameters = kind.info().parameters;
        parameters.iter().position(|p| p.name == name).unwrap_or(0)
    };
    [position("frequency"), position("phase")]
}

fn small_frequency(kind: Kind) -> usize {
    shapes_of(kind)[0]
}

/// A kind that swings with one of its sizes at one, the others at zero.
fn swinging(kind: Kind, index: usize, size: usize, frequency: f64) -> Effect<f64> {
    let mut effect = Effect::new(kind, index);
    for &p in free_of(kind) {
        effect.parameters[p] = 0.0;
    }
    effect.parameters[size] = 1.0;
    let [f, phase] = shapes_of(kind);
    effect.parameters[f] = frequency;
    // The swing as a cosine, so that its coefficient is real.
    effect.parameters[phase] = 0.5 * core::f64::consts::PI;
    effect
}
