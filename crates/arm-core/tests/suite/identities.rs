//! The same quantity by two independent ways, on 1000 random states each of 1, 2, 3 and 5 joints.

use arm_core::{
    Joints, Load, Pose, coriolis, coriolis_matrix, forward_dynamics, gravity, inertia,
    inverse_dynamics, jacobian, regressor, static_torque, tip_velocity,
};

use crate::common::Random;

const STATES: usize = 1000;
/// Rounding of sums of some dozen terms of order ten.
const ROUNDING: f64 = 1e-12;

/// Largest relative difference; one that is not a number is the result, so that no bound holds.
fn largest<const N: usize>(a: &Joints<f64, N>, b: &Joints<f64, N>) -> f64 {
    (0..N)
        .map(|i| (a[i] - b[i]).abs() / (1.0 + a[i].abs()))
        .fold(0.0, |m, d| if d <= m || m.is_nan() { m } else { d })
}

#[test]
fn a_difference_that_is_no_number_is_no_agreement() {
    let (a, b) = (Joints::<f64, 3>::zeros(), [0.0, f64::NAN, 0.0].into());
    assert!(largest(&a, &b).is_nan());
}

fn identities<const N: usize>(seed: u64) {
    let mut random = Random(seed);
    for _ in 0..STATES {
        let arm = random.arm::<N>();
        let (q, qd, qdd) = (
            random.joints::<N>(4.0),
            random.joints::<N>(3.0),
            random.joints::<N>(10.0),
        );
        let pose = Pose::new(&q);
        let torque = inverse_dynamics(&arm, &pose, &qd, &qdd);

        let mut by_regressor = regressor(&arm, &pose, &qd, &qdd).torque(
            arm.first_moments(),
            arm.normal_moments(),
            arm.second_moments(),
        );
        for i in 0..N {
            by_regressor[i] += arm.rotor_inertia()[i] * qdd[i];
        }
        assert!(largest(&torque, &by_regressor) < ROUNDING, "regressor");

        let y = regressor(&arm, &pose, &qd, &qdd);
        let mut by_segments = Joints::<f64, N>::zeros();
        for (k, s) in arm.segments().iter().enumerate() {
            let about_joint = s.inertia + s.mass * (s.com[0] * s.com[0] + s.com[1] * s.com[1]);
            let values = [s.mass, s.mass * s.com[0], s.mass * s.com[1], about_joint];
            for (column, value) in y.segment_columns(&arm, k).iter().zip(values) {
                by_segments += column * value;
            }
        }
        for i in 0..N {
            by_segments[i] += arm.rotor_inertia()[i] * qdd[i];
        }
        assert!(largest(&torque, &by_segments) < ROUNDING, "segment columns");

        let b = inertia(&arm, &pose);
        let by_matrices = b * qdd + coriolis_matrix(&arm, &pose, &qd) * qd + gravity(&arm, &pose);
        assert!(largest(&torque, &by_matrices) < ROUNDING, "B q̈ + C q̇ + G");
        assert!(
            largest(
                &coriolis(&arm, &pose, &qd),
                &(coriolis_matrix(&arm, &pose, &qd) * qd)
            ) < ROUNDING,
            "C q̇"
        );

        let load = Load {
            torque,
            force_on_arm: [random.uniform(-50.0, 50.0), 3.0],
            moment_on_arm: 0.7,
        };
        let contact = static_torque(&arm, &pose, load.force_on_arm, load.moment_on_arm);
        let balanced = Load {
            torque: torque - contact,
            ..load
        };
        let back = forward_dynamics(&arm, &pose, &qd, &balanced);
        // Rounding times the condition of B, which reaches 10⁵ here; `newton_euler` bounds it state by state.
        assert!(
            largest(&qdd, &back) < 1e-9,
            "inverse∘forward: {}",
            largest(&qdd, &back)
        );
        let again = inverse_dynamics(&arm, &pose, &qd, &back);
        assert!(
            largest(&torque, &again) < ROUNDING,
            "forward∘inverse {}",
            largest(&torque, &again)
        );

        let j = jacobian(&arm, &pose);
        let v = j * qd;
        let [vy, vz] = tip_velocity(&arm, &pose, &qd);
        assert!(
            (v[0] - vy).abs() < ROUNDING && (v[1] - vz).abs() < ROUNDING,
            "tip velocity"
        );
        let virtual_work = j.transpose() * nalgebra::Vector2::from(load.force_on_arm);
        let with_moment = virtual_work.add_scalar(load.moment_on_arm);
        assert!(largest(&contact, &with_moment) < ROUNDING, "Jᵀ F");
    }
}

#[test]
fn one_joint() {
    identities::<1>(1);
}
#[test]
fn two_joints() {
    identities::<2>(2);
}
#[test]
fn three_joints() {
    identities::<3>(3);
}
#[test]
fn five_joints() {
    identities::<5>(5);
}
