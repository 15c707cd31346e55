//! Joint torques by inverse dynamics of the measured motion.

use arm_core::effect::{Effect, MAX_STATES, Motion, advance_states, resisting_torque};
use arm_core::{Joints, Pose, Reading, inverse_dynamics, joint_force};
use arm_ident::regression::kinematics::Kinematics;
use arm_sim::SimulationError;

use crate::data::contact_readings::Sensing;
use crate::data::course::{Channels, Course};
use crate::data::session::Session;
use crate::hypothesis::Hypothesis;

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
        let Some(motion) = &course.motion else {
            return Ok(Vec::new());
        };
        let effects = hypothesis.effects();
        let setup = self.rig(hypothesis)?;
        let arm = setup.chain()?;
        let sensors = Sensing::of(&effects);
        let offset = offsets(&effects);
        let mut states = vec![[0.0; MAX_STATES]; effects.len()];
        let mut before: Option<Motion<f64, N>> = None;
        let mut channels = vec![Vec::with_capacity(course.times.len()); N];
        for (i, &time) in course.times.iter().enumerate() {
            let (q, qd, qdd) = true_motion(hypothesis, motion, i);
            let chain = motion.chain_in_moving_frame(&arm, i);
            let q = q - offset;
            let pose = Pose::new(&q);
            let through = joint_force(&chain, &pose, (&qd, &qdd), [0.0; 2]);
            let mut at = Motion::new(time, q, qd).with_joint_force(&through);
            at.qdd = qdd;
            if let Some(from) = before.replace(at) {
                advance_states(&effects, (&from, &at), &mut states, 1.0 / course.rate);
            }
            let torque = inverse_dynamics(&chain, &pose, &qd, &qdd)
                + resisting_torque(&effects, &at, &states);
            let torque = match &course.contact {
                Some(contact) => {
                    let bend = motion.q[i] - true_motion(hypothesis, motion, i).0;
                    let rig = (&self.chain, &arm, &setup, &sensors);
                    contact.missing_force(rig, offset + bend, (i, time), torque)
                }
                None => torque,
            };
            for (j, channel) in channels.iter_mut().enumerate() {
                let is_held = course.at_rest.get(j).is_some_and(|rest| rest[i]);
                channel.push(if is_held { course.raw[j][i] } else { torque[j] });
            }
        }
        Ok(channels)
    }
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
    }
}
