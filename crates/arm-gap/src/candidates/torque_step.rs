//! Step of the difference quotient in a torque: small beside the load of the joint, and large beside rounding.

use arm_core::effect::{Effect, MAX_STATES, Motion, advance_states, resisting_torque};
use arm_core::{Joints, Pose, inverse_dynamics, joint_force};

use crate::prepared_session::PreparedSession;
use crate::sensitivity::linearization_point::LinearizationPoint;

/// Share of a joint's torque that an effect has in the change with which its response is taken.
const SHARE: f64 = 0.02;
/// Torque below which a joint counts as unloaded \[N m\].
const UNLOADED: f64 = 0.05;

/// The joint motion of a group's reference, sample by sample.
pub(super) struct Movement<const N: usize> {
    pub(super) motion: Vec<Motion<f64, N>>,
    interval: f64,
    /// Size of the torque in each joint.
    torque: [f64; N],
}

pub(super) fn motions<const N: usize>(
    prepared: &PreparedSession<N>,
    point: &LinearizationPoint<N>,
) -> Vec<Movement<N>> {
    let one = |group: usize| {
        let course = &prepared.courses[prepared.references[group]];
        let state = |i: usize| match (course.motion(), point.lines.get(group)) {
            (Some(motion), _) => (motion.q[i], motion.qd[i], motion.qdd[i]),
            (None, Some(line)) => line.state(i),
            (None, None) => (Joints::zeros(), Joints::zeros(), Joints::zeros()),
        };
        let chain = &prepared.session.chain;
        let mut square = [0.0; N];
        let count = course.seen[0].len();
        let motion = (0..count)
            .map(|i| {
                let (q, qd, qdd) = state(i);
                let pose = Pose::new(&q);
                let torque = inverse_dynamics(chain, &pose, &qd, &qdd);
                for (sum, value) in square.iter_mut().zip(torque.iter()) {
                    *sum += value * value / count as f64;
                }
                let through = joint_force(chain, &pose, (&qd, &qdd), [0.0; 2]);
                let mut at = Motion::new(i as f64 / course.rate, q, qd).with_joint_force(&through);
                at.qdd = qdd;
                at
            })
            .collect();
        Movement {
            motion,
            interval: 1.0 / course.rate,
            torque: square.map(|s| libm::sqrt(s).max(UNLOADED)),
        }
    };
    prepared.parallel(prepared.references.len(), one)
}

/// The amplitude with which an effect's torque is a small share of what its joint carries, or the largest that the kind allows; `None`
/// where it has none.
///
/// * `unit` - the effect at an amplitude of one
/// * `amplitude` - the position of that parameter
pub(super) fn torque_step<const N: usize>(
    movements: &[Movement<N>],
    unit: Effect<f64>,
    amplitude: usize,
) -> Option<f64> {
    /// Share of the joint's torque that one unit of the effect must make: what less of it changes drowns in rounding.
    const LEAST: f64 = 1e-6;
    let mut largest = 0.0;
    for movement in movements {
        let mut square = 0.0;
        let mut memory = [[0.0; MAX_STATES]];
        let mut before: Option<&Motion<f64, N>> = None;
        for at in &movement.motion {
            if let Some(from) = before.replace(at) {
                advance_states(&[unit], (from, at), &mut memory, movement.interval);
            }
            let torque = resisting_torque(&[unit], at, &memory)[unit.index];
            square += torque * torque;
        }
        let size = libm::sqrt(square / movement.motion.len().max(1) as f64);
        largest = f64::max(largest, size / movement.torque[unit.index]);
    }
    // In a slow movement an effect that grows with speed is small: the step is limited by the range of the parameter.
    let info = &unit.kind.info().parameters[amplitude];
    (largest > LEAST).then(|| f64::min(SHARE / largest, 0.5 * info.max))
}

#[cfg(test)]
mod tests {
    use arm_core::effect::Kind;

    use super::*;

    /// One unit of viscosity makes as many newton metres as the joint has radians a second.
    #[test]
    fn a_response_is_taken_with_a_fiftieth_of_the_torque_of_the_joint() {
        let unit = Effect::new(Kind::Viscous, 0).with(&[1.0]);
        let step = |speed: f64| {
            let motion = Motion::new(0.0, Joints::from([0.0]), Joints::from([speed]));
            let movement = Movement {
                motion: vec![motion; 3],
                interval: 0.01,
                torque: [10.0],
            };
            torque_step(&[movement], unit, 0)
        };
        assert!((step(0.5).expect("a step") - 0.4).abs() < 1e-12);
        assert!(step(0.8e-5).is_none());
        // No more than half of what the parameter may be.
        let most = Kind::Viscous.info().parameters[0].max;
        assert_eq!(step(1.2e-5), Some(f64::min(0.5 * most, 0.02 / 1.2e-6)));
    }
}
