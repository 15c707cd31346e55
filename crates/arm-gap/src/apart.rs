//! What is not the same in every trial, or swings too fast for the common band: rhythms, the robot's ripple, and
//! disturbances of one trial.

use std::sync::Arc;

use arm_core::effect::{Effect, KINDS, Kind, Nature};
use arm_core::{Joints, Pose, jacobian};
use nalgebra::{DMatrix, DVector};

use crate::GapError;
use crate::anchor::Anchor;
use crate::groups::same_rate;
use crate::misfit::{orthogonal, project_off};
use crate::noise::dot;
use crate::normal::factor;
use crate::predict::{Channels, Course, smooth};
use crate::spectrum::{coefficient, line};
use crate::study::Study;

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
    /// The swings that a rhythm is made of, and their sizes in every trial: in phase, and a quarter of a period earlier.
    pub columns: Vec<Effect<f64>>,
    /// See `columns`.
    pub sizes: Vec<Vec<f64>>,
}

/// Where a line is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// In what repeats differ by, where the model's own errors cancel: a rhythm of muscles has another phase in every trial.
    BetweenRepeats,
    /// Where tip and handle come apart: only the robot can be behind it.
    OfTheRobot,
}

/// Slowest rhythm of muscles \[Hz\]: below it movements have power of their own.
const SLOWEST_RHYTHM: f64 = 2.0;
/// Slowest ripple of the robot \[Hz\].
const SLOWEST_RIPPLE: f64 = 0.4;
/// Fastest ripple of the robot \[Hz\]: above it the steps of encoders sound in the springs of the contact.
const FASTEST_RIPPLE: f64 = 8.0;
/// Gain below which a line is no rhythm: many frequencies and channels were looked at.
const PLAIN: f64 = 60.0;
/// Share of what is left in some channel that a rhythm must be.
const SEEN: f64 = 0.05;
/// Gain in which two explanations of a rhythm count as equal.
const TIE: f64 = 10.0;
/// Coherence of the phases of trials above which a rhythm is locked to their start.
const LOCKED: f64 = 0.8;

impl<const N: usize> Study<'_, N> {
    /// Rhythms and ripple: a line in the spectrum of what is left, named by the pattern in which the channels follow.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis cannot be simulated.
    pub fn rhythm(&self, anchor: &Anchor<N>, place: Line) -> Result<Option<Apart>, GapError> {
        let residuals = self.raw_residuals(anchor)?;
        let rate = self.courses[self.fitted[0]].rate;
        if self
            .fitted
            .iter()
            .any(|&t| !same_rate(self.courses[t].rate, rate))
        {
            return Ok(None);
        }
        let found = match place {
            Line::BetweenRepeats => {
                let differences = self.differences(&residuals);
                let all: Vec<&Channels> = differences.iter().collect();
                line(&all, rate, SLOWEST_RHYTHM)
            }
            Line::OfTheRobot => {
                let closures: Vec<Channels> = std::iter::zip(&residuals, &self.fitted)
                    .map(|(residual, &trial)| self.closure(residual, trial))
                    .collect();
                let all: Vec<&Channels> = closures.iter().collect();
                line(&all, rate, SLOWEST_RIPPLE)
            }
        };
        let Some(frequency) = found else {
            return Ok(None);
        };
        let mut best: Vec<(f64, Explained)> = Vec::new();
        for columns in self.swings(frequency) {
            if place == Line::OfTheRobot && columns[0].kind.probe().nature != Nature::Periodic {
                continue;
            }
            if let Some(explained) = self.explain(anchor, &residuals, frequency, &columns) {
                let worth = explained.gain - 8.0 * columns.len() as f64;
                best.push((worth, explained));
            }
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut list = best.into_iter();
        // The steps of encoders sound in the springs of the contact: what looks like a fast ripple is that.
        let sounds = |e: &Explained| {
            e.effect.kind.probe().nature == Nature::Periodic && frequency >= FASTEST_RIPPLE
        };
        let Some((most, first)) = list
            .next()
            .filter(|(_, e)| e.gain > PLAIN && e.share > SEEN && !sounds(e))
        else {
            return Ok(None);
        };
        let rivals = list
            .filter(|(worth, other)| {
                let same = (other.effect.kind, other.effect.index)
                    == (first.effect.kind, first.effect.index);
                worth + TIE > most && !same
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
            columns: first.columns,
            sizes: first.sizes,
        }))
    }

    /// What each trial differs by from the mean of its repeats, over the samples that all have; trials without repeats
    /// are left out.
    fn differences(&self, residuals: &[Channels]) -> Vec<Channels> {
        let mut out = Vec::new();
        for (m, &trial) in self.fitted.iter().enumerate() {
            let group = self.group_of[trial];
            let members: Vec<&Channels> = std::iter::zip(residuals, &self.fitted)
                .filter(|(_, t)| self.group_of[**t] == group)
                .map(|(r, _)| r)
                .collect();
            if members.len() < 2 {
                continue;
            }
            let count = members.iter().map(|r| r[0].len()).min().unwrap_or(0);
            let n = members.len() as f64;
            let scale = libm::sqrt(n / (n - 1.0));
            let one = |c: usize| {
                let mean = |i: usize| members.iter().map(|r| r[c][i]).sum::<f64>() / n;
                (0..count)
                    .map(|i| scale * (residuals[m][c][i] - mean(i)))
                    .collect()
            };
            out.push((0..self.session.channels()).map(one).collect());
        }
        out
    }

    /// What is left between the arm's tip and the handle, stretch of the contact taken off: y and z \[m\].
    fn closure(&self, residual: &Channels, trial: usize) -> Channels {
        let course = &self.courses[trial];
        let count = residual[0].len();
        let mut out = vec![Vec::new(); 2];
        for i in 0..count {
            let q = Joints::<f64, N>::from_fn(|j, _| course.seen[j][i]);
            let moved = Joints::<f64, N>::from_fn(|j, _| residual[j][i]);
            let tip = jacobian(&self.session.chain, &Pose::new(&q)) * moved;
            for axis in 0..2 {
                let stretch = residual[N + axis][i] / self.session.contact.stiffness[axis];
                out[axis].push(tip[axis] + stretch);
            }
        }
        out
    }

    /// Takes a rhythm out of the measured channels, so that it does not disturb what is fitted to them.
    ///
    /// # Errors
    /// [`GapError::Numerics`] for channels that the filter refuses.
    pub fn take_out(&mut self, anchor: &Anchor<N>, apart: &Apart) -> Result<(), GapError> {
        for (sizes, &trial) in apart.sizes.iter().zip(&self.fitted.clone()) {
            let Some(line) = anchor.lines.get(self.group_of[trial]) else {
                continue;
            };
            let mut course = Course::clone(&self.courses[trial]);
            for (k, column) in apart.columns.iter().enumerate() {
                for quarter in [false, true] {
                    let size = sizes[2 * k + usize::from(quarter)];
                    let mut changed = anchor.hypothesis.clone();
                    changed.named.push(small(column, apart.wave()[0], quarter));
                    let Ok(swing) = line.response_raw(&changed, UNIT, (false, false)) else {
                        continue;
                    };
                    for (channel, swing) in course.raw.iter_mut().zip(&swing) {
                        for (value, swing) in channel.iter_mut().zip(swing) {
                            *value -= size * swing;
                        }
                    }
                }
            }
            course.seen = smooth(&course.raw, course.band, course.rate)?;
            self.courses[trial] = Arc::new(course);
        }
        Ok(())
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
        anchor: &Anchor<N>,
        residuals: &[Channels],
        frequency: f64,
        columns: &[Effect<f64>],
    ) -> Option<Explained> {
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
            let line = anchor.lines.get(group)?;
            columns
                .iter()
                .map(|effect| {
                    let mut changed = anchor.hypothesis.clone();
                    changed.named.push(small(effect, frequency, false));
                    let response = line.response_raw(&changed, UNIT, (false, false)).ok()?;
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
            let swings = swings[self.group_of[trial]].as_ref()?;
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
            let solution = factor(gram)?.solve(&score);
            gain += 2.0 * solution.dot(&score);
            sizes.push(solution);
        }
        let share = (0..channels)
            .map(|c| {
                let (mut line, mut all) = (0.0, 0.0);
                for residual in residuals {
                    let [a, b] = coefficient(&residual[c], frequency, rate);
                    let count = residual[c].len() as f64;
                    line += 0.5 * (a * a + b * b);
                    let mean = residual[c].iter().sum::<f64>() / count;
                    all += residual[c]
                        .iter()
                        .map(|v| (v - mean) * (v - mean))
                        .sum::<f64>()
                        / count;
                }
                line / f64::max(all, 1e-300)
            })
            .fold(0.0, f64::max);
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
        for (a, column) in columns.iter().enumerate() {
            let p = size_of(column);
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
        Some(Explained {
            effect,
            sd: 1.0 / libm::sqrt(2.0 * information.max(1e-300)),
            gain,
            locked,
            sizes: sizes.iter().map(|s| s.iter().copied().collect()).collect(),
            columns: columns.to_vec(),
            share,
        })
    }

    /// The clearest disturbance of a single trial; `None` when no trial stands out.
    ///
    /// A trial is compared with its repeats where it has some, else with the fitted model. Two shapes are tried: a burst
    /// of torque in a joint, and an angle sensor that slips and stays off.
    ///
    /// * `scale` - misfit for each degree of freedom
    pub fn disturbance(&self, anchor: &Anchor<N>, scale: f64) -> Option<Apart> {
        let white: Vec<Vec<f64>> = self
            .fitted
            .iter()
            .zip(&anchor.residuals)
            .map(|(&t, r)| self.noise.whiten(r, &self.stretches[t]))
            .collect();
        // How the hand holds the handle and how a sensor sits differ from trial to trial: that is no disturbance.
        let each = self.fitted.iter();
        let usual: Vec<Vec<Vec<f64>>> = each.map(|&trial| self.usual(anchor, trial)).collect();
        let deviations: Vec<Vec<f64>> = (0..self.fitted.len())
            .map(|m| {
                let mut deviation = self.deviation(&white, m);
                project_off(&mut deviation, &usual[m]);
                deviation
            })
            .collect();
        let suspects: Vec<usize> = (0..self.fitted.len())
            .filter(|&m| self.has_repeat(m))
            .filter(|&m| stands_out(&deviations[m], self.session.channels(), scale))
            .collect();
        let rows = self.rows_of_references() as f64;
        let tried = (self.fitted.len() * 4 * N * 100) as f64;
        let price = crate::scan::THRESHOLD + libm::log(rows) + 2.0 * libm::log(tried);
        let mut best: Option<Apart> = None;
        for m in suspects {
            let trial = self.fitted[m];
            let see = |(effect, response): (Effect<f64>, Channels)| {
                let mut row = self.noise.whiten(&response, &self.stretches[trial]);
                project_off(&mut row, &usual[m]);
                let square = dot(&row, &row);
                (square > 0.0).then_some(Asked {
                    effect,
                    row,
                    square,
                })
            };
            let asked: Vec<Asked> = self
                .shapes_in(anchor, trial)
                .into_iter()
                .filter_map(see)
                .collect();
            let others = self.repeats_of(m);
            for one in &asked {
                let along = dot(&one.row, &deviations[m]);
                // Of two repeats both deviate alike: the disturbed one is further from the model.
                let own = dot(&one.row, &white[m]).abs();
                let further = others.iter().all(|&o| own > dot(&one.row, &white[o]).abs());
                let size = along / one.square;
                // A sensor that moves within what the calibration promises of it is no finding.
                let promised = match one.effect.kind.probe().promise {
                    Some(_) => self.session.tolerance.angle_offset,
                    None => 0.0,
                };
                let gain = along * size / scale;
                let least = best.as_ref().map_or(price, |b| b.gain);
                if !further || size.abs() <= promised || gain <= least {
                    continue;
                }
                let group = others.iter().chain([&m]).map(|&o| deviations[o].as_slice());
                let scatter = scatter_elsewhere(one, &asked, &group.collect::<Vec<_>>());
                let gain = gain / scatter;
                if gain > least {
                    let mut effect = one.effect;
                    effect.parameters[0] = size;
                    best = Some(Apart {
                        effect,
                        sd: libm::sqrt(scale * scatter / one.square),
                        trial: Some(trial),
                        gain,
                        rivals: Vec::new(),
                        locked: false,
                        columns: Vec::new(),
                        sizes: Vec::new(),
                    });
                }
            }
        }
        best
    }

    /// Whitened columns of what differs from trial to trial without being a disturbance, each orthogonal to the others.
    fn usual(&self, anchor: &Anchor<N>, trial: usize) -> Vec<Vec<f64>> {
        let stretches = &self.stretches[trial];
        let length = self.session.trials[trial].len();
        let constant = |j: usize| {
            let mut channels = vec![vec![0.0; length]; self.session.channels()];
            channels[j] = vec![1.0; length];
            channels
        };
        let own = anchor.own.iter();
        let placed = own.map(|r| self.noise.whiten(&r.0[self.group_of[trial]], stretches));
        let columns: Vec<Vec<f64>> = placed
            .chain((0..N).map(|j| self.noise.whiten(&constant(j), stretches)))
            .collect();
        orthogonal(columns)
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
    fn shapes_in(&self, anchor: &Anchor<N>, trial: usize) -> Vec<(Effect<f64>, Channels)> {
        const EVERY: f64 = 0.1;
        const LONG: [f64; 3] = [0.3, 0.6, 1.2];
        const UNIT: f64 = 1e-2;
        let course = &self.courses[self.references[self.group_of[trial]]];
        let end = course.raw[0].len() as f64 / course.rate;
        let starts = (end / EVERY) as usize;
        let Some(line) = anchor.lines.get(self.group_of[trial]) else {
            return Vec::new();
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
            let mut changed = anchor.hypothesis.clone();
            changed.named.push(bursts[i]);
            line.response(&changed, UNIT, (false, false)).ok()
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
                // A slip within the trial; an offset from its start is how the sensor was put on.
                for s in 10..starts.saturating_sub(10) {
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
        list
    }
}

impl Apart {
    /// Frequency \[Hz\] and phase \[rad\] of a rhythm.
    pub fn wave(&self) -> [f64; 2] {
        shapes_of(self.effect.kind).map(|p| self.effect.parameters[p])
    }

    /// Whether another is the same rhythm.
    pub fn is_like(&self, other: &Self) -> bool {
        /// Difference of two frequencies that are one \[Hz\].
        const NEAR: f64 = 0.3;
        let (a, b) = (&self.effect, &other.effect);
        let same = a.kind == b.kind && a.index == b.index && self.trial == other.trial;
        same && (self.wave()[0] - other.wave()[0]).abs() < NEAR
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
    sizes: Vec<Vec<f64>>,
    columns: Vec<Effect<f64>>,
    /// Largest share of the variance of a channel's residual.
    share: f64,
}

/// The size with which swings are tried.
const UNIT: f64 = 1e-3;

/// Position of the size that is one in a swing.
fn size_of(swing: &Effect<f64>) -> usize {
    let free = free_of(swing.kind);
    let one = free.iter().find(|&&p| swing.parameters[p] == 1.0);
    one.copied().unwrap_or(free[0])
}

/// A swing of a small size, a quarter of a period earlier on demand.
fn small(swing: &Effect<f64>, frequency: f64, earlier: bool) -> Effect<f64> {
    let mut effect = *swing;
    effect.parameters[size_of(swing)] = UNIT;
    let [f, phase] = shapes_of(swing.kind);
    effect.parameters[f] = frequency;
    if earlier {
        effect.parameters[phase] += 0.5 * core::f64::consts::PI;
    }
    effect
}

/// A disturbance that is asked for, with what it would show.
struct Asked {
    effect: Effect<f64>,
    /// Whitened, without what is usual.
    row: Vec<f64>,
    square: f64,
}

/// How much more than noise the shape of a burst finds at other times of its movement, as a ratio of variances; at least one.
///
/// Joints that stick elsewhere in every repeat, and noise that is not as the autoregression has it, look like bursts at many times.
///
/// * `deviations` - of the trial and its repeats
fn scatter_elsewhere(one: &Asked, asked: &[Asked], deviations: &[&[f64]]) -> f64 {
    /// Nine of ten squares of a standard normal number are smaller.
    const NINE_OF_TEN: f64 = 2.706;
    /// How long a burst is felt around it \[s\].
    const FELT: f64 = 1.0;
    if one.effect.kind.probe().nature != Nature::Burst {
        return 1.0;
    }
    let span = |e: &Effect<f64>| (e.parameters[1] - FELT, e.parameters[1] + e.parameters[2]);
    let own = span(&one.effect);
    let elsewhere = asked.iter().filter(|other| {
        let same = (other.effect.kind, other.effect.index) == (one.effect.kind, one.effect.index)
            && other.effect.parameters[2] == one.effect.parameters[2];
        let there = span(&other.effect);
        same && (there.0 > own.1 || there.1 < own.0)
    });
    let mut squares: Vec<f64> = elsewhere
        .flat_map(|other| {
            deviations.iter().map(|d| {
                let along = dot(&other.row, d);
                along * along / other.square
            })
        })
        .collect();
    squares.sort_by(f64::total_cmp);
    let tenth = squares.len().saturating_sub(1) * 9 / 10;
    squares
        .get(tenth)
        .map_or(1.0, |s| f64::max(s / NINE_OF_TEN, 1.0))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Bursts of 0.5 s that start every 0.1 s of 10 s, each with a row of its own.
    fn bursts() -> Vec<Asked> {
        (0..95)
            .map(|k| {
                let mut row = vec![0.0; 95];
                row[k] = 1.0;
                let effect = Effect::new(Kind::Voluntary, 0).with(&[1e-2, 0.1 * k as f64, 0.5]);
                Asked {
                    effect,
                    row,
                    square: 1.0,
                }
            })
            .collect()
    }

    #[test]
    fn a_burst_stands_out_against_other_times_and_not_against_itself() {
        let asked = bursts();
        // Far more than noise from 4.0 to 5.0 s alone: that is what a burst does.
        let once: Vec<f64> = (0..95)
            .map(|k| if (40..50).contains(&k) { 9.0 } else { 1.0 })
            .collect();
        assert_eq!(scatter_elsewhere(&asked[45], &asked, &[&once]), 1.0);
        // As much all the time is no burst.
        let always = vec![9.0; 95];
        let scatter = scatter_elsewhere(&asked[45], &asked, &[&once, &always]);
        assert!((scatter - 81.0 / 2.706).abs() < 1e-12, "{scatter}");
    }
}
