//! Derivatives by dual numbers: each quantity against the one whose derivative it must be.

use arm_core::effect::{Effect, KINDS, Local, Place};
use arm_core::{
    Chain, Elbow, Joints, Limits, Load, Pose, Profile, Robot, Scalar, Shape, coriolis,
    coriolis_matrix, forward_dynamics, gravity, inertia, inverse_dynamics, jacobian, jacobian_rate,
    kinetic_energy, potential_energy, static_torque, tip, tip_velocity, torque_by_angle,
};

use crate::common::Random;
use crate::dual::{Dual, along};

const STATES: usize = 1000;
/// Rounding of sums of some dozen terms of order ten.
const ROUNDING: f64 = 1e-12;

fn unit<const N: usize>(i: usize) -> Joints<f64, N> {
    Joints::from_fn(|k, _| if k == i { 1.0 } else { 0.0 })
}

struct State<const N: usize> {
    arm: Chain<f64, N>,
    dual: Chain<Dual, N>,
    q: Joints<f64, N>,
    qd: Joints<f64, N>,
    pose: Pose<f64, N>,
}

fn states<const N: usize>(seed: u64) -> impl Iterator<Item = (State<N>, Random)> {
    let mut random = Random(seed);
    (0..STATES).map(move |i| {
        let arm = random.arm::<N>();
        let (q, qd) = (random.joints(4.0), random.joints(3.0));
        let state = State {
            arm,
            dual: arm.cast(),
            q,
            qd,
            pose: Pose::new(&q),
        };
        (state, Random(seed * 1000 + i as u64))
    })
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() < ROUNDING * (1.0 + b.abs()), "{a} {b}");
}

fn statics_and_kinematics<const N: usize>(seed: u64) {
    for (s, _) in states::<N>(seed) {
        let (g, j) = (gravity(&s.arm, &s.pose), jacobian(&s.arm, &s.pose));
        for i in 0..N {
            let moved = Pose::new(&along(&s.q, &unit(i)));
            close(g[i], potential_energy(&s.dual, &moved).slope);
            let [y, z] = tip(&s.dual, &moved);
            close(j[(0, i)], y.slope);
            close(j[(1, i)], z.slope);
        }
        let moving = Pose::new(&along(&s.q, &s.qd));
        let [y, z] = tip(&s.dual, &moving);
        let [vy, vz] = tip_velocity(&s.arm, &s.pose, &s.qd);
        close(vy, y.slope);
        close(vz, z.slope);
        let rate = jacobian_rate(&s.arm, &s.pose, &s.qd);
        let by_dual = jacobian(&s.dual, &moving);
        for (a, b) in rate.iter().zip(by_dual.iter()) {
            close(*a, b.slope);
        }
    }
}

/// C from B alone, by Lagrange: `C q̇ = Ḃ q̇ − ½ ∂(q̇ᵀ B q̇)/∂q`; and the entries of C: `Ḃ − 2C` is skew.
fn lagrange<const N: usize>(seed: u64) {
    for (s, _) in states::<N>(seed) {
        let b_rate = inertia(&s.dual, &Pose::new(&along(&s.q, &s.qd))).map(|b| b.slope);
        let c = coriolis_matrix(&s.arm, &s.pose, &s.qd);
        let skew = b_rate - c * 2.0;
        for i in 0..N {
            for k in 0..N {
                close(skew[(i, k)], -skew[(k, i)]);
                close(b_rate[(i, k)], c[(i, k)] + c[(k, i)]);
            }
        }
        let still = along(&s.qd, &Joints::zeros());
        let torque = coriolis(&s.arm, &s.pose, &s.qd);
        let turned = b_rate * s.qd;
        for i in 0..N {
            let moved = Pose::new(&along(&s.q, &unit(i)));
            close(
                torque[i],
                turned[i] - kinetic_energy(&s.dual, &moved, &still).slope,
            );
        }
    }
}

/// What the joints give for a motion under a force at the tip follows every angle.
fn torque_slopes<const N: usize>(seed: u64) {
    for (s, mut random) in states::<N>(seed) {
        let qdd = random.joints(20.0);
        let force = [random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0)];
        let slopes = torque_by_angle(&s.arm, &s.pose, (&s.qd, &qdd), force);
        let [qd, qdd] = [&s.qd, &qdd].map(|rates| along(rates, &Joints::zeros()));
        for i in 0..N {
            let moved = Pose::new(&along(&s.q, &unit(i)));
            let torque = inverse_dynamics(&s.dual, &moved, &qd, &qdd)
                - static_torque(&s.dual, &moved, force.map(Dual::of), Dual::ZERO);
            // Terms of order a hundred may cancel.
            let scale = 1.0 + slopes.amax();
            for j in 0..N {
                assert!((slopes[(j, i)] - torque[j].slope).abs() < ROUNDING * scale);
            }
        }
    }
}

/// The rate of energy is the power of what acts.
fn power<const N: usize>(seed: u64) {
    for (s, mut random) in states::<N>(seed) {
        let load = Load {
            torque: random.joints(10.0),
            force_on_arm: [random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0)],
            moment_on_arm: random.uniform(-2.0, 2.0),
        };
        // Rotors turn with the joints and hold energy as part of B.
        let qdd = forward_dynamics(&s.arm, &s.pose, &s.qd, &load);
        let moving = Pose::new(&along(&s.q, &s.qd));
        let energy = kinetic_energy(&s.dual, &moving, &along(&s.qd, &qdd))
            + potential_energy(&s.dual, &moving);
        let [vy, vz] = tip_velocity(&s.arm, &s.pose, &s.qd);
        let supplied = load.torque.dot(&s.qd)
            + load.force_on_arm[0] * vy
            + load.force_on_arm[1] * vz
            + load.moment_on_arm * s.qd.sum();
        // The accelerations carry the conditioning of B, and their power with them.
        let scale = 1.0 + qdd.amax() * s.qd.amax();
        assert!((energy.slope - supplied).abs() < ROUNDING * scale.max(1.0 + supplied.abs()));
        let by_torque =
            load.torque + static_torque(&s.arm, &s.pose, load.force_on_arm, load.moment_on_arm);
        close(by_torque.dot(&s.qd), supplied);
    }
}

macro_rules! for_joints {
    ($($name:ident: $check:ident $seed:literal)*) => {$(
        #[test]
        fn $name() {
            $check::<1>($seed);
            $check::<2>($seed);
            $check::<3>($seed);
            $check::<5>($seed);
        }
    )*};
}
for_joints! {
    gravity_and_jacobians_are_derivatives: statics_and_kinematics 61
    coriolis_follows_from_inertia: lagrange 62
    energy_changes_by_the_power_supplied: power 63
    torques_follow_the_angles: torque_slopes 64
}

#[test]
fn effect_gradients_are_derivatives() {
    let mut random = Random(64);
    for &kind in KINDS.iter().filter(|k| k.info().place == Place::Joint) {
        for _ in 0..STATES {
            let local = random.motion::<3>().local(1, random.states());
            let effect = random.effect(kind, 1);
            let gradient = effect.gradient(&local);
            for i in 0..kind.info().parameters.len() {
                let parameters = core::array::from_fn(|k| {
                    Dual::new(effect.parameters[k], if k == i { 1.0 } else { 0.0 })
                });
                let dual = Effect {
                    kind,
                    index: 1,
                    parameters,
                    on: true,
                };
                let of = |x| Dual::new(x, 0.0);
                let slope = dual.torque(&Local {
                    time: of(local.time),
                    q: of(local.q),
                    qd: of(local.qd),
                    qdd: of(local.qdd),
                    proximal_q: of(local.proximal_q),
                    joint_force: of(local.joint_force),
                    activity: of(local.activity),
                    memory: local.memory.map(of),
                });
                if kind.info().kind != "motor_inertia" {
                    close(gradient[i], slope.slope);
                }
            }
        }
    }
}

#[test]
fn robot_rates_are_derivatives() {
    let mut random = Random(65);
    for _ in 0..STATES {
        let robot = Robot::new([0.4, 0.5], [0.3, -0.2], Elbow::Up).expect("valid");
        let of = Dual::of;
        let dual = Robot::new([of(0.4), of(0.5)], [of(0.3), of(-0.2)], Elbow::Up).expect("valid");
        let (q, qd, qdd) = (
            random.joints::<2>(3.0),
            random.joints(2.0),
            random.joints(5.0),
        );
        let [y, z] = dual.handle(&along(&q, &qd));
        let velocity = robot.handle_velocity(&q, &qd);
        close(velocity[0], y.slope);
        close(velocity[1], z.slope);
        let [y, z] = dual.handle_velocity(&along(&q, &qd), &along(&qd, &qdd));
        let acceleration = robot.handle_acceleration(&q, &qd, &qdd);
        close(acceleration[0], y.slope);
        close(acceleration[1], z.slope);
        if Scalar::sin_cos(q[1]).0.abs() < 0.1 {
            continue; // Near the singular poses rounding grows.
        }
        // And back: angles move with the speeds that the handle's velocity needs.
        let point = robot.handle(&q);
        let moving = core::array::from_fn(|i| Dual::new(point[i], velocity[i]));
        let angles = dual.angles(moving).expect("within reach");
        let chosen = Joints::<f64, 2>::new(angles[0].value, angles[1].value);
        let speeds = robot.speeds(&chosen, velocity);
        for i in 0..2 {
            assert!((angles[i].slope - speeds[i]).abs() < 1e-10 * (1.0 + speeds.amax()));
        }
    }
}

#[test]
fn profiles_are_integrated_exactly() {
    let mut random = Random(66);
    for shape in [Shape::Trapezoid, Shape::Smooth] {
        for _ in 0..STATES {
            let (distance, speed) = (random.uniform(-2.0, 2.0), random.uniform(0.1, 1.0));
            let limits = Limits {
                speed,
                acceleration: 1.5,
            };
            let profile = Profile::new(shape, distance, limits).expect("valid");
            let of = Dual::of;
            let limits = Limits {
                speed: of(speed),
                acceleration: of(1.5),
            };
            let dual = Profile::new(shape, of(distance), limits).expect("valid");
            let time = random.uniform(-0.1, 1.1) * profile.duration();
            let (at, moving) = (profile.at(time), dual.at(Dual::new(time, 1.0)));
            close(at.velocity, moving.position.slope);
            close(at.acceleration, moving.velocity.slope);
        }
    }
}
