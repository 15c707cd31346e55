//! Joint torques by inverse dynamics of the measured motion.

use arm_core::effect::{Effect, MAX_STATES, Motion, advance_states, resisting_torque};
use arm_core::{Joints, Pose, Reading, Setup, inverse_dynamics, joint_force};
use arm_ident::regression::kinematics::Kinematics;
use arm_sim::SimulationError;
use nalgebra::SMatrix;

use crate::data::contact_readings::Sensing;
use crate::data::course::{Channels, Course, difference};
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;

/// The channels of a trial without effects in joints, and their derivative with respect to the torques of such effects.
///
/// Most hypotheses differ only in effects in joints, so this part is computed once for all of them.
pub(crate) struct RigTorques<const N: usize> {
    rig: Rig<N>,
    /// Time between two samples \[s\].
    interval: f64,
    motions: Vec<Motion<f64, N>>,
    /// Channels without effects in joints, at every sample \[N m\].
    alone: Vec<Joints<f64, N>>,
    /// Derivative of the channels with respect to the resisting torques of the joints; zero in the row of a joint that dry friction holds.
    follow: Vec<SMatrix<f64, N, N>>,
}

/// Everything that the channels depend on except effects in joints.
#[derive(PartialEq)]
struct Rig<const N: usize> {
    setup: Setup<f64, N>,
    sensing: Sensing,
    offsets: Joints<f64, N>,
    eccentricity: [[f64; 2]; N],
}

impl<const N: usize> Rig<N> {
    fn of(session: &Session<N>, hypothesis: &Hypothesis<N>) -> Result<Self, SimulationError> {
        let effects = hypothesis.effects();
        Ok(Self {
            setup: session.rig(hypothesis)?,
            sensing: Sensing::of(&effects),
            offsets: offsets(&effects),
            eccentricity: hypothesis.eccentricity,
        })
    }
}

impl<const N: usize> Session<N> {
    /// Joint torques by inverse dynamics of the measured motion; where dry friction holds a joint, what was measured.
    ///
    /// # Errors
    /// [`SimulationError`] for a rig that cannot be.
    pub fn torques(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Channels, SimulationError> {
        match self.rig_torques(hypothesis, course)? {
            Some(rig) => Ok(rig.with(&hypothesis.effects())),
            None => Ok(Vec::new()),
        }
    }

    /// The part of [`Session::torques`] without effects in joints; `None` if no motion was measured.
    ///
    /// # Errors
    /// As [`Session::torques`].
    pub(crate) fn rig_torques(
        &self,
        hypothesis: &Hypothesis<N>,
        course: &Course<N>,
    ) -> Result<Option<RigTorques<N>>, SimulationError> {
        let Some(motion) = &course.motion else {
            return Ok(None);
        };
        let rig = Rig::of(self, hypothesis)?;
        let arm = rig.setup.chain()?;
        let count = course.times.len();
        let mut out = RigTorques {
            interval: 1.0 / course.rate,
            motions: Vec::with_capacity(count),
            alone: Vec::with_capacity(count),
            follow: Vec::with_capacity(count),
            rig,
        };
        for (i, &time) in course.times.iter().enumerate() {
            let (q, qd, qdd) = true_motion(hypothesis, motion, i);
            let chain = motion.chain_in_moving_frame(&arm, i);
            let bend = motion.q[i] - q;
            let q = q - out.rig.offsets;
            let pose = Pose::new(&q);
            let through = joint_force(&chain, &pose, (&qd, &qdd), [0.0; 2]);
            let mut at = Motion::new(time, q, qd).with_joint_force(&through);
            at.qdd = qdd;
            out.motions.push(at);
            let needed = inverse_dynamics(&chain, &pose, &qd, &qdd);
            let (mut alone, mut follow) = match &course.contact {
                Some(contact) => {
                    let rig = (&self.chain, &arm, &out.rig.setup, &out.rig.sensing);
                    contact.missing_force(rig, out.rig.offsets + bend, (i, time), needed)
                }
                None => (needed, SMatrix::identity()),
            };
            for j in (0..N).filter(|&j| course.at_rest.get(j).is_some_and(|rest| rest[i])) {
                alone[j] = course.raw[j][i];
                follow.fill_row(j, 0.0);
            }
            out.alone.push(alone);
            out.follow.push(follow);
        }
        Ok(Some(out))
    }
}

impl<const N: usize> RigTorques<N> {
    /// The channels with the given effects in joints \[N m\].
    pub(crate) fn with(&self, effects: &[Effect<f64>]) -> Channels {
        self.channels(effects, |i, resisting| {
            self.alone[i] + self.follow[i] * resisting
        })
    }

    /// The channels of `other` minus those of `own`, before the low-pass; `None` if rig or sensors of `other` differ.
    ///
    /// * `own` - the hypothesis with which these torques were computed
    ///
    /// # Errors
    /// As [`Session::torques`].
    pub(crate) fn difference(
        &self,
        session: &Session<N>,
        own: &Hypothesis<N>,
        other: &Hypothesis<N>,
    ) -> Result<Option<Channels>, SimulationError> {
        if Rig::of(session, other)? != self.rig {
            return Ok(None);
        }
        let (own, other) = (own.effects(), other.effects());
        let more = self.channels(&multiset_difference(&other, &own), |i, torque| {
            self.follow[i] * torque
        });
        let less = self.channels(&multiset_difference(&own, &other), |i, torque| {
            self.follow[i] * torque
        });
        Ok(Some(difference(&more, &less)))
    }

    /// Channels from the resisting torques of effects, at every sample.
    ///
    /// * `one` - the channels at a sample, from its index and its resisting torques
    fn channels(
        &self,
        effects: &[Effect<f64>],
        one: impl Fn(usize, Joints<f64, N>) -> Joints<f64, N>,
    ) -> Channels {
        let mut states = vec![[0.0; MAX_STATES]; effects.len()];
        let mut channels = vec![Vec::with_capacity(self.motions.len()); N];
        for (i, at) in self.motions.iter().enumerate() {
            if i > 0 {
                let from = &self.motions[i - 1];
                advance_states(effects, (from, at), &mut states, self.interval);
            }
            let shown = one(i, resisting_torque(effects, at, &states));
            for (j, channel) in channels.iter_mut().enumerate() {
                channel.push(shown[j]);
            }
        }
        channels
    }
}

/// The effects of the first list that are not in the second; an effect that occurs twice counts twice.
pub(crate) fn multiset_difference(
    effects: &[Effect<f64>],
    others: &[Effect<f64>],
) -> Vec<Effect<f64>> {
    let mut others = others.to_vec();
    let is_new = |effect: &&Effect<f64>| match others.iter().position(|o| o == *effect) {
        Some(same) => {
            others.swap_remove(same);
            false
        }
        None => true,
    };
    effects.iter().filter(is_new).copied().collect()
}

/// Angles, speeds and accelerations at a sample, without what an eccentric encoder adds to them.
fn true_motion<const N: usize>(
    hypothesis: &Hypothesis<N>,
    motion: &Kinematics<N>,
    i: usize,
) -> (Joints<f64, N>, Joints<f64, N>, Joints<f64, N>) {
    let (mut q, mut qd, mut qdd) = (motion.q[i], motion.qd[i], motion.qdd[i]);
    for (j, [cosine, sine]) in hypothesis.eccentricity.into_iter().enumerate() {
        if cosine != 0.0 || sine != 0.0 {
            let (sin, cos) = libm::sincos(q[j]);
            // The error, and its first and second derivative with respect to the angle.
            let error = cosine * cos + sine * sin;
            let slope = sine * cos - cosine * sin;
            qdd[j] -= slope * qdd[j] - error * qd[j] * qd[j];
            qd[j] -= slope * qd[j];
            q[j] -= error;
        }
    }
    (q, qd, qdd)
}

/// Angles without what an eccentric encoder adds to them.
pub(crate) fn unbent<const N: usize>(
    hypothesis: &Hypothesis<N>,
    q: &Joints<f64, N>,
) -> Joints<f64, N> {
    Joints::from_fn(|j, _| {
        let [cosine, sine] = hypothesis.eccentricity[j];
        let (sin, cos) = libm::sincos(q[j]);
        q[j] - cosine * cos - sine * sin
    })
}

/// What the sensors of the angles add to them.
pub(crate) fn offsets<const N: usize>(effects: &[Effect<f64>]) -> Joints<f64, N> {
    let mut reading = Reading::<f64, N> {
        time: 0.0,
        q: Joints::zeros(),
        force_on_arm: [0.0; 2],
        moment_on_arm: 0.0,
    };
    for effect in effects {
        effect.distort(&mut reading);
    }
    reading.q
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;
    use arm_core::{Contact, Placement, Plane, Setup, jacobian, sample_arms};
    use arm_ident::regression::trial::Trial;

    use nalgebra::Vector3;

    use super::*;
    use crate::data::course::tests::of_one;
    use crate::data::session::ComparisonMode;

    #[test]
    fn of_two_lists_of_effects_what_both_have_counts_once_for_each() {
        let of = |size: f64| Effect::<f64>::new(Kind::Viscous, 1).with(&[size]);
        let (one, two, three) = (of(1.0), of(2.0), of(3.0));
        assert_eq!(
            multiset_difference(&[one, two, one], &[one, three]),
            [two, one]
        );
        assert_eq!(
            multiset_difference(&[one, three], &[one, two, one]),
            [three]
        );
        assert!(multiset_difference(&[two, one], &[one, two]).is_empty());
    }

    /// Circles of an arm that its contact moves, read by sensors with every fault that there is.
    #[test]
    fn a_hypothesis_with_the_faults_of_the_sensors_explains_what_they_read_of_a_contact() {
        const RATE: f64 = 100.0;
        let chain = sample_arms::mechanical_arm();
        let faults = [
            Effect::new(Kind::AngleOffset, 1).with(&[0.05]),
            Effect::new(Kind::ForceBias, 1).with(&[-4.0]),
            Effect::new(Kind::ForceGain, 0).with(&[1.3]),
            Effect::new(Kind::ForceMisalignment, 0).with(&[0.2]),
            Effect::new(Kind::TimeDelay, 0).with(&[0.013]),
        ];
        let place = [0.01, -0.02];
        // Angles, speeds and accelerations.
        let moving = |t: f64| {
            let (sin, cos) = libm::sincos(t);
            let bent = Joints::from([0.3 * sin, 1.0 + 0.3 * cos]);
            let speed = Joints::from([0.3 * cos, -0.3 * sin]);
            (bent, speed, Joints::from([-0.3 * sin, -0.3 * cos]))
        };
        let mut setup = Setup::new(&chain, Contact::new([1e4; 2], [25.0; 2]));
        setup.placement = place;
        // The force that moves it.
        let held = |t: f64| -> Plane<f64> {
            let (q, qd, qdd) = moving(t);
            let pose = Pose::new(&q);
            let mut moves = jacobian(&chain, &pose);
            let beside = Placement::of(&setup).expect("beside").arm(&pose);
            for mut column in moves.column_iter_mut() {
                column[0] -= beside[1];
                column[1] += beside[0];
            }
            let torque = inverse_dynamics(&chain, &pose, &qd, &qdd);
            let force = moves.transpose().try_inverse().expect("bent") * torque;
            [force[0], force[1]]
        };
        let sensing = Sensing::of(&faults);
        let times: Vec<f64> = (0..600).map(|i| f64::from(i) / RATE).collect();
        let read = |&t: &f64| {
            let [y, z] = held(t - 0.013);
            let [y, z, _] = sensing.read(t, Vector3::new(y, z, 0.0)).into();
            [y, z]
        };
        let offset = offsets(&faults);
        let trial = Trial {
            force_on_arm: Some(times.iter().map(read).collect()),
            ..Trial::new(RATE, times.iter().map(|&t| moving(t).0 + offset).collect())
        };
        let mut session = of_one(chain, trial);
        session.comparison = ComparisonMode::Torque;
        let course = session.course(0).expect("a course");
        let left = |faults: &[Effect<f64>], placement: [f64; 2]| {
            let mut hypothesis = session.given();
            hypothesis.named = faults.to_vec();
            hypothesis.placement = placement;
            let computed = session.torques(&hypothesis, &course).expect("torques");
            // Away from the ends, where the motion is filtered.
            let apart = |j: usize| (100..500).map(move |i| (i, j)).collect::<Vec<_>>();
            let each = (0..2)
                .flat_map(apart)
                .map(|(i, j)| (computed[j][i] - course.raw[j][i]).abs());
            each.fold(0.0, f64::max)
        };
        assert!(left(&faults, place) < 2e-3, "{}", left(&faults, place));
        for without in 0..faults.len() {
            let mut others = faults.to_vec();
            others.remove(without);
            assert!(left(&others, place) > 0.01, "{:?}", faults[without].kind);
        }
        assert!(left(&faults, [0.0; 2]) > 0.01);

        let mut own = session.given();
        own.named = faults.to_vec();
        let rig = session.rig_torques(&own, &course).expect("a rig");
        let rig = rig.expect("a measured motion");
        for (kind, values) in [
            (Kind::Viscous, &[0.2][..]),
            (Kind::Relaxation, &[1.5, 0.4]),
            (Kind::Thixotropy, &[0.3]),
            (Kind::LoadFriction, &[0.05]),
        ] {
            let mut other = own.clone();
            other.named.push(Effect::new(kind, 1).with(values));
            let more = rig.difference(&session, &own, &other).expect("possible");
            let [before, after] =
                [&own, &other].map(|h| session.torques(h, &course).expect("torques"));
            let whole = difference(&after, &before);
            let pairs = std::iter::zip(more.expect("one rig").concat(), whole.concat());
            let (apart, size) = pairs.fold((0.0_f64, 0.0_f64), |(apart, size), (a, b)| {
                (apart.max((a - b).abs()), size.max(b.abs()))
            });
            assert!(apart < 1e-12 && size > 0.01, "{kind:?}: {apart} of {size}");
        }
        let mut other = own.clone();
        other.named.pop();
        let more = rig.difference(&session, &own, &other).expect("possible");
        assert!(more.is_none(), "another delay of the force");
    }
}
