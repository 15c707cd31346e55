//! Disturbances of single trials: a burst of torque, a handle or a sensor that slips.

use arm_core::effect::{Effect, Nature};

use crate::candidates::candidate::price;
use crate::data::course::Channels;
use crate::data::noise::{dot, orthogonal, project_off};
use crate::data::valid_segments::ValidSegments;
use crate::prepared_session::PreparedSession;
use crate::selection::model_selection::TIE;
use crate::sensitivity::linearization_point::LinearizationPoint;
use crate::trial_specific::component::{TrialSpecific, timing_of};
use crate::trial_specific::disturbance_shape::{
    CandidateDisturbance, Explained, Shape, scatter_elsewhere, timed,
};

impl<const N: usize> PreparedSession<'_, N> {
    /// The clearest disturbance of a single trial; `None` when no trial stands out.
    ///
    /// A trial is compared with its repeats where it has some, else with the fitted model. Three shapes are tried: a burst of torque in a
    /// joint, a handle that slips in the hand, and an angle sensor that slips; what slips stays off.
    ///
    /// * `scale` - misfit for each degree of freedom
    pub fn disturbance(&self, point: &LinearizationPoint<N>, scale: f64) -> Option<TrialSpecific> {
        let mut compared: Vec<Compared> = (0..self.fitted.len())
            .filter_map(|m| self.compared(point, m))
            .filter(|one| stands_out(&one.deviation, self.session.channels(), scale))
            .collect();
        // Repeats of a movement share what disturbances would show.
        let group = |one: &Compared| self.group_of[self.fitted[one.place]];
        compared.sort_by_key(group);
        let mut shown: Option<(usize, Vec<Shape>)> = None;
        let mut best: Option<(f64, TrialSpecific)> = None;
        for suspect in &compared {
            let group = group(suspect);
            let shapes = match shown.take() {
                Some((own, shapes)) if own == group => shapes,
                _ => self.shapes_in(point, group),
            };
            let (explained, scale) = self.explained(point, (suspect, &shapes), scale);
            shown = Some((group, shapes));
            let Some(first) = explained.first() else {
                continue;
            };
            let worth = self.worth(first, scale);
            if worth <= best.as_ref().map_or(0.0, |(worth, _)| *worth) {
                continue;
            }
            let shrink = shrunk(suspect.others.len());
            let found = TrialSpecific {
                effect: first.effect(shrink),
                sd: first.sd(scale, shrink),
                trial: Some(self.fitted[suspect.place]),
                gain: first.gain / scale,
                alternatives: explained[1..]
                    .iter()
                    .map(|other| (other.effect(shrink), worth - self.worth(other, scale)))
                    .filter(|(_, worse)| *worse <= TIE)
                    .collect(),
                locked: false,
                columns: Vec::new(),
                sizes: Vec::new(),
            };
            best = Some((worth, found));
        }
        best.map(|(_, found)| found)
    }

    /// What a disturbance gains beyond what it must: the price of its sizes, and of all the times and places that were tried.
    ///
    /// * `scale` - misfit for each degree of freedom
    fn worth(&self, one: &Explained, scale: f64) -> f64 {
        let tried = self.fitted.len() * 4 * N * 100;
        one.gain / scale - price(one.asked.sizes.len(), tried, self.rows_of_references())
    }

    /// What each kind in each place explains of how a trial differs from its repeats, where and as long as it explains most, the best first;
    /// and the misfit for each degree of freedom, as it is at other times: one number for all places, which compete for the same samples.
    fn explained(
        &self,
        point: &LinearizationPoint<N>,
        (suspect, shapes): (&Compared, &[Shape]),
        scale: f64,
    ) -> (Vec<Explained>, f64) {
        /// Share of what explains most on the grid of times below which a time of its own helps no more.
        const NEAR: f64 = 0.5;
        let trial = self.fitted[suspect.place];
        let white = self.noise.white_at(&suspect.samples);
        let group = self.group_of[trial];
        let see = |shape: &Shape| {
            if self.is_left_out(
                trial,
                shape.effect.parameters[timing_of(shape.effect.kind).0],
            ) {
                return None;
            }
            let row = |(p, channels): &(usize, _)| {
                let mut row = white(channels);
                project_off(&mut row, &suspect.usual);
                (*p, row)
            };
            let rows = shape.columns.iter().map(row).collect();
            CandidateDisturbance::along(shape.effect, rows, &suspect.deviation)
        };
        let asked: Vec<CandidateDisturbance> = shapes.iter().filter_map(see).collect();
        let mut clearest: Vec<(f64, &CandidateDisturbance)> = Vec::new();
        let possible = asked.iter().filter(|one| self.is_possible(one, suspect));
        for one in possible {
            let gain = one.gain(&suspect.deviation) / scale;
            let same = |(_, c): &&mut (f64, &CandidateDisturbance)| c.place() == one.place();
            match clearest.iter_mut().find(same) {
                Some(known) if known.0 >= gain => (),
                Some(known) => *known = (gain, one),
                None => clearest.push((gain, one)),
            }
        }
        let most = clearest.iter().fold(0.0, |m, (gain, _)| f64::max(m, *gain));
        clearest.retain(|(gain, _)| *gain > NEAR * most);
        let answer = |effect| see(&self.shape_of(point, group, effect)?);
        let at_its_time = |(_, one): &(f64, &CandidateDisturbance)| {
            let asked = timed((*one).clone(), &suspect.deviation, answer);
            Explained::of(asked, &suspect.deviation)
        };
        let mut explained: Vec<Explained> = clearest.iter().map(at_its_time).collect();
        explained.sort_by(|a, b| self.worth(b, scale).total_cmp(&self.worth(a, scale)));
        let scatter = explained.first().and_then(|first| {
            let place = first.asked.place();
            let (_, on_grid) = clearest.iter().find(|(_, one)| one.place() == place)?;
            let deviations = suspect.deviations();
            let left: Vec<_> = deviations.iter().map(|d| first.asked.left_of(d)).collect();
            Some(scatter_elsewhere(on_grid, &asked, &left))
        });
        // Impossible ones compete all the same: where one explains most, the others only imitate it.
        let effects = point.hypothesis.effects();
        let is_finding = |one: &Explained| self.is_finding(&one.asked, suspect, &effects);
        let is_told = explained.first().is_some_and(is_finding);
        explained.retain(|one| is_told && is_finding(one));
        (explained, scale * scatter.unwrap_or(1.0))
    }

    /// Whether a disturbance is possible in a trial: the trial deviates from all repeats by more than any of them does. Two trials deviate
    /// alike, and the disturbed one is further from the model. A disturbance with little effect on the compared samples, or in a joint that
    /// sticks, would have to be larger than its limit.
    fn is_possible(&self, one: &CandidateDisturbance, suspect: &Compared) -> bool {
        let own = dot(&one.row, &suspect.own);
        let others: Vec<f64> = suspect.others.iter().map(|o| dot(&one.row, o)).collect();
        let centre = match others.len() {
            1 => 0.0,
            n => (own + others.iter().sum::<f64>()) / (n + 1) as f64,
        };
        let mut others = others.iter();
        let is_furthest = others.all(|other| (own - centre).abs() > (other - centre).abs());
        let largest = one.effect.kind.info().parameters[one.sizes[0]].max;
        let largest = match one.effect.kind.prior().nature {
            Nature::Burst => strongest(self.session.weight_moment(one.effect.index)).min(largest),
            _ => largest,
        };
        is_furthest && one.size(&suspect.deviation).abs() < largest
    }

    /// Whether a disturbance is a finding in a trial: not if it is within the tolerance of the calibration, or if dry friction
    /// may hold it.
    ///
    /// * `effects` - of the model that is compared
    fn is_finding(
        &self,
        one: &CandidateDisturbance,
        suspect: &Compared,
        effects: &[Effect<f64>],
    ) -> bool {
        let prior = one.effect.kind.prior();
        let promised = match (prior.nature, prior.promise) {
            (Nature::Slip, _) => self.session.tolerance.handle_placement,
            (Nature::Burst, _) => held_either_way(effects, one.effect.index),
            (_, Some(_)) => self.session.tolerance.angle_offset(),
            (_, None) => 0.0,
        };
        one.size(&suspect.deviation).abs() > promised
    }

    /// A fitted trial beside its repeats; `None` where it has none.
    fn compared(&self, point: &LinearizationPoint<N>, place: usize) -> Option<Compared> {
        let trial = self.fitted[place];
        let (others, samples) = self.repeats_of(place)?;
        let white = self.noise.white_at(&samples);
        // How the hand holds the handle and how a sensor sits differ from trial to trial: that is no disturbance.
        let usual = self.usual(point, trial, &white);
        let residuals = |m: usize| white(&point.residuals[m]);
        let (own, others): (_, Vec<Vec<f64>>) = (
            residuals(place),
            others.into_iter().map(residuals).collect(),
        );
        drop(white);
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
        white: impl Fn(&Channels) -> Vec<f64>,
    ) -> Vec<Vec<f64>> {
        let length = self.session.trials[trial].len();
        let constant = |j: usize| {
            let mut channels = vec![vec![0.0; length]; self.session.channels()];
            channels[j] = vec![1.0; length];
            channels
        };
        let own = point.own.iter();
        let placed = own.map(|r| white(&r.0[self.group_of[trial]]));
        let columns: Vec<Vec<f64>> = placed.chain((0..N).map(|j| white(&constant(j)))).collect();
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

/// Torque by which two repeats may differ where a joint sticks \[N m\]: it holds any torque within plus and minus its dry friction. A burst
/// below is none.
fn held_either_way(effects: &[Effect<f64>], joint: usize) -> f64 {
    let is_torque = |e: &&Effect<f64>| e.kind.info().parameters[0].unit == "N m";
    let dry = effects
        .iter()
        .filter(|e| e.on && e.index == joint && e.kind.smoothed_by().is_some());
    2.0 * dry
        .filter(is_torque)
        .fold(0.0, |most, e| f64::max(most, e.parameters[0]))
}

/// Whether a disturbance is a burst that dry friction of the final model may hold, within two standard deviations of its size: it was found
/// before that friction was.
pub(crate) fn is_held(one: &TrialSpecific, effects: &[Effect<f64>]) -> bool {
    let is_burst = one.effect.kind.prior().nature == Nature::Burst;
    let uncertain = one.sd.first().map_or(0.0, |sd| 2.0 * sd);
    is_burst
        && one.effect.parameters[0].abs() <= held_either_way(effects, one.effect.index) + uncertain
}

/// What muscles can do in a joint at most \[N m\]; anything where nothing weighs.
///
/// * `weight` - largest moment of the weight there \[N m\]
fn strongest(weight: f64) -> f64 {
    /// Times the weight. At the wrist, where it is most, up to 19 N m (Delp, Grierson, Buchanan 1996, J. Biomech. 29) over the 0.4 N m of
    /// a hand.
    const STRONGEST: f64 = 50.0;
    if weight > 0.0 {
        STRONGEST * weight
    } else {
        f64::INFINITY
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

    #[test]
    fn the_driest_law_of_a_joint_counts_and_what_is_no_torque_does_not() {
        let of = |kind, index, size: f64| Effect::<f64>::new(kind, index).with(&[size]);
        let effects = [
            of(Kind::Viscous, 0, 3.0),
            of(Kind::Coulomb, 0, 0.1),
            of(Kind::Coulomb, 1, 0.2),
            of(Kind::Stribeck, 1, 0.15),
            of(Kind::LoadFriction, 1, 0.9),
        ];
        assert_eq!(
            [0, 1, 2].map(|j| held_either_way(&effects, j)),
            [0.2, 0.4, 0.0]
        );
    }

    #[test]
    fn muscles_are_as_strong_as_fifty_times_the_weight() {
        assert_eq!(strongest(0.4), 20.0);
        assert_eq!(strongest(0.0), f64::INFINITY, "an arm that nothing pulls");
    }

    #[test]
    fn a_burst_that_the_final_friction_may_hold_is_none() {
        let of = |kind: &str, size: f64| TrialSpecific {
            effect: Effect::new(Kind::named(kind).expect("known"), 0).with(&[size]),
            sd: vec![0.01],
            trial: Some(0),
            gain: 50.0,
            alternatives: Vec::new(),
            locked: false,
            columns: Vec::new(),
            sizes: Vec::new(),
        };
        let dry = [Effect::<f64>::new(Kind::Coulomb, 0).with(&[0.2])];
        assert!(is_held(&of("voluntary", -0.41), &dry) && !is_held(&of("voluntary", 0.43), &dry));
        let elsewhere = [Effect::<f64>::new(Kind::Coulomb, 1).with(&[0.2])];
        assert!(!is_held(&of("voluntary", -0.41), &elsewhere));
        assert!(
            !is_held(&of("handle_slip", 0.01), &dry),
            "a slip is no torque"
        );
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
