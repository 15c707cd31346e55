//! A second derivation: the recursive Newton-Euler algorithm, body by body in the world's axes.

use arm_core::{
    Chain, Joints, Load, Plane, Pose, Products, Resistance, Segment, contributions, coriolis,
    forward_dynamics, gravity, inertia, inverse_dynamics, joint_force, static_torque,
};

use crate::common::Random;

const STATES: usize = 1000;
/// Rounding of sums of some dozen terms of order ten to hundred.
const ROUNDING: f64 = 1e-12;

fn cross([ay, az]: Plane<f64>, [by, bz]: Plane<f64>) -> f64 {
    ay * bz - az * by
}
fn add(a: Plane<f64>, b: Plane<f64>) -> Plane<f64> {
    [a[0] + b[0], a[1] + b[1]]
}
fn scale(k: f64, a: Plane<f64>) -> Plane<f64> {
    [k * a[0], k * a[1]]
}

/// Torque and force of the proximal side on each joint.
fn newton_euler<const N: usize>(
    arm: &Chain<f64, N>,
    [q, qd, qdd]: [&Joints<f64, N>; 3],
    (force_on_arm, moment_on_arm): (Plane<f64>, f64),
) -> (Joints<f64, N>, [Plane<f64>; N]) {
    // Outward: with the frame accelerated against gravity, weight is inertia.
    let (mut angle, mut omega, mut alpha) = (0.0, 0.0, 0.0);
    let mut joint = scale(-1.0, arm.gravity());
    let mut arms = [[[0.0; 2]; 2]; N];
    let (mut inertial, mut turning) = ([[0.0; 2]; N], [0.0; N]);
    for (i, s) in arm.segments().iter().enumerate() {
        angle += q[i];
        omega += qd[i];
        alpha += qdd[i];
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let com = [
            cos * s.com[0] - sin * s.com[1],
            sin * s.com[0] + cos * s.com[1],
        ];
        let end = [cos * s.length, sin * s.length];
        let accelerated = |r: Plane<f64>| {
            let tangential = scale(alpha, [-r[1], r[0]]);
            add(joint, add(tangential, scale(-omega * omega, r)))
        };
        inertial[i] = scale(s.mass, accelerated(com));
        turning[i] = s.inertia * alpha;
        arms[i] = [com, end];
        joint = accelerated(end);
    }
    // Inward: each body in balance.
    let (mut torque, mut forces) = (Joints::<f64, N>::zeros(), [[0.0; 2]; N]);
    let (mut force, mut moment) = (scale(-1.0, force_on_arm), -moment_on_arm);
    for i in (0..N).rev() {
        let [com, end] = arms[i];
        moment += turning[i] + cross(com, inertial[i]) + cross(end, force);
        force = add(force, inertial[i]);
        torque[i] = moment + arm.rotor_inertia()[i] * qdd[i];
        forces[i] = force;
    }
    (torque, forces)
}

fn agrees<const N: usize>(seed: u64) {
    let mut random = Random(seed);
    for _ in 0..STATES {
        let arm = random.arm::<N>();
        let (q, qd, qdd) = (random.joints(4.0), random.joints(3.0), random.joints(10.0));
        let force = [random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0)];
        let moment = random.uniform(-2.0, 2.0);
        let (torque, forces) = newton_euler(&arm, [&q, &qd, &qdd], (force, moment));
        let pose = Pose::new(&q);
        let closed =
            inverse_dynamics(&arm, &pose, &qd, &qdd) - static_torque(&arm, &pose, force, moment);
        let scale = 1.0 + torque.amax();
        assert!((closed - torque).amax() < ROUNDING * scale);
        for (a, b) in joint_force(&arm, &pose, (&qd, &qdd), force)
            .iter()
            .zip(&forces)
        {
            let size = 1.0 + b[0].abs() + b[1].abs();
            assert!((a[0] - b[0]).abs() < ROUNDING * size && (a[1] - b[1]).abs() < ROUNDING * size);
        }
        let load = Load {
            torque,
            force_on_arm: force,
            moment_on_arm: moment,
        };
        accelerates(&arm, &pose, [&qd, &qdd], &load);
        sums(&arm, &pose, [&qd, &qdd], &load);
    }
}

/// Forward dynamics returns the accelerations up to rounding times the condition of B.
///
/// Each of the torques that balance is known to a few ε of itself, and B to a few ε of its norm; solving with B
/// multiplies the first by |B⁻¹| and the second by the condition number. The factor 16 covers sums of N terms.
fn accelerates<const N: usize>(
    arm: &Chain<f64, N>,
    pose: &Pose<f64, N>,
    [qd, qdd]: [&Joints<f64, N>; 2],
    load: &Load<f64, N>,
) {
    let b = inertia(arm, pose);
    assert!((b - b.transpose()).amax() < 1e-15 * b.amax(), "symmetric");
    let inverse = b.cholesky().expect("positive definite").inverse();
    let condition = b.norm() * inverse.norm();
    let back = forward_dynamics(arm, pose, qd, load);
    let contact = static_torque(arm, pose, load.force_on_arm, load.moment_on_arm);
    let balance = [
        load.torque,
        contact,
        gravity(arm, pose),
        coriolis(arm, pose, qd),
    ];
    let carried: f64 = balance.iter().map(|torque| torque.amax()).sum();
    let allowed = 16.0 * f64::EPSILON * (condition * qdd.norm() + inverse.norm() * carried);
    assert!(
        (back - qdd).norm() < allowed,
        "{} of {allowed}",
        (back - qdd).norm()
    );
}

/// Every term is the function of its name, and together they balance.
fn sums<const N: usize>(
    arm: &Chain<f64, N>,
    pose: &Pose<f64, N>,
    [qd, qdd]: [&Joints<f64, N>; 2],
    load: &Load<f64, N>,
) {
    let c = contributions(arm, pose, (qd, qdd), load);
    let close = |a: Joints<f64, N>, b: Joints<f64, N>| (a - b).amax() < ROUNDING * (1.0 + b.amax());
    assert!(close(c.inertial, inertia(arm, pose) * qdd));
    assert!(close(c.centrifugal + c.coriolis, coriolis(arm, pose, qd)));
    assert!(close(c.gravity, gravity(arm, pose)));
    assert!(close(
        c.contact,
        static_torque(arm, pose, load.force_on_arm, load.moment_on_arm)
    ));
    assert_eq!(c.joint, load.torque);
    let scale = 1.0 + c.inertial.amax() + c.centrifugal.amax() + c.contact.amax();
    assert!(c.imbalance().amax() < ROUNDING * scale);
    // One joint alone has no product of two speeds.
    for k in 0..N {
        let alone = Joints::from_fn(|i, _| if i == k { qd[k] } else { 0.0 });
        let alone = contributions(arm, pose, (&alone, qdd), load);
        assert!(alone.coriolis.amax() < ROUNDING * (1.0 + alone.centrifugal.amax()));
    }
}

#[test]
fn one_joint() {
    agrees::<1>(71);
}
#[test]
fn two_joints() {
    agrees::<2>(72);
}
#[test]
fn three_joints() {
    agrees::<3>(73);
}
#[test]
fn five_joints() {
    agrees::<5>(75);
}

#[test]
fn a_column_of_the_resistance_is_one_of_the_inverse_inertia_matrix() {
    let mut random = Random(29);
    for _ in 0..STATES {
        let arm = random.arm::<3>();
        let pose = Pose::new(&random.joints(3.0));
        let resistance = Resistance::at(&Products::of(&arm), &pose, &random.joints(3.0));
        for joint in 0..3 {
            let torque = inertia(&arm, &pose) * resistance.column(joint);
            for (i, felt) in torque.iter().enumerate() {
                let wanted = f64::from(i == joint);
                assert!(
                    (felt - wanted).abs() < ROUNDING * 100.0,
                    "{i} {joint}: {felt}"
                );
            }
        }
    }
}

/// A hand of 0.1 kg (radius of gyration 3 cm) on an ordinary arm, without and with a rotor of 0.05 kg m² at the wrist, about 550 times the
/// hand's own inertia. Accelerations are recovered within 64 ε τ / I, with the largest torque τ (at least 1 N m) and the hand's inertia I about
/// its centre of mass.
fn a_light_hand_is_accelerated_as_exactly<const N: usize>(seed: u64) {
    let mut random = Random(seed);
    for rotor in [0.0, 0.05] {
        for _ in 0..STATES {
            let mut segments = *random.arm::<N>().segments();
            segments[N - 1] = Segment {
                length: 0.08,
                mass: 0.1,
                com: [0.06, 0.0],
                inertia: 0.9e-4,
            };
            let mut rotors = [0.0; N];
            rotors[N - 1] = rotor;
            let arm = Chain::new(segments, [0.0; 2], [0.0, -9.81])
                .and_then(|arm| arm.with_rotor_inertia(rotors))
                .expect("valid");
            let (q, qd, qdd) = (random.joints(4.0), random.joints(3.0), random.joints(10.0));
            let pose = Pose::new(&q);
            let load = Load {
                torque: inverse_dynamics(&arm, &pose, &qd, &qdd),
                ..Load::none()
            };
            let size = load.torque.amax().max(1.0);
            let least = 0.9e-4;
            let allowed = 64.0 * f64::EPSILON * size / least;
            let back = forward_dynamics(&arm, &pose, &qd, &load);
            assert!(
                (back - qdd).amax() < allowed,
                "{} of {allowed}",
                (back - qdd).amax()
            );
        }
    }
}

#[test]
fn light_hands() {
    a_light_hand_is_accelerated_as_exactly::<3>(83);
    a_light_hand_is_accelerated_as_exactly::<4>(84);
    a_light_hand_is_accelerated_as_exactly::<6>(86);
}
