//! Detection of tremor and of the robot's ripple: oscillations above the common band, or with another phase in every trial.

use arm_core::effect::{Effect, KINDS, Kind, Nature};
use arm_core::{Contact, Joints, Pose, jacobian};
use arm_numerics::Cholesky;

use crate::GapError;
use crate::data::course::Channels;
use crate::data::noise::dot;
use crate::data::repeats::same_rate;
use crate::linearization::linear_response::Change;
use crate::prepared_session::PreparedSession;
use crate::selection::model_selection::TIE;
use crate::sensitivity::linearization_point::{LinearizationPoint, slope};
use crate::trial_specific::component::{TrialSpecific, shapes_of};
use crate::trial_specific::spectral_line::SpectralLine;
use arm_numerics::signal::spectrum::{Sum, line, peak};

/// Where a line is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// In what repeats differ by, where the model's own errors cancel: a rhythm of muscles has another phase in every trial.
    BetweenRepeats,
    /// Where tip and handle come apart: the robot is behind it, or a muscle that starts with every trial.
    OfTheRobot,
    /// In all that is left: what has the same phase in every trial, which repeats do not differ by.
    InPhase,
}

/// Slowest line of a rhythm of muscles \[Hz\]: below it movements have power of their own.
const SLOWEST_LINE: f64 = 2.0;
/// Slowest ripple of the robot \[Hz\].
const SLOWEST_RIPPLE: f64 = 0.4;
/// Fastest ripple of the robot \[Hz\]: above it the steps of encoders sound in the springs of the contact.
const FASTEST_RIPPLE: f64 = 8.0;
/// Gain in units of twice the log-likelihood below which a line is no rhythm: many frequencies and channels are tested.
const LEAST_GAIN: f64 = 60.0;
/// Share of the squared sizes of a ripple over trials that may differ from one size: the robot makes the same one in every movement,
/// a vibration of the arm follows what it does.
pub(crate) const UNSTEADY: f64 = 0.05;
/// Share of what is left in some channel that a rhythm must be.
const SEEN: f64 = 0.05;
/// Coherence of the phases of trials above which a rhythm is locked to their start.
const LOCKED: f64 = 0.8;

impl<const N: usize> PreparedSession<'_, N> {
    /// Rhythms and ripple: a line in the spectrum of what is left, named by the pattern in which the channels follow.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis cannot be simulated.
    pub fn rhythm(
        &self,
        point: &LinearizationPoint<N>,
        place: Line,
    ) -> Result<Option<TrialSpecific>, GapError> {
        let residuals = self.raw_residuals(point)?;
        let rate = self.courses[self.fitted[0]].rate;
        if self
            .fitted
            .iter()
            .any(|&t| !same_rate(self.courses[t].rate, rate))
        {
            return Ok(None);
        }
        let told = match place {
            Line::BetweenRepeats => Some(self.differences(&residuals)),
            Line::OfTheRobot => {
                let trial = self.fitted[0];
                let rig = self.session.rig(&point.hypothesis);
                let rig = rig.map_err(|source| GapError::Simulation { trial, source })?;
                let each = std::iter::zip(&residuals, &self.fitted);
                let closure =
                    each.map(|(residual, &trial)| self.closure(residual, trial, &rig.contact));
                Some(closure.collect::<Vec<_>>())
            }
            Line::InPhase => None,
        };
        let all: Vec<&Channels> = told.as_ref().unwrap_or(&residuals).iter().collect();
        // A robot mostly starts its movements in the same phase of what shakes it.
        let (lowest, sums) = match place {
            Line::BetweenRepeats => (SLOWEST_LINE, &[Sum::Powers][..]),
            Line::OfTheRobot => (SLOWEST_RIPPLE, &[Sum::Swings, Sum::Powers][..]),
            Line::InPhase => (SLOWEST_LINE, &[Sum::Swings][..]),
        };
        let lines = sums.iter().filter_map(|sum| line(&all, rate, lowest, *sum));
        let named = |frequency: f64| self.swinging_at(frequency, (point, &residuals));
        let found = lines.filter_map(named).next();
        Ok(found.map(|found| self.at_the_peak(found, (point, &residuals))))
    }

    /// What swings in the residuals as a rhythm does that was found before, as far as it is plain.
    ///
    /// # Errors
    /// [`GapError::Simulation`] where the hypothesis cannot be simulated.
    pub fn swinging_near(
        &self,
        rhythm: &TrialSpecific,
        point: &LinearizationPoint<N>,
    ) -> Result<Option<TrialSpecific>, GapError> {
        let residuals = self.raw_residuals(point)?;
        let found = self.swinging_at(rhythm.wave()[0], (point, &residuals));
        let found = found.map(|found| self.at_the_peak(found, (point, &residuals)));
        Ok(found.filter(|found| found.is_like(rhythm)))
    }

    /// What swings, at the frequency at which the residuals have their peak if it explains more there: where tip and handle come apart, a rhythm
    /// of muscles hardly shows.
    fn at_the_peak(
        &self,
        found: TrialSpecific,
        (point, residuals): (&LinearizationPoint<N>, &[Channels]),
    ) -> TrialSpecific {
        let all: Vec<&Channels> = residuals.iter().collect();
        let rate = self.courses[self.fitted[0]].rate;
        let shortest = all.iter().map(|r| r[0].len()).min().unwrap_or(1);
        let sum = if found.locked {
            Sum::Swings
        } else {
            Sum::Powers
        };
        // The width of a line over a trial.
        let near = (found.wave()[0], rate / shortest as f64);
        let again = peak(&all, rate, near, sum)
            .and_then(|frequency| self.swinging_at(frequency, (point, residuals)));
        again
            .filter(|again| again.gain > found.gain)
            .unwrap_or(found)
    }

    /// What swings at a frequency, where it is plain enough.
    fn swinging_at(
        &self,
        frequency: f64,
        (point, residuals): (&LinearizationPoint<N>, &[Channels]),
    ) -> Option<TrialSpecific> {
        let mut best: Vec<(f64, Explained)> = Vec::new();
        for columns in self.swings(frequency) {
            let answers = self.answers(point, frequency, &columns);
            if let Some(explained) = self.explain(residuals, frequency, (&columns, &answers)) {
                let worth = explained.gain - 8.0 * columns.len() as f64;
                best.push((worth, explained));
            }
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut list = best.into_iter();
        let (most, first) = list.next().filter(|(_, e)| e.is_plain(frequency))?;
        let alternatives = list
            .filter(|(worth, other)| {
                let same = (other.effect.kind, other.effect.index)
                    == (first.effect.kind, first.effect.index);
                worth + TIE > most && !same
            })
            .map(|(worth, other)| (other.effect, most - worth))
            .collect();
        Some(TrialSpecific {
            effect: first.effect,
            sd: vec![first.sd],
            trial: None,
            gain: first.gain,
            alternatives,
            locked: first.locked,
            columns: first.columns,
            sizes: first.sizes,
        })
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
    fn closure(&self, residual: &Channels, trial: usize, contact: &Contact<f64>) -> Channels {
        let course = &self.courses[trial];
        let valid_segments = [0, 1].map(|axis| {
            let spring = (contact.stiffness[axis], contact.damping[axis]);
            stretch(&residual[N + axis], spring, course.rate)
        });
        let mut out = vec![Vec::new(); 2];
        for i in 0..residual[0].len() {
            let q = Joints::<f64, N>::from_fn(|j, _| course.seen[j][i]);
            let moved = Joints::<f64, N>::from_fn(|j, _| residual[j][i]);
            let tip = jacobian(&self.session.chain, &Pose::new(&q)) * moved;
            for axis in 0..2 {
                out[axis].push(tip[axis] + valid_segments[axis][i]);
            }
        }
        out
    }

    /// What can swing at a frequency: for each explanation the effects whose swings it adds up.
    fn swings(&self, frequency: f64) -> Vec<Vec<Effect<f64>>> {
        let mut list = Vec::new();
        let kinds = KINDS.iter().copied();
        for kind in kinds.filter(|k| k.prior().has_frequency(frequency)) {
            match kind.prior().nature {
                Nature::Rhythm => {
                    list.extend((0..N).map(|j| vec![swinging(kind, j, 0, frequency)]));
                }
                Nature::Periodic => {
                    let axes: Vec<Effect<f64>> = kind.prior().parts[0]
                        .sizes
                        .iter()
                        .map(|&p| swinging(kind, 0, p, frequency))
                        .collect();
                    list.extend(axes.iter().map(|&axis| vec![axis]));
                    list.push(axes);
                }
                Nature::Lasting | Nature::Burst | Nature::Slip => {}
            }
        }
        list
    }

    /// A rhythm with the size and phase that simulated runs give it: what it shows to first order on a coarse grid is off by as much as
    /// a tenth where an arm nearly rings with it. `None` where it cannot be simulated.
    ///
    /// Its standard deviation counts how sizes scatter from trial to trial.
    pub fn sized(
        &self,
        point: &LinearizationPoint<N>,
        trial_specific: &TrialSpecific,
    ) -> Option<TrialSpecific> {
        let residuals = self.raw_residuals(point).ok()?;
        let frequency = trial_specific.wave()[0];
        let size = trial_specific.effect.parameters[sizes_of(trial_specific.effect.kind)[0]].abs();
        let shown = |group: usize, named: Option<Effect<f64>>| {
            let mut hypothesis = point.hypothesis.clone();
            hypothesis.named.extend(named);
            let course = &self.courses[self.references[group]];
            let run = self.session.run(&hypothesis, course).ok()?;
            self.session.read_raw(&hypothesis, course, &run).ok()
        };
        let answer = |group: usize| {
            let base = shown(group, None)?;
            let each = trial_specific.columns.iter().map(|column| {
                let swinging = shown(group, Some(sized_at(column, frequency, size)))?;
                Some(slope(&swinging, &base, size))
            });
            each.collect()
        };
        let answers = self.parallel(self.references.len(), answer);
        let explained = self.explain(&residuals, frequency, (&trial_specific.columns, &answers))?;
        let sizes = explained.sizes.iter();
        let sizes: Vec<f64> = sizes
            .map(|s| libm::sqrt(s.iter().map(|v| v * v).sum::<f64>()))
            .collect();
        let n = sizes.len() as f64;
        let mean = sizes.iter().sum::<f64>() / n;
        let square = sizes.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>();
        let scatter = libm::sqrt(square / (n * (n - 1.0).max(1.0)));
        let mut effect = trial_specific.effect;
        let [_, phase] = shapes_of(effect.kind);
        for &p in sizes_of(effect.kind).iter().chain([&phase]) {
            let info = &effect.kind.info().parameters[p];
            effect.parameters[p] = explained.effect.parameters[p].clamp(info.min, info.max);
        }
        Some(TrialSpecific {
            effect,
            sd: vec![f64::max(explained.sd, scatter)],
            sizes: explained.sizes,
            ..trial_specific.clone()
        })
    }

    /// What small swings show on each movement, to first order.
    pub(super) fn answers(
        &self,
        point: &LinearizationPoint<N>,
        frequency: f64,
        columns: &[Effect<f64>],
    ) -> Vec<Answer> {
        self.parallel(self.references.len(), |group| {
            let line = point.lines.get(group)?;
            let each = columns.iter().map(|effect| {
                let mut changed = point.hypothesis.clone();
                changed.named.push(small(effect, frequency, false));
                line.response_raw(&Change::of(changed, UNIT)).ok()
            });
            each.collect()
        })
    }

    /// How much of the line some oscillations explain, with a separate size and phase in every trial.
    ///
    /// * `answers` - response to one unit of each column on each movement
    pub(super) fn explain(
        &self,
        residuals: &[Channels],
        frequency: f64,
        (columns, answers): (&[Effect<f64>], &[Answer]),
    ) -> Option<Explained> {
        let rate = self.courses[self.fitted[0]].rate;
        let line = SpectralLine { frequency, rate };
        let noise: Vec<f64> = (0..self.session.channels())
            .map(|c| line.noise_beside(residuals, c))
            .collect();
        let (mut gain, mut information, mut sizes) = (0.0, 0.0, Vec::new());
        for (residual, &trial) in residuals.iter().zip(&self.fitted) {
            let swings = answers[self.group_of[trial]].as_ref()?;
            let (gram, score) = line.normal_equations(residual, swings, &noise);
            information += gram[(0, 0)];
            let solution = Cholesky::new(gram)?.solve(&score);
            gain += 2.0 * dot(&solution, &score);
            sizes.push(solution);
        }
        let share = (0..noise.len())
            .map(|c| line.share(residuals, c))
            .fold(0.0, f64::max);
        let (effect, locked) = common_swing(columns, &sizes, frequency);
        Some(Explained {
            effect,
            sd: 1.0 / libm::sqrt(2.0 * information.max(1e-300)),
            gain,
            locked,
            sizes,
            columns: columns.to_vec(),
            share,
        })
    }
}

/// The swing of all trials in one effect, and whether it is locked to their starts.
///
/// * `sizes` - of each trial, two for each column: turned by 0 and by 90°
pub(super) fn common_swing(
    columns: &[Effect<f64>],
    sizes: &[Vec<f64>],
    frequency: f64,
) -> (Effect<f64>, bool) {
    let n = sizes.len() as f64;
    let size = |a: usize| {
        let square = |s: &Vec<f64>| s[2 * a] * s[2 * a] + s[2 * a + 1] * s[2 * a + 1];
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
    (effect, locked)
}

/// How far a force \[N\] stretches a spring \[N/m\] with a damper \[N s/m\] beside it \[m\], by the trapezoidal rule.
///
/// The damper counts: it carries an eighth of the force of a muscle that trembles at 8 Hz, which would pass for a ripple of the
/// robot.
fn stretch(force: &[f64], (stiffness, damping): (f64, f64), rate: f64) -> Vec<f64> {
    let slow = damping * rate;
    let mut out: Vec<f64> = Vec::with_capacity(force.len());
    for (i, now) in force.iter().enumerate() {
        let next = match out.last() {
            None => now / stiffness,
            Some(last) => {
                let mean = 0.5 * (now + force[i - 1]);
                (mean - (0.5 * stiffness - slow) * last) / (0.5 * stiffness + slow)
            }
        };
        out.push(next);
    }
    out
}

/// What one unit of each of some swings shows on a movement; `None` where one cannot be followed.
pub(super) type Answer = Option<Vec<Channels>>;

pub(super) struct Explained {
    effect: Effect<f64>,
    sd: f64,
    gain: f64,
    locked: bool,
    pub sizes: Vec<Vec<f64>>,
    columns: Vec<Effect<f64>>,
    /// Largest share of the variance of a channel's residual.
    share: f64,
}

impl Explained {
    /// Whether it is plain enough to be named at a frequency \[Hz\].
    fn is_plain(&self, frequency: f64) -> bool {
        // The steps of encoders excite the springs of the contact like a fast ripple.
        let periodic = self.effect.kind.prior().nature == Nature::Periodic;
        let sounds = periodic && frequency >= FASTEST_RIPPLE;
        self.gain > LEAST_GAIN && self.share > SEEN && self.is_steady() && !sounds
    }

    /// Whether a ripple is as large in one trial as in another, but for noise; rhythms of muscles need not be.
    fn is_steady(&self) -> bool {
        let trials = self.sizes.len() as f64;
        let squares = self.sizes.iter();
        let squares = squares.map(|s| s.iter().map(|v| v * v).sum::<f64>());
        let (sum, square) = squares.fold((0.0, 0.0), |(a, b), s| (a + libm::sqrt(s), b + s));
        // Of each swing the noise makes two numbers, which gain one unit each.
        let noise = 2.0 * self.columns.len() as f64 * trials / self.gain;
        let alike = sum * sum / (trials * square);
        self.effect.kind.prior().nature != Nature::Periodic || 1.0 - alike < UNSTEADY + noise
    }
}

/// The size with which swings are tried.
pub(super) const UNIT: f64 = 1e-3;

/// Position of the size that is one in a swing.
fn size_of(swing: &Effect<f64>) -> usize {
    let free = sizes_of(swing.kind);
    let one = free.iter().find(|&&p| swing.parameters[p] == 1.0);
    one.copied().unwrap_or(free[0])
}

/// A swing of a small size, a quarter of a period earlier on demand.
pub(super) fn small(swing: &Effect<f64>, frequency: f64, earlier: bool) -> Effect<f64> {
    let mut effect = sized_at(swing, frequency, UNIT);
    if earlier {
        effect.parameters[shapes_of(swing.kind)[1]] += 0.5 * core::f64::consts::PI;
    }
    effect
}

/// A swing of a size at a frequency.
fn sized_at(swing: &Effect<f64>, frequency: f64, size: f64) -> Effect<f64> {
    let mut effect = *swing;
    effect.parameters[size_of(swing)] = size;
    effect.parameters[shapes_of(swing.kind)[0]] = frequency;
    effect
}

fn sizes_of(kind: Kind) -> &'static [usize] {
    kind.prior().parts[0].sizes
}

/// A kind that swings with one of its sizes at one, the others at zero.
fn swinging(kind: Kind, index: usize, size: usize, frequency: f64) -> Effect<f64> {
    let mut effect = Effect::new(kind, index);
    for &p in sizes_of(kind) {
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
    use core::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_damper_beside_a_spring_is_no_stretch() {
        let (rate, stiffness, damping, omega) = (50.0, 1e4, 50.0, TAU * 6.0);
        let times: Vec<f64> = (0..500).map(|i| f64::from(i) / rate).collect();
        let swing = |t: &f64| 1e-4 * libm::sin(omega * t);
        let force: Vec<f64> = times
            .iter()
            .map(|t| stiffness * swing(t) + damping * omega * 1e-4 * libm::cos(omega * t))
            .collect();
        let off = |found: &[f64]| {
            let errors = std::iter::zip(found, &times).skip(50);
            errors
                .map(|(f, t)| (f - swing(t)).abs())
                .fold(0.0, f64::max)
        };
        let with = off(&stretch(&force, (stiffness, damping), rate));
        let without = off(&stretch(&force, (stiffness, 0.0), rate));
        assert!(without > 1.5e-5, "{without}");
        assert!(with < 0.1 * without, "{with} {without}");
    }

    fn of_nature(nature: Nature) -> Effect<f64> {
        let mut kinds = KINDS.iter().copied();
        let kind = kinds.find(|k| k.prior().nature == nature);
        Effect::new(kind.expect("a kind of each nature"), 0)
    }

    /// A swing of these sizes in the trials, all in one phase.
    fn explained(effect: Effect<f64>, sizes: &[f64], gain: f64, share: f64) -> Explained {
        Explained {
            effect,
            sd: 0.0,
            gain,
            locked: false,
            sizes: sizes.iter().map(|s| vec![0.6 * s, -0.8 * s]).collect(),
            columns: vec![effect],
            share,
        }
    }

    #[test]
    fn a_swing_is_plain_from_a_gain_of_60_and_a_twentieth_of_what_is_left_on() {
        let plain = |nature, gain, share, frequency| {
            explained(of_nature(nature), &[1.0; 6], gain, share).is_plain(frequency)
        };
        for nature in [Nature::Periodic, Nature::Rhythm] {
            assert!(plain(nature, 60.1, 0.051, 5.0));
            assert!(!plain(nature, 59.9, 0.051, 5.0) && !plain(nature, 60.1, 0.049, 5.0));
        }
        // Above 8 Hz the steps of encoders resemble a ripple, and no muscle.
        assert!(plain(Nature::Periodic, 99.0, 0.5, 7.9));
        assert!(!plain(Nature::Periodic, 99.0, 0.5, 8.0) && plain(Nature::Rhythm, 99.0, 0.5, 8.0));
    }

    #[test]
    fn a_swing_is_locked_where_the_phases_of_trials_are_coherent_by_four_fifths() {
        let effect = of_nature(Nature::Rhythm);
        // Half of the trials lead by an angle, half lag: the coherence is its cosine.
        let locked = |coherence: f64| {
            let lead = libm::acos(coherence);
            let sizes = [lead, -lead, lead, -lead].map(|a| vec![libm::cos(a), libm::sin(a)]);
            common_swing(&[effect], &sizes, 5.0).1
        };
        assert_eq!([0.39, 0.79, 0.81].map(locked), [false, false, true]);
    }

    #[test]
    fn a_ripple_is_as_large_in_one_trial_as_in_another() {
        let effect = of_nature(Nature::Periodic);
        let steady = |sizes: &[f64], gain| explained(effect, sizes, gain, 1.0).is_steady();
        assert!(steady(&[1.0, 1.2, 0.8, 1.1, 0.9, 1.0], 1000.0));
        assert!(!steady(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0], 1000.0));
        // Noise alone makes sizes differ where there is hardly a line.
        assert!(steady(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0], 100.0));
    }
}
