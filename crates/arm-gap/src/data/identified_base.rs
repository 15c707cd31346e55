//! Laws of joints that the model leaves without one, identified from the measured motion.
//!
//! A rigid model of literature values cannot follow a person: its free wrist falls. What every passive joint may have, springs with
//! a rest angle, viscosity and dry friction ([`arm_core::effect::Prior::passive`]), is linear in the equation of motion, and is
//! identified together with the segments: along the measured motion or, where a joint's speed is noise, along the simulated one.

use std::cell::LazyCell;
use std::collections::BTreeMap;

use arm_core::effect::{Effect, Family, KINDS, Kind, Place};
use arm_ident::inference::estimate::{Estimate, Identified};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::inference::joint_scale::{middle, weight_moment};
use arm_ident::regression::trial::{Model, Role, Trial};
use arm_ident::regression::unknown::spring;
use arm_numerics::statistics::extent::extent;

use crate::GapError;
use crate::data::course::Course;
use crate::data::joint_in_motion::{WithStd, in_motion, laws_in_motion};
use crate::data::passive_law::{Free, LIKELY, Passive};
use crate::data::session::{ComparisonMode, FURTHEST, Session};

/// Noise of a joint's speed, as a share of the speed, above which the motion is simulated, as the measured motion of that joint is
/// mostly noise. Below, measured motion is closer than a simulation without the missing effects.
const NOISY: f64 = 0.3;
/// Standard deviation of a rest angle about the middle of the angles that were reached \[rad\].
const REST_SD: f64 = 1.0;
/// Range of an angle in the common band up to which its joint hardly moves \[rad\]: a slip of a sensor or a soft orthosis makes as much.
pub const STILL: f64 = 0.01;
/// Share of the furthest turning joint's range below which a joint turns little: friction that holds it nearly all the time lets it slip.
const SMALL_RANGE: f64 = 0.5;
/// Furthest start of a segment from its literature values, in standard deviations.
const FURTHEST_START: f64 = 3.0;

/// The laws that were identified, each with the standard deviation of its size.
fn estimated<const N: usize>(found: &Identified<N>) -> Vec<WithStd> {
    let std = |law: &Effect<f64>| {
        let info = law.kind.info();
        let named = (info.kind, Some(law.index + 1), info.parameters[0].name);
        let own = |e: &&Estimate| (e.kind.as_str(), e.joint, e.name.as_str()) == named;
        let e = found.parameters.iter().find(own);
        e.map_or(f64::INFINITY, |e| e.std)
    };
    found.fitted.iter().map(|law| (*law, std(law))).collect()
}

impl<const N: usize> Session<N> {
    /// The same session with the passive base of joints without any law, as measured motion has it.
    ///
    /// Where the regression cannot be made the session stays as it is, and the search starts from the model as given.
    pub fn with_base(mut self, threads: usize) -> Self {
        let joints: Vec<usize> = (0..N).filter(|&j| !self.has_law(j)).collect();
        let forces = self.trials.iter().all(|t| t.force_on_arm.is_some());
        if joints.is_empty() || !forces || self.swings_freely() {
            return self;
        }
        let model = Model {
            chain: self.chain,
            segment_uncertainty: self.segment_uncertainty,
            fitted: self.passive_laws(&joints),
            held: self.effects.clone(),
            contact: self.contact,
        };
        let along = |motion, trials: &[Trial<N>]| {
            let options = Options {
                motion,
                tolerance: self.tolerance,
                threads,
                ..Options::default()
            };
            identify(&model, trials, &options)
        };
        // Test trials decide nothing.
        let fit = self.fit_trials().into_iter();
        let fit: Vec<_> = fit.map(|i| self.trials[i].clone()).collect();
        let Ok(mut found) = along(MotionSource::Measured, &fit) else {
            return self;
        };
        let noisy = found.speed_noise.iter().any(|&noise| noise > NOISY);
        if noisy && self.comparison == ComparisonMode::Led {
            found = along(MotionSource::Auto, &self.first_repeats()).unwrap_or(found);
        }
        let laws = self.hidden_by_friction(estimated(&found), (&found, &model));
        let still = match self.comparison {
            ComparisonMode::Led => self.hardly_moving(&laws),
            ComparisonMode::Torque => [false; N],
        };
        for (place, (law, std)) in laws.iter().enumerate() {
            let mut passive = self.passive(model.fitted[place]);
            if let Some(smoothing) = law.kind.smoothed_by()
                && self.comparison == ComparisonMode::Led
            {
                // A resting joint sticks, unless the data contradict.
                passive.effect.parameters[smoothing] = 0.0;
            }
            let size = law.parameters[0];
            if let Some((_, rest)) = spring(law)
                && size > 0.0
            {
                let middle = passive.effect.parameters[rest];
                let (low, high) = (middle - 2.0 * REST_SD, middle + 2.0 * REST_SD);
                passive.effect.parameters[rest] = law.parameters[rest].clamp(low, high);
            }
            passive.likely = size > 0.0 && size > LIKELY * std;
            passive.effect.parameters[0] = if passive.likely { size } else { 0.0 };
            if still[law.index] {
                self.hold(&mut passive);
            }
            self.base.push(passive);
        }
        let (chain, nominal) = (found.chain, self.chain);
        for k in 0..N {
            let (own, given) = (&chain.segments()[k], &nominal.segments()[k]);
            let ratio = |own: f64, given: f64| if given > 0.0 { own / given - 1.0 } else { 0.0 };
            let far = FURTHEST_START * self.segment_uncertainty;
            self.start[k] = [
                ratio(own.mass, given.mass),
                ratio(own.com[0], given.com[0]),
                ratio(own.inertia, given.inertia),
            ]
            .map(|change| change.clamp(-far, far));
        }
        self
    }

    /// The first fit trials of each movement. The search starts from their fit and refits it with all; two give the scatter of
    /// repeats, and repeated simulation of all of them would take longer than the search.
    fn first_repeats(&self) -> Vec<Trial<N>> {
        /// Of each movement.
        const REPEATS: usize = 2;
        let mut taken = BTreeMap::new();
        let fit = self.trials.iter().filter(|t| t.role == Role::Fit);
        fit.filter(|t| {
            let count = taken.entry(t.configuration).or_insert(0);
            *count += 1;
            *count <= REPEATS
        })
        .cloned()
        .collect()
    }

    /// Laws that were identified; those of a joint whose spring does not show beside its dry friction are read off the samples in which it
    /// moves.
    fn hidden_by_friction(
        &self,
        mut laws: Vec<WithStd>,
        (found, model): (&Identified<N>, &Model<N>),
    ) -> Vec<WithStd> {
        let shows = |(law, std): &WithStd| law.parameters[0] > LIKELY * std;
        // Differentiated once, and only where a joint needs it.
        let moving = LazyCell::new(|| in_motion(&self.trials, found.cutoff).unwrap_or_default());
        for own in laws.chunk_by_mut(|(a, _), (b, _)| a.index == b.index) {
            let mut dry = own.iter().filter(|(l, _)| l.kind.smoothed_by().is_some());
            let mut springs = own.iter().filter(|(law, _)| spring(law).is_some());
            let Some(&friction) = dry.find(|law| shows(law)) else {
                continue;
            };
            if springs.any(shows) {
                continue;
            }
            let (joint, chain) = (own[0].0.index, &found.chain);
            let laws = model.fitted.iter().filter(|law| law.index == joint);
            let laws: Vec<_> = laws.copied().collect();
            if let Some(alone) = laws_in_motion(chain, &moving, (joint, &laws, friction)) {
                own.copy_from_slice(&alone);
            }
        }
        laws
    }

    /// Whether the model has a law of a joint.
    fn has_law(&self, joint: usize) -> bool {
        self.effects.iter().any(|e| {
            let crosses = usize::from(e.kind.crosses());
            let here = e.index == joint || e.index == joint + crosses;
            let law = !matches!(e.kind.family(), Family::Segment | Family::Muscle);
            e.kind.info().place == Place::Joint && here && law
        })
    }

    /// What passive joints have, in those that have no law: without any size, springs at rest in the middle of the measured angles.
    fn passive_laws(&self, joints: &[usize]) -> Vec<Effect<f64>> {
        let fit = || self.trials.iter().filter(|t| t.role == Role::Fit);
        let law = |joint, kind: Kind| {
            let mut effect = Effect::<f64>::new(kind, joint);
            effect.parameters[0] = 0.0;
            if let Some((_, rest)) = spring(&effect) {
                effect.parameters[rest] = middle(fit(), joint);
            }
            effect
        };
        let passive = || KINDS.iter().filter(|k| k.prior().passive);
        joints
            .iter()
            .flat_map(|&joint| passive().map(move |&kind| law(joint, kind)))
            .collect()
    }

    /// How far each joint moves in the fit trials, in the common band \[rad\]. In one trial a sensor may slip, so the second largest range
    /// counts where there are several; infinite where a trial cannot be read.
    pub fn reach(&self) -> [f64; N] {
        let fit = self.fit_trials();
        let courses: Vec<_> = fit.iter().map(|&trial| self.course(trial)).collect();
        std::array::from_fn(|joint| {
            let range = |course: &Result<Course<N>, GapError>| {
                course.as_ref().map_or(f64::INFINITY, |course| {
                    let angles = std::iter::zip(&course.seen[joint], &course.counted);
                    let counted = angles.filter(|(_, counted)| **counted);
                    let (low, high) = extent(counted.map(|(q, _)| *q));
                    high - low
                })
            };
            let mut ranges: Vec<f64> = courses.iter().map(range).collect();
            ranges.sort_by(|a, b| b.total_cmp(a));
            ranges.get(1).or(ranges.first()).copied().unwrap_or(0.0)
        })
    }

    /// Which joints are at rest except for noise, or turn little with a viscosity far above the usual ones: that is friction which holds
    /// the joint nearly all the time. In a joint that turns as far as others it is dry friction at one speed.
    fn hardly_moving(&self, laws: &[WithStd]) -> [bool; N] {
        let reach = self.reach();
        let furthest = reach.into_iter().fold(0.0, f64::max);
        let mut still = reach.map(|reach| reach <= STILL);
        for (law, _) in laws {
            let expected = law.kind.prior().typical * self.weight_moment(law.index);
            let resists =
                law.kind.family() == Family::Rate && law.parameters[0] > FURTHEST * expected;
            still[law.index] |= resists && reach[law.index] < SMALL_RANGE * furthest;
        }
        still
    }

    /// Replaces the law of a joint that hardly moves by sticking friction, larger than any torque that it must hold. Its size cannot
    /// be determined, nor any other law of the joint.
    fn hold(&self, passive: &mut Passive) {
        passive.likely = passive.effect.is_dry();
        let holding = self.weight_moment(0);
        passive.effect.parameters[0] = if passive.likely { holding } else { 0.0 };
        passive.free.clear();
    }

    /// Laws of joints that are held, which the data cannot determine.
    pub fn hidden_laws(&self) -> Vec<Effect<f64>> {
        let hidden = self.base.iter().filter(|law| law.free.is_empty());
        hidden.map(|law| law.effect).collect()
    }

    /// For each law of the base, whether measured motion does not show it.
    pub(crate) fn unlikely_laws(&self) -> Vec<bool> {
        self.base.iter().map(|law| !law.likely).collect()
    }

    /// Joints that move and are held all the same, from 0: what resists them is far above any viscosity.
    pub fn held_in_motion(&self) -> Vec<usize> {
        let held = |law: &&Passive| law.likely && law.free.is_empty();
        let held = self.base.iter().filter(held).map(|law| law.effect.index);
        let mut held: Vec<usize> = held.collect();
        if !held.is_empty() {
            let reach = self.reach();
            held.retain(|&joint| reach[joint] > STILL);
        }
        held
    }

    /// A law with priors of its parameters.
    fn passive(&self, effect: Effect<f64>) -> Passive {
        /// Change of a law's size that a response is taken with, as a share of its typical size.
        const STEP: f64 = 0.01;
        let sd = effect.kind.prior().typical * self.weight_moment(effect.index);
        let size = Free {
            parameter: 0,
            mean: 0.0,
            sd,
            lower: 0.0,
            step: STEP * sd,
        };
        let rest = spring(&effect).map(|(_, parameter)| Free {
            parameter,
            mean: effect.parameters[parameter],
            sd: REST_SD,
            lower: f64::NEG_INFINITY,
            step: 1e-3,
        });
        Passive {
            effect,
            free: std::iter::once(size).chain(rest).collect(),
            likely: false,
        }
    }

    /// The weight moment that typical sizes of a joint are read off \[N m\].
    pub fn weight_moment(&self, joint: usize) -> f64 {
        weight_moment(&self.chain, joint)
    }
}

#[cfg(test)]
mod tests {
    use arm_core::Joints;

    use super::*;
    use crate::data::course::tests::resting;

    #[test]
    fn a_joint_hardly_moves_up_to_a_hundredth_of_a_radian() {
        let still = |range: f64| {
            let mut session = resting(100.0);
            // One period in the two seconds of the trial, far below the cutoff of 5 Hz.
            for (i, q) in session.trials[0].q.iter_mut().enumerate() {
                q[0] = 0.5 * range * libm::sin(core::f64::consts::PI * i as f64 / 100.0);
            }
            session.hardly_moving(&[])
        };
        assert_eq!(still(0.0095), [true, true]);
        assert_eq!(still(0.0105), [false, true]);
    }

    /// Typical is a fifth of the weight moment in N m s/rad.
    #[test]
    fn a_joint_that_turns_little_with_four_times_the_expected_viscosity_hardly_moves() {
        let turning = |share: f64| {
            let mut session = resting(100.0);
            session.trials[0].q.iter_mut().zip(0..).for_each(|(q, i)| {
                let at = libm::sin(core::f64::consts::PI * f64::from(i) / 100.0);
                *q = Joints::from([at, share * at]);
            });
            session
        };
        let still = |session: &Session<2>, kind, times: f64| {
            let expected = Kind::Viscous.prior().typical * session.weight_moment(1);
            session.hardly_moving(&[(Effect::new(kind, 1).with(&[times * expected]), 0.1)])
        };
        let mut session = turning(0.45);
        assert_eq!(still(&session, Kind::Viscous, 3.9), [false, false]);
        assert_eq!(still(&session, Kind::Viscous, 4.1), [false, true]);
        assert_eq!(still(&session, Kind::Elastic, 4.1), [false, false]);
        assert_eq!(still(&turning(0.55), Kind::Viscous, 4.1), [false, false]);

        let mut dry = session.passive(Effect::new(Kind::Coulomb, 1).with(&[0.1, 0.0]));
        session.hold(&mut dry);
        session.base.push(dry);
        assert_eq!(session.held_in_motion(), [1]);
    }

    #[test]
    fn the_base_starts_from_two_repeats_of_each_movement() {
        let mut session = resting(100.0);
        let one = session.trials[0].clone();
        session.trials = [
            (0, Role::Fit),
            (0, Role::Test),
            (1, Role::Fit),
            (0, Role::Fit),
            (0, Role::Fit),
        ]
        .iter()
        .zip(100..)
        .map(|(&(configuration, role), rate)| Trial {
            configuration,
            role,
            rate: f64::from(rate),
            ..one.clone()
        })
        .collect();
        let taken: Vec<f64> = session.first_repeats().iter().map(|t| t.rate).collect();
        assert_eq!(taken, [100.0, 102.0, 103.0]);
    }

    /// A spring as large as the weight of the arm beyond its joint, at rest within a radian of the middle.
    #[test]
    fn a_law_of_the_base_is_expected_at_its_typical_size() {
        let session = resting(100.0);
        let spring = Effect::new(Kind::Elastic, 1).with(&[0.0, 0.4]);
        let [size, rest] = session.passive(spring).free[..] else {
            panic!("two numbers are free");
        };
        let weight = session.weight_moment(1);
        assert_eq!(
            (size.mean, size.sd, size.step),
            (0.0, weight, 0.01 * weight)
        );
        assert_eq!((rest.mean, rest.sd), (0.4, 1.0));
    }

    #[test]
    fn friction_that_holds_a_joint_bears_all_of_the_arm() {
        let session = resting(100.0);
        let held = |kind, values: &[f64]| {
            let mut law = session.passive(Effect::new(kind, 1).with(values));
            session.hold(&mut law);
            (law.likely, law.effect.parameters[0], law.free.len())
        };
        let weight = session.weight_moment(0);
        assert_eq!(held(Kind::Coulomb, &[0.3, 0.0]), (true, weight, 0));
        assert_eq!(held(Kind::Elastic, &[0.3, 0.1]), (false, 0.0, 0));
    }
}
