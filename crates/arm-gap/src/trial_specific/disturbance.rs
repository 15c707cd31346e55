//! Disturbances of single trials: a burst of torque, a sensor that slips.

use arm_core::effect::{Effect, KINDS, Kind, Nature};

use crate::candidates::candidate::price;
use crate::data::noise::dot;
use crate::data::prepared_session::PreparedSession;
use crate::data::valid_segments::ValidSegments;
use crate::measurement_model::prediction::{Channels, smooth};
use crate::selection::lack_of_fit::{orthogonal, project_off};
use crate::selection::model_selection::TIE;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::TrialSpecific;

/// Amplitude of a burst that is asked for \[N m\].
const UNIT: f64 = 1e-2;

impl<const N: usize> PreparedSession<'_, N> {
    /// The clearest disturbance of a single trial; `None` when no trial stands out.
    ///
    /// A trial is compared with its repeats where it has some, else with the fitted model. Two shapes are tried: a burst
    /// of torque in a joint, and an angle sensor that slips and stays off.
    ///
    /// * `scale` - misfit for each degree of freedom
    pub fn disturbance(&self, point: &LinearizationPoint<N>, scale: f64) -> Option<TrialSpecific> {
        let compared: Vec<Compared> = (0..self.fitted.len())
            .filter_map(|m| self.compared(point, m))
            .filter(|one| stands_out(&one.deviation, self.session.channels(), scale))
            .collect();
        let tried = self.fitted.len() * 4 * N * 100;
        let price = price(1, tried, self.rows_of_references());
        let mut best: Option<TrialSpecific> = None;
        for suspect in &compared {
            let explained = self.explained(point, suspect, scale);
            let Some(first) = explained.first() else {
                continue;
            };
            if first.gain <= best.as_ref().map_or(price, |b| b.gain) {
                continue;
            }
            let shrink = shrunk(suspect.others.len());
            best = Some(TrialSpecific {
                effect: first.effect(shrink),
                sd: libm::sqrt(scale * first.scatter / first.asked.square) / shrink,
                trial: Some(self.fitted[suspect.place]),
                gain: first.gain,
                rivals: explained[1..]
                    .iter()
                    .map(|other| (other.effect(shrink), first.gain - other.gain))
                    .filter(|(_, worse)| *worse <= TIE)
                    .collect(),
                locked: false,
                columns: Vec::new(),
                sizes: Vec::new(),
            });
        }
        best
    }

    /// What each kind in each place explains of how a trial differs from its repeats, where and as long as it explains most; the best first.
    fn explained(
        &self,
        point: &LinearizationPoint<N>,
        suspect: &Compared,
        scale: f64,
    ) -> Vec<Explained> {
        /// Share of what explains most on the grid of times below which a time of its own helps no more.
        const NEAR: f64 = 0.5;
        let trial = self.fitted[suspect.place];
        let see = |(effect, response): (Effect<f64>, Channels)| {
            let mut row = self.noise.whiten(&response, &suspect.samples);
            project_off(&mut row, &suspect.usual);
            let square = dot(&row, &row);
            (square > 0.0).then_some(Asked {
                effect,
                row,
                square,
            })
        };
        let shapes = self.shapes_in(point, trial);
        let asked: Vec<Asked> = shapes.into_iter().filter_map(see).collect();
        let mut clearest: Vec<(f64, &Asked)> = Vec::new();
        for one in asked.iter().filter(|one| self.is_finding(one, suspect)) {
            let gain = one.gain(&suspect.deviation) / scale;
            let same = |(_, c): &&mut (f64, &Asked)| c.place() == one.place();
            match clearest.iter_mut().find(same) {
                Some(known) if known.0 >= gain => (),
                Some(known) => *known = (gain, one),
                None => clearest.push((gain, one)),
            }
        }
        let most = clearest.iter().fold(0.0, |m, (gain, _)| f64::max(m, *gain));
        let near = clearest.into_iter().filter(|(gain, _)| *gain > NEAR * most);
        let deviations = suspect.deviations();
        let mut explained: Vec<Explained> = near
            .map(|(_, one)| {
                let scatter = scatter_elsewhere(one, &asked, &deviations);
                let answer = |effect| see((effect, self.answer_in(point, trial, effect)?));
                let asked = timed(one.clone(), &suspect.deviation, answer);
                let size = asked.along(&suspect.deviation) / asked.square;
                let gain = asked.gain(&suspect.deviation) / scale / scatter;
                Explained {
                    asked,
                    size,
                    scatter,
                    gain,
                }
            })
            .collect();
        explained.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        explained
    }

    /// Whether what is asked is a finding in a trial, whatever its size: of two repeats both deviate alike, and the disturbed one is further
    /// from the model; a sensor that moves within what the calibration promises of it is none.
    fn is_finding(&self, one: &Asked, suspect: &Compared) -> bool {
        let own = dot(&one.row, &suspect.own).abs();
        let further = |other: &Vec<f64>| own > dot(&one.row, other).abs();
        let promised = match one.effect.kind.probe().promise {
            Some(_) => self.session.tolerance.angle_offset(),
            None => 0.0,
        };
        let size = one.along(&suspect.deviation) / one.square;
        size.abs() > promised && suspect.others.iter().all(further)
    }

    /// What the channels of a trial's movement would show of a burst, for one unit of it.
    fn answer_in(
        &self,
        point: &LinearizationPoint<N>,
        trial: usize,
        mut burst: Effect<f64>,
    ) -> Option<Channels> {
        let line = point.lines.get(self.group_of[trial])?;
        let mut changed = point.hypothesis.clone();
        burst.parameters[0] = UNIT;
        changed.named.push(burst);
        line.response(&changed, UNIT, (false, false)).ok()
    }

    /// A fitted trial beside its repeats; `None` where it has none.
    fn compared(&self, point: &LinearizationPoint<N>, place: usize) -> Option<Compared> {
        let trial = self.fitted[place];
        let (others, samples) = self.repeats_of(place)?;
        let white = |m: &usize| self.noise.whiten(&point.residuals[*m], &samples);
        // How the hand holds the handle and how a sensor sits differ from trial to trial: that is no disturbance.
        let usual = self.usual(point, trial, &samples);
        let (own, others): (_, Vec<Vec<f64>>) = (white(&place), others.iter().map(white).collect());
        let mut deviation = deviation(&own, &others);
        project_off(&mut deviation, &usual);
        Some(Compared {
            place,
            samples,
            usual,
            own,
            others,
            deviation,
        })
    }

    /// Whitened columns of what differs from trial to trial without being a disturbance, each orthogonal to the others.
    fn usual(
        &self,
        point: &LinearizationPoint<N>,
        trial: usize,
        samples: &ValidSegments,
    ) -> Vec<Vec<f64>> {
        let length = self.session.trials[trial].len();
        let constant = |j: usize| {
            let mut channels = vec![vec![0.0; length]; self.session.channels()];
            channels[j] = vec![1.0; length];
            channels
        };
        let own = point.own.iter();
        let placed = own.map(|r| self.noise.whiten(&r.0[self.group_of[trial]], samples));
        let columns: Vec<Vec<f64>> = placed
            .chain((0..N).map(|j| self.noise.whiten(&constant(j), samples)))
            .collect();
        orthogonal(columns)
    }

    /// Other fitted trials with the same movement and the samples in which they are compared: all of them with repeats that are as long,
    /// else those of the longest that was broken off.
    fn repeats_of(&self, place: usize) -> Option<(Vec<usize>, ValidSegments)> {
        /// Share of its samples that a repeat has to hold.
        const WHOLE: f64 = 0.9;
        /// The same of a repeat that was broken off.
        const HALF: f64 = 0.5;
        let own = &self.valid_segments[self.fitted[place]];
        let group = self.group_of[self.fitted[place]];
        let others = |least: f64| -> Vec<(usize, ValidSegments)> {
            (0..self.fitted.len())
                .filter(|&o| o != place && self.group_of[self.fitted[o]] == group)
                .filter_map(|o| {
                    let shared = own.shared(&self.valid_segments[self.fitted[o]])?;
                    (shared.len() as f64 >= least * own.len() as f64).then_some((o, shared))
                })
                .collect()
        };
        let found = [WHOLE, HALF].map(others);
        let found = found.into_iter().find(|f| !f.is_empty())?;
        let shortest = found
            .iter()
            .map(|(_, s)| s)
            .min_by_key(|s| s.len())?
            .clone();
        Some((found.into_iter().map(|(o, _)| o).collect(), shortest))
    }

    /// Unit disturbances of a trial with what they would show: bursts in every joint, slips of every angle sensor.
    fn shapes_in(
        &self,
        point: &LinearizationPoint<N>,
        trial: usize,
    ) -> Vec<(Effect<f64>, Channels)> {
        /// Time between the starts that are tried \[s\]: a third of the shortest burst.
        const EVERY: f64 = 0.1;
        /// Durations of bursts that are tried \[s\], each twice the one before.
        const LONG: [f64; 3] = [0.3, 0.6, 1.2];
        let course = &self.courses[self.references[self.group_of[trial]]];
        let end = course.raw[0].len() as f64 / course.rate;
        let starts = (end / EVERY) as usize;
        if point.lines.is_empty() {
            return Vec::new();
        }
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
        let answered = self.parallel(bursts.len(), |i| self.answer_in(point, trial, bursts[i]));
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
                    let step = (0..count).map(|i| f64::from(u8::from(i >= first)));
                    // In the band of what it is compared with.
                    let Ok(slip) = smooth(&[step.collect()], course.band, course.rate) else {
                        continue;
                    };
                    let mut channels = vec![vec![0.0; count]; self.session.channels()];
                    channels.splice(j..=j, slip);
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

/// A fitted trial beside its repeats, all whitened in the samples that they share.
struct Compared {
    /// Its place among the fitted trials.
    place: usize,
    samples: ValidSegments,
    /// What differs from trial to trial without being a disturbance.
    usual: Vec<Vec<f64>>,
    /// What the model leaves of it, and of its repeats.
    own: Vec<f64>,
    others: Vec<Vec<f64>>,
    /// How it differs from them, without what is usual.
    deviation: Vec<f64>,
}

impl Compared {
    /// How each of the trials differs from the others, without what is usual.
    fn deviations(&self) -> Vec<Vec<f64>> {
        let mut all = vec![self.deviation.clone()];
        for (o, other) in self.others.iter().enumerate() {
            let rest = self.others.iter().enumerate().filter(|(r, _)| *r != o);
            let rest = rest.map(|(_, r)| r.clone()).chain([self.own.clone()]);
            let mut own = deviation(other, &rest.collect::<Vec<_>>());
            project_off(&mut own, &self.usual);
            all.push(own);
        }
        all
    }
}

/// A whitened residual less the mean of its repeats, scaled to the noise of one trial.
fn deviation(own: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
    let n = others.len() as f64;
    let shrink = shrunk(others.len());
    (0..own.len())
        .map(|i| shrink * (own[i] - others.iter().map(|o| o[i]).sum::<f64>() / n))
        .collect()
}

/// Factor by which the difference of a trial and the mean of some repeats has the noise of one trial; one without repeats.
fn shrunk(repeats: usize) -> f64 {
    match repeats {
        0 => 1.0,
        n => 1.0 / libm::sqrt(1.0 + 1.0 / n as f64),
    }
}

/// A disturbance that is asked for, with what it would show.
#[derive(Clone)]
struct Asked {
    effect: Effect<f64>,
    /// Whitened, without what is usual.
    row: Vec<f64>,
    square: f64,
}

impl Asked {
    fn place(&self) -> (Kind, usize) {
        (self.effect.kind, self.effect.index)
    }

    /// Product of what it would show and what a trial differs from its repeats by.
    fn along(&self, deviation: &[f64]) -> f64 {
        dot(&self.row, deviation)
    }

    /// What it explains of that difference.
    fn gain(&self, deviation: &[f64]) -> f64 {
        let along = self.along(deviation);
        along * along / self.square
    }
}

/// A disturbance at the time at which it explains most.
struct Explained {
    asked: Asked,
    size: f64,
    /// See [`scatter_elsewhere`].
    scatter: f64,
    gain: f64,
}

impl Explained {
    /// The effect in the size that it has.
    ///
    /// * `shrink` - see [`shrunk`]
    fn effect(&self, shrink: f64) -> Effect<f64> {
        let mut effect = self.asked.effect;
        effect.parameters[0] = self.size / shrink;
        effect
    }
}

/// A burst with the start and the duration with which it explains most: those of the grid decide neither its size nor its joint.
///
/// * `deviation` - what the trial differs from its repeats by
/// * `answer` - what a burst would show
fn timed(
    mut best: Asked,
    deviation: &[f64],
    answer: impl Fn(Effect<f64>) -> Option<Asked>,
) -> Asked {
    /// First and last change of the start \[s\].
    const STEPS: (f64, f64) = (0.05, 0.01);
    /// Changes of the duration, in changes of the start.
    const LONGER: f64 = 2.0;
    /// Shortest and longest burst \[s\].
    const DURATION: (f64, f64) = (0.1, 3.0);
    if best.effect.kind.probe().nature != Nature::Burst {
        return best;
    }
    let mut step = STEPS.0;
    while step > STEPS.1 {
        let longer = LONGER * step;
        // A burst that lasts longer about its middle starts earlier.
        let moves = [(step, 0.0), (-step, 0.0), (-step, longer), (step, -longer)];
        let moved = moves.into_iter().find_map(|(start, duration)| {
            let mut effect = best.effect;
            effect.parameters[1] += start;
            effect.parameters[2] += duration;
            let within = effect.parameters[1] >= 0.0
                && (DURATION.0..=DURATION.1).contains(&effect.parameters[2]);
            let moved = within.then(|| answer(effect))??;
            (moved.gain(deviation) > best.gain(deviation)).then_some(moved)
        });
        match moved {
            Some(moved) => best = moved,
            None => step *= 0.5,
        }
    }
    best
}

/// How much more than noise the shape of a burst finds at other times of its movement, as a ratio of variances; at least one.
///
/// Joints that stick elsewhere in every repeat, and noise that is not as the autoregression has it, look like bursts at many times.
///
/// * `deviations` - of the trial and its repeats
fn scatter_elsewhere(one: &Asked, asked: &[Asked], deviations: &[Vec<f64>]) -> f64 {
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

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

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
        assert_eq!(
            scatter_elsewhere(&asked[45], &asked, std::slice::from_ref(&once)),
            1.0
        );
        // As much all the time is no burst.
        let always = vec![9.0; 95];
        let scatter = scatter_elsewhere(&asked[45], &asked, &[once, always]);
        assert!((scatter - 81.0 / 2.706).abs() < 1e-12, "{scatter}");
    }

    #[test]
    fn a_burst_is_timed_between_the_points_of_the_grid() {
        // A bump over 10 s, a hundred samples a second.
        let answer = |effect: Effect<f64>| {
            let [_, start, duration, ..] = effect.parameters;
            let at = |i: usize| {
                let s = (0.01 * i as f64 - start) / duration;
                let inside = (0.0..=1.0).contains(&s);
                let bump = s * (1.0 - s);
                if inside { bump * bump * bump } else { 0.0 }
            };
            let row: Vec<f64> = (0..1000).map(at).collect();
            let square = dot(&row, &row);
            Some(Asked {
                effect,
                row,
                square,
            })
        };
        let burst =
            |start, duration| Effect::new(Kind::Voluntary, 0).with(&[1e-2, start, duration]);
        let seen = answer(burst(4.28, 0.5)).expect("a row").row;
        let coarse = answer(burst(4.4, 0.3)).expect("a row");
        let part = coarse.gain(&seen) / dot(&seen, &seen);
        assert!(part < 0.9, "{part}");
        let found = timed(coarse, &seen, answer);
        let [_, start, duration, ..] = found.effect.parameters;
        assert!(
            (start - 4.28).abs() < 0.03 && (duration - 0.5).abs() < 0.05,
            "{start} {duration}"
        );
        assert!(found.gain(&seen) > 0.99 * dot(&seen, &seen));
    }

    #[test]
    fn a_deviation_stands_out_from_four_and_a_half_standard_deviations_on() {
        // Twelve samples of two channels: 24 squares, whose sum has the standard deviation √48.
        let limit = 24.0 + 4.5 * 48.0_f64.sqrt();
        let of = |sum: f64| {
            let mut all = vec![0.0; 80];
            for channel in all.chunks_mut(40) {
                channel[10..22].fill((sum / 24.0).sqrt());
            }
            all
        };
        assert!(stands_out(&of(1.001 * limit), 2, 1.0));
        assert!(!stands_out(&of(0.999 * limit), 2, 1.0));
        // Where the model is wrong otherwise, more is usual.
        assert!(!stands_out(&of(1.9 * limit), 2, 2.0) && stands_out(&of(2.1 * limit), 2, 2.0));
        assert!(!stands_out(&[9.0; 22], 2, 1.0), "shorter than a window");
    }

    #[test]
    fn a_trial_differs_from_its_repeats_by_the_noise_of_one() {
        assert_eq!(shrunk(0), 1.0);
        assert!((shrunk(1) - 0.5_f64.sqrt()).abs() < 1e-15);
        assert!((shrunk(3) - 0.75_f64.sqrt()).abs() < 1e-15);
        let found = deviation(&[3.0], &[vec![1.0], vec![0.0], vec![-1.0]]);
        assert!((found[0] - 3.0 * 0.75_f64.sqrt()).abs() < 1e-15);
    }
}
