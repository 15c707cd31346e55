//! A trial-specific effect: a rhythm, the robot's ripple, or a disturbance of one trial.

use arm_core::effect::{Effect, Kind, MAX_PARAMETERS};

use crate::candidates::candidate::price;

/// Frequency below which a ripple must keep its phase in every trial and is tested like other effects \[Hz\]: movements and
/// what a model lacks of them reach that far.
pub(crate) const SLOW: f64 = 3.0;

/// An effect that stands apart from the fit of all trials.
#[derive(Clone, Debug)]
pub struct TrialSpecific {
    /// The effect; for a rhythm its phase is that of the first trial.
    pub effect: Effect<f64>,
    /// Standard deviations of the parameters that are its size, from the first that is not zero on.
    pub sd: Vec<f64>,
    /// The trial in which it is, for what happened once.
    pub trial: Option<usize>,
    /// What it gains, in units of twice the log-likelihood.
    pub gain: f64,
    /// Others that explain as much.
    pub alternatives: Vec<(Effect<f64>, f64)>,
    /// Whether its phase is the same in every trial.
    pub locked: bool,
    /// The swings that a rhythm is made of, and their sizes in every trial: in phase, and a quarter of a period earlier.
    pub columns: Vec<Effect<f64>>,
    /// See `columns`.
    pub sizes: Vec<Vec<f64>>,
}

impl TrialSpecific {
    /// Frequency \[Hz\] and phase \[rad\] of a rhythm.
    pub fn wave(&self) -> [f64; 2] {
        shapes_of(self.effect.kind).map(|p| self.effect.parameters[p])
    }

    /// Whether the size of a rhythm in simulated runs is beyond its standard deviation by as much as an effect must gain to be named.
    ///
    /// * `rows` - rows of data that decide it
    pub fn is_beyond_noise(&self, rows: usize) -> bool {
        let sizes = self.effect.kind.prior().parts.first();
        let sizes = sizes.map_or(&[][..], |part| part.sizes);
        let parameters = sizes.iter().map(|&p| self.effect.parameters[p]);
        let square: f64 = parameters.map(|size| size * size).sum();
        let sd = self.sd.first().copied().unwrap_or(0.0);
        square > price(sizes.len(), 1, rows) * sd * sd
    }

    /// Whether another is the same rhythm.
    pub fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.effect, &other.effect);
        let same = a.kind == b.kind && a.index == b.index && self.trial == other.trial;
        same && self.swings_with(other)
    }

    /// Whether another rhythm has the same frequency, whatever makes it.
    pub fn swings_with(&self, other: &Self) -> bool {
        /// Difference of two frequencies that are one \[Hz\].
        const NEAR: f64 = 0.3;
        let rhythms = self.trial.is_none() && other.trial.is_none();
        rhythms && (self.wave()[0] - other.wave()[0]).abs() < NEAR
    }

    /// Whether another happened to the same thing in the same trial, and at about the same time.
    pub fn is_same_event(&self, other: &Self) -> bool {
        /// Difference of two starts that are one \[s\].
        const NEAR: f64 = 0.5;
        let (a, b) = (&self.effect, &other.effect);
        let same = a.kind == b.kind && a.index == b.index && self.trial == other.trial;
        same && self.trial.is_some() && (self.span().0 - other.span().0).abs() < NEAR
    }

    /// What would make the same difference between two repeats in the other one: the opposite of it.
    pub fn in_the_other_repeat(mut self, trial: usize) -> Self {
        self.trial = Some(trial);
        let alternatives = self.alternatives.iter_mut().map(|(effect, _)| effect);
        for effect in std::iter::once(&mut self.effect).chain(alternatives) {
            let sizes = effect.kind.prior().parts.iter().flat_map(|part| part.sizes);
            for &size in sizes {
                effect.parameters[size] = -effect.parameters[size];
            }
        }
        self
    }

    /// From when to when it lasts \[s\].
    pub fn span(&self) -> (f64, f64) {
        let p = &self.effect.parameters;
        match timing_of(self.effect.kind) {
            (start, Some(duration)) => (p[start], p[start] + p[duration]),
            (start, None) => (p[start], f64::INFINITY),
        }
    }
}

/// Positions of the start and of the duration of a kind that happens once. The start of a slip of a sensor travels in the last place, which
/// its kind does not use.
pub fn timing_of(kind: Kind) -> (usize, Option<usize>) {
    let parameters = kind.info().parameters;
    let position = |name: &str| parameters.iter().position(|p| p.name == name);
    (
        position("start").unwrap_or(MAX_PARAMETERS - 1),
        position("duration"),
    )
}

/// Positions of frequency and phase of a kind that swings.
pub fn shapes_of(kind: Kind) -> [usize; 2] {
    let position = |name: &str| {
        let parameters = kind.info().parameters;
        parameters.iter().position(|p| p.name == name).unwrap_or(0)
    };
    [position("frequency"), position("phase")]
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Nature;

    use super::*;

    fn rhythm(kind: Kind, frequency: f64, trial: Option<usize>) -> TrialSpecific {
        let mut effect = Effect::new(kind, 0);
        effect.parameters[shapes_of(kind)[0]] = frequency;
        TrialSpecific {
            effect,
            sd: Vec::new(),
            trial,
            gain: 0.0,
            alternatives: Vec::new(),
            locked: false,
            columns: Vec::new(),
            sizes: Vec::new(),
        }
    }

    #[test]
    fn rhythms_are_one_where_they_are_nearer_than_a_third_of_a_hertz() {
        let kinds = arm_core::effect::KINDS.iter().copied();
        let mut swinging =
            kinds.filter(|k| matches!(k.prior().nature, Nature::Rhythm | Nature::Periodic));
        let (one, other) = (
            swinging.next().expect("a kind"),
            swinging.next().expect("another"),
        );
        let first = rhythm(one, 5.0, None);
        assert!(
            first.is_like(&rhythm(one, 5.29, None)) && !first.is_like(&rhythm(one, 5.31, None))
        );
        assert!(
            !first.is_like(&rhythm(other, 5.0, None))
                && first.swings_with(&rhythm(other, 5.0, None))
        );
        assert!(
            !first.swings_with(&rhythm(one, 5.0, Some(2))),
            "what happened once is no rhythm"
        );
    }

    #[test]
    fn a_rhythm_is_larger_than_its_noise_by_the_price_of_an_effect() {
        let mut one = rhythm(Kind::Tremor, 5.0, None);
        one.sd = vec![0.01];
        // 12 + ln 1000 = 18.9: 4.35 standard deviations.
        for (size, seen) in [(0.0434, false), (0.0436, true), (-0.0436, true)] {
            one.effect.parameters[0] = size;
            assert_eq!(one.is_beyond_noise(1000), seen, "{size}");
        }
    }

    #[test]
    fn a_burst_lasts_and_a_slip_stays() {
        let kinds = arm_core::effect::KINDS.iter();
        let burst = kinds
            .copied()
            .find(|k| k.prior().nature == Nature::Burst)
            .expect("a burst");
        let mut one = rhythm(burst, 0.0, Some(0));
        one.effect = Effect::new(burst, 0).with(&[0.5, 2.0, 0.3]);
        assert_eq!(one.span(), (2.0, 2.3));
        let slip = Kind::named("angle_offset").expect("known");
        one.effect = Effect::new(slip, 0);
        one.effect.parameters[MAX_PARAMETERS - 1] = 1.5;
        assert_eq!(one.span(), (1.5, f64::INFINITY));
        let of_the_handle = Kind::named("handle_slip").expect("known");
        one.effect = Effect::new(of_the_handle, 0).with(&[0.002, 0.001, 4.0]);
        assert_eq!(one.span(), (4.0, f64::INFINITY));
    }

    #[test]
    fn one_event_is_in_one_trial_in_one_place_and_at_one_time() {
        let burst = |joint: usize, start: f64, trial: Option<usize>| {
            let kind = Kind::named("voluntary").expect("known");
            let mut one = rhythm(kind, 0.0, trial);
            one.effect = Effect::new(kind, joint).with(&[0.3, start, 0.6]);
            one
        };
        let first = burst(1, 4.0, Some(2));
        assert!(first.is_same_event(&burst(1, 4.4, Some(2))));
        let others = [
            burst(1, 4.6, Some(2)),
            burst(0, 4.0, Some(2)),
            burst(1, 4.0, Some(3)),
        ];
        assert!(others.iter().all(|other| !first.is_same_event(other)));
    }
}
