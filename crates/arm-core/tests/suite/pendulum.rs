//! Limits with arithmetic in the head: one segment, and straight arms, with g = 10.

use arm_core::{
    Chain, Joints, Load, Pose, Segment, coriolis, forward_dynamics, gravity, inertia,
    inverse_dynamics, joint_force, kinetic_energy, potential_energy, static_torque, tip,
};

const UP: f64 = core::f64::consts::FRAC_PI_2;

/// A point mass of 1 kg on a weightless rod of 1 m.
fn pendulum() -> Chain<f64, 1> {
    let segment = Segment {
        length: 1.0,
        mass: 1.0,
        com: [1.0, 0.0],
        inertia: 0.0,
    };
    Chain::new([segment], [0.0, 0.0], [0.0, -10.0]).expect("valid")
}

fn at(q: f64) -> Pose<f64, 1> {
    Pose::new(&Joints::<f64, 1>::new(q))
}
fn one(value: f64) -> Joints<f64, 1> {
    Joints::<f64, 1>::new(value)
}

#[test]
fn eleven_ten_one_minus_ten() {
    let arm = pendulum();
    let torque = |qdd: f64| inverse_dynamics(&arm, &at(0.0), &one(0.0), &one(qdd))[0];
    assert_eq!((torque(1.0), torque(0.0)), (11.0, 10.0));
    let accelerated = |torque: f64| {
        let load = Load {
            torque: one(torque),
            ..Load::none()
        };
        forward_dynamics(&arm, &at(0.0), &one(0.0), &load)[0]
    };
    assert_eq!((accelerated(11.0), accelerated(0.0)), (1.0, -10.0));
}

#[test]
fn hanging_and_standing() {
    let arm = pendulum();
    for q in [UP, -UP] {
        assert!(gravity(&arm, &at(q))[0].abs() < 1e-14);
    }
    assert!((potential_energy(&arm, &at(UP)) - 10.0).abs() < 1e-14);
    assert_eq!(potential_energy(&arm, &at(0.0)), 0.0);
    assert_eq!(kinetic_energy(&arm, &at(0.3), &one(2.0)), 2.0);
    assert_eq!(inertia(&arm, &at(0.3))[(0, 0)], 1.0);
    assert_eq!(coriolis(&arm, &at(0.3), &one(5.0))[0], 0.0);
}

#[test]
fn forces_in_the_head() {
    let arm = pendulum();
    // 3 N up at 1 m: 3 N m; with a moment of 1 N m: 4 N m. A pull along the rod: nothing.
    assert_eq!(static_torque(&arm, &at(0.0), [7.0, 3.0], 1.0)[0], 4.0);
    // At rest the joint carries the weight, turning at 2 rad/s also 4 N towards itself.
    let carried = |qd: f64| joint_force(&arm, &at(0.0), (&one(qd), &one(0.0)), [0.0; 2])[0];
    assert_eq!(carried(0.0), [0.0, 10.0]);
    assert_eq!(carried(2.0), [-4.0, 10.0]);
    // A force on the arm at the tip is passed on.
    let held = joint_force(&arm, &at(0.0), (&one(0.0), &one(0.0)), [1.0, 10.0])[0];
    assert_eq!(held, [-1.0, 0.0]);
}

#[test]
fn three_segments_in_a_row() {
    let segment = Segment {
        length: 1.0,
        mass: 1.0,
        com: [1.0, 0.0],
        inertia: 0.0,
    };
    let arm = Chain::new([segment; 3], [2.0, 5.0], [0.0, -10.0]).expect("valid");
    let pose = Pose::new(&Joints::<f64, 3>::zeros());
    assert_eq!(tip(&arm, &pose), [5.0, 5.0]);
    // 1 kg at 1, 2 and 3 m of the shoulder; at 1 and 2 m of the elbow; at 1 m of the wrist.
    assert_eq!(
        gravity(&arm, &pose),
        Joints::<f64, 3>::new(60.0, 30.0, 10.0)
    );
    let b = inertia(&arm, &pose);
    assert_eq!((b[(0, 0)], b[(1, 1)], b[(2, 2)]), (14.0, 5.0, 1.0));
    assert_eq!((b[(0, 1)], b[(0, 2)], b[(1, 2)]), (8.0, 3.0, 2.0));
    // Released, every mass falls freely: the first link turns with −10 rad/s², the others stay level.
    let qdd = forward_dynamics(&arm, &pose, &Joints::zeros(), &Load::none());
    assert!(
        (qdd - Joints::<f64, 3>::new(-10.0, 10.0, 0.0)).amax() < 1e-12,
        "{qdd}"
    );
}

#[test]
fn a_chain_without_joints_is_allowed() {
    let arm = Chain::<f64, 0>::new([], [1.0, 2.0], [0.0, -10.0]).expect("valid");
    let pose = Pose::new(&Joints::<f64, 0>::zeros());
    assert_eq!(tip(&arm, &pose), [1.0, 2.0]);
    assert_eq!(static_torque(&arm, &pose, [1.0, 1.0], 1.0).len(), 0);
    assert_eq!(
        forward_dynamics(&arm, &pose, &Joints::zeros(), &Load::none()).len(),
        0
    );
}
