//! Steps that take the friction of joints implicitly.

use std::cell::RefCell;

use arm_core::effect::{Effect, Kind};
use arm_core::{Joints, Pose, tip};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, ImplicitFriction, Integrator, Normal, SimulationError,
    SmoothFriction, Start, simulate, simulate_batch,
};
use nalgebra::SMatrix;

use crate::common::{largest, most, run, several_effects, smooth};

/// The human arm on a soft contact, recorded every 4 ms.
fn led(effects: &[Effect<f64>]) -> Experiment<3> {
    let mut experiment = smooth(2.0);
    experiment.setup.contact.stiffness = [3000.0; 2];
    experiment.output_interval = Some(4e-3);
    experiment.effects.extend_from_slice(effects);
    experiment
}

/// Largest error of angles \[rad\] and forces \[N\] of a step, against Rk4 at 2⁻⁸ of 2 ms.
fn errors(experiment: &Experiment<3>, (integrator, dt): (Integrator, f64)) -> [f64; 2] {
    let mut fine = experiment.clone();
    fine.dt = 2e-3 / 256.0;
    let (fine, coarse) = (run(&fine), run(&with(experiment, integrator, dt)));
    [
        largest(&coarse.q, &fine.q),
        largest(&coarse.force_on_arm, &fine.force_on_arm),
    ]
}

fn with(experiment: &Experiment<3>, integrator: Integrator, dt: f64) -> Experiment<3> {
    Experiment {
        integrator,
        dt,
        ..experiment.clone()
    }
}

#[test]
fn it_is_of_second_order_with_memory_base_motion_and_friction() {
    let experiment = led(&several_effects());
    let [coarse, fine] = [1e-3, 0.5e-3].map(|dt| errors(&experiment, (Integrator::Imex, dt)));
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        let order = libm::log2(coarse / fine);
        assert!((order - 2.0).abs() < 0.3, "order {order}");
    }
}

/// A friction of 0.16 N m makes the wrist lose its speed at 0.003 rad/s in 6 µs.
#[test]
fn smooth_friction_may_be_as_steep_as_it_likes() {
    let steep = led(&[
        Effect::new(Kind::Coulomb, 2).with(&[0.16, 0.003]),
        Effect::new(Kind::Coulomb, 0).with(&[0.5, 0.003]),
    ]);
    let [angle, force] = errors(&steep, (Integrator::Imex, 2e-3));
    assert!(angle < 1e-4 && force < 0.05, "{angle:e} rad, {force:e} N");
    let [finer, _] = errors(&steep, (Integrator::Imex, 1e-3));
    assert!(finer < 0.3 * angle, "{angle:e} rad, {finer:e} rad");
    let [angle, _] = errors(&steep, (Integrator::Rk4, 1e-3));
    assert!(angle > 1e-2, "{angle:e} rad");
    let lost = |dt| most(run(&with(&steep, Integrator::Imex, dt)).energy_error());
    let (coarse, fine) = (lost(2e-3), lost(1e-3));
    assert!(
        coarse < 3e-4 && fine < 0.3 * coarse,
        "{coarse:e} J, {fine:e} J"
    );
}

#[test]
fn viscosity_may_be_as_large_as_it_likes() {
    let viscous = led(&[Effect::new(Kind::Viscous, 2).with(&[5.0])]);
    let [angle, force] = errors(&viscous, (Integrator::Imex, 2e-3));
    assert!(angle < 1e-4 && force < 0.05, "{angle:e} rad, {force:e} N");
    assert!(simulate(&with(&viscous, Integrator::Rk4, 2e-3)).is_err());
}

/// Beside smooth friction, with friction that grows with the joint force, and with friction that falls with speed.
#[test]
fn set_valued_friction_sticks_and_slips_as_where_switches_are_located() {
    let wrist = Effect::new(Kind::Coulomb, 2).with(&[0.16, 0.0]);
    for other in [
        Effect::new(Kind::Coulomb, 0).with(&[0.5, 0.05]),
        Effect::new(Kind::LoadFriction, 1).with(&[0.01, 0.0]),
        Effect::new(Kind::Stribeck, 1).with(&[0.1, 0.1, 0.0]),
    ] {
        let experiment = led(&[wrist, other]);
        let [angle, force] = errors(&experiment, (Integrator::Imex, 1e-3));
        assert!(
            angle < 3e-5 && force < 0.02,
            "{other:?} {angle:e} {force:e}"
        );
        let coarse = run(&with(&experiment, Integrator::Imex, 1e-3));
        let resting = coarse.qd.iter().skip(2).step_by(3);
        assert!(resting.filter(|&&speed| speed == 0.0).count() > 20);
    }
}

#[test]
fn a_rigid_coupling_and_a_contact_too_stiff_are_refused() {
    let mut rigid = with(&led(&[]), Integrator::Imex, 1e-3);
    let mut stiff = rigid.clone();
    if let Drive::Handle { coupling, .. } = &mut rigid.drive {
        *coupling = Coupling::Rigid;
    }
    let said = simulate(&rigid).expect_err("refused").to_string();
    assert_eq!(
        said,
        "the native engine cannot simulate a rigid coupling with the integrator imex, allowed are rk4 and euler"
    );
    stiff.setup.contact.stiffness = [1e7; 2];
    let Err(SimulationError::TooStiff { largest, .. }) = simulate(&stiff) else {
        panic!("not refused");
    };
    stiff.dt = 4e-3 / libm::ceil(4e-3 / largest);
    assert!(simulate(&stiff).is_ok());
}

/// A contact that is damped in one direction only, in poses in which a tip yields in none of both alone: with the longest step that is
/// allowed, no vibration grows.
#[test]
fn the_longest_step_of_a_contact_damped_one_way_is_stable() {
    for (k, pose) in [[-0.1, 1.3, 0.3], [-1.1, 0.9, 0.1], [-0.6, 1.6, -0.4]]
        .into_iter()
        .enumerate()
    {
        let mut held = with(&led(&[]), Integrator::Imex, 4e-3 / (k + 1) as f64);
        let setup = &mut held.setup;
        (setup.contact.stiffness, setup.contact.damping) = ([3e5; 2], [2.0, 300.0]);
        setup.gravity = [0.0; 2];
        let at = tip(
            &setup.chain().expect("an arm"),
            &Pose::new(&Joints::from(pose)),
        );
        held.drive = Drive::Handle {
            path: HandlePath::fixed(at).expect("a point"),
            coupling: Coupling::Compliant,
        };
        held.start = Start::Given {
            q: pose.into(),
            qd: [0.0, 0.0, 0.1].into(),
        };
        (held.effects, held.output_interval, held.duration) = (Vec::new(), None, 10.0);
        held.dt = 0.1;
        let Err(SimulationError::TooStiff { largest, .. }) = simulate(&held) else {
            panic!("not refused");
        };
        held.dt = 10.0 / libm::ceil(10.0 / (0.999 * largest));
        assert!(most(run(&held).force_on_arm) < 1e3);
    }
}

#[test]
fn runs_in_a_batch_have_the_bits_of_single_ones() {
    let experiment = with(&led(&several_effects()), Integrator::Imex, 1e-3);
    let alone = run(&experiment);
    for beside in simulate_batch(&vec![experiment; 5], 2) {
        assert_eq!(beside.expect("runs").q, alone.q);
    }
}

/// Every combination of torques, speeds and friction on a small grid obeys the law.
#[test]
fn friction_obeys_its_law_at_the_end_of_a_step() {
    let reach = 0.005;
    let slope = SMatrix::<f64, 2, 2>::new(0.3, 0.08, 0.08, 0.05);
    let smoothly = |joint, most, smoothing| SmoothFriction {
        joint,
        most,
        smoothing,
    };
    let (steep, flat) = (smoothly(0, 0.15, 1e-4), smoothly(1, 0.2, 0.03));
    let grid = [-0.4, -0.05, 0.0, 0.07, 0.3];
    let mut seen = [0; 2];
    for a in grid {
        for b in grid {
            for set_valued in [[0.1, 0.1], [0.2, 0.0], [0.02, 0.3], [0.0; 2]] {
                for smooth in [&[][..], &[steep], &[flat], &[steep, flat]] {
                    let set_valued = Joints::from(set_valued);
                    let friction = ImplicitFriction { set_valued, smooth };
                    let (from, pulling) = ([b * 0.01, -a * 0.01].into(), [a, b].into());
                    let near = [-b, a].into();
                    let end = friction.solve(&(slope / reach), (&from, &pulling), &near);
                    let end = end.expect("a mass matrix has an inverse");
                    let left: Joints<f64, 2> = pulling - slope / reach * (end.speed - from);
                    let rubbing = SmoothFriction::sum(smooth, &end.speed).0;
                    assert!(end.exact);
                    for j in 0..2 {
                        let (speed, held) = (end.speed[j], left[j] - rubbing[j]);
                        let slips = speed != 0.0;
                        seen[usize::from(slips)] += 1;
                        assert!((held - end.set_valued[j]).abs() < 1e-8, "{held} {end:?}");
                        assert!(held.abs() <= set_valued[j] + 1e-8, "{held} {end:?}");
                        if slips {
                            let expected = set_valued[j] * speed.signum();
                            assert!((held - expected).abs() < 1e-8, "{held} {end:?}");
                        }
                    }
                }
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 50), "{seen:?}");
}

/// Light wrists on heavy arms, frictions and smoothings over decades, starts anywhere.
#[test]
fn friction_is_solved_from_any_start() {
    let random = RefCell::new(Normal::new(7, 0));
    let size = |least: f64, most: f64| {
        let share = 0.5 * (1.0 + libm::erf(random.borrow_mut().next() / core::f64::consts::SQRT_2));
        least * libm::pow(most / least, share)
    };
    let mut unsolved = 0;
    for _ in 0..100_000 {
        let root = SMatrix::<f64, 3, 3>::from_fn(|row, column| {
            let sign = if size(1.0, 4.0) > 2.0 { 1.0 } else { -1.0 };
            sign * size(0.03, 1.0) * [0.5, 0.2, 0.03][row] * [1.0, 0.8, 0.3][column]
        });
        let mass = root * root.transpose() + SMatrix::from_diagonal_element(1e-5);
        let signed = |least, most| {
            if size(1.0, 4.0) > 2.0 {
                size(least, most)
            } else {
                -size(least, most)
            }
        };
        let [from, near, pulling] = [(1e-3, 3.0), (1e-3, 3.0), (1e-3, 1.0)]
            .map(|(least, most)| Joints::<f64, 3>::from_fn(|_, _| signed(least, most)));
        let smooth: Vec<SmoothFriction> = (0..3)
            .filter(|_| size(1.0, 4.0) > 2.0)
            .map(|joint| SmoothFriction {
                joint,
                most: size(0.01, 1.0),
                smoothing: size(1e-4, 0.1),
            })
            .collect();
        let set_valued = Joints::from_fn(|_, _| {
            if size(1.0, 4.0) > 2.0 {
                size(0.01, 1.0)
            } else {
                0.0
            }
        });
        let friction = ImplicitFriction {
            set_valued,
            smooth: &smooth,
        };
        let end = friction
            .solve(&(mass / 5e-4), (&from, &pulling), &near)
            .expect("a mass");
        unsolved += usize::from(!end.exact);
    }
    assert_eq!(unsolved, 0);
}
