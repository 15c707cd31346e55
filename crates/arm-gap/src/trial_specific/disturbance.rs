//! Disturbances of single trials: a burst of torque, a sensor that slips.

use arm_core::effect::{Effect, KINDS, Nature};

use crate::candidates::candidate::price;
use crate::data::noise::dot;
use crate::data::prepared_session::PreparedSession;
use crate::data::valid_segments::ValidSegments;
use crate::measurement_model::prediction::{Channels, smooth};
use crate::selection::lack_of_fit::{orthogonal, project_off};
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::TrialSpecific;

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
            let asked: Vec<Asked> = self
                .shapes_in(point, trial)
                .into_iter()
                .filter_map(see)
                .collect();
            let shrink = shrunk(suspect.others.len());
            for one in &asked {
                let along = dot(&one.row, &suspect.deviation);
                // Of two repeats both deviate alike: the disturbed one is further from the model.
                let own = dot(&one.row, &suspect.own).abs();
                let further = suspect
                    .others
                    .iter()
                    .all(|other| own > dot(&one.row, other).abs());
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
                let scatter = scatter_elsewhere(one, &asked, &suspect.deviations());
                let gain = gain / scatter;
                if gain > least {
                    let mut effect = one.effect;
                    effect.parameters[0] = size / shrink;
                    best = Some(TrialSpecific {
                        effect,
                        sd: libm::sqrt(scale * scatter / one.square) / shrink,
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
        const EVERY: f64 = 0.1;
        const LONG: [f64; 3] = [0.3, 0.6, 1.2];
        const UNIT: f64 = 1e-2;
        let course = &self.courses[self.references[self.group_of[trial]]];
        let end = course.raw[0].len() as f64 / course.rate;
        let starts = (end / EVERY) as usize;
        let Some(line) = point.lines.get(self.group_of[trial]) else {
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
            let mut changed = point.hypothesis.clone();
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
