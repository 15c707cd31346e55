//! The native engine a piece at a time: the same bits, states to come back to, and the energy that a port hands over.

use arm_core::effect::{Effect, Kind};
use arm_core::{Joints, Pose, gravity, jacobian, sample_arms as arms, tip};
use arm_sim::{
    Coupling, Drive, Experiment, HandlePath, Outside, Port, SimulationError, Start, Stepper,
    sample_experiments, simulate,
};

const DT: f64 = 0.25e-3;
/// Error of the fourth-order integrator over these runs \[J\].
const ENERGY: f64 = 1e-6;

/// The rig with effects of every kind that a run computes differently.
fn rig() -> Experiment<3> {
    let mut experiment = sample_experiments::reference().unwrap();
    experiment.duration = 0.6;
    experiment.output_interval = None;
    // One with several states.
    let reflex = Effect::new(Kind::StretchReflex, 1).with(&[0.3, 0.2, 0.0, 0.04]);
    experiment.effects.push(reflex);
    experiment
}

fn start() -> (Joints<f64, 3>, Joints<f64, 3>) {
    ([-1.1, 0.8, 0.1].into(), [0.2, -0.3, 0.5].into())
}

fn stepper(experiment: &Experiment<3>, port: Port) -> Stepper<3> {
    let mut arm = Stepper::new(&experiment.setup, &experiment.effects, port, DT).unwrap();
    let (q, qd) = start();
    arm.start(q, qd, 0.0).unwrap();
    arm
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn both_ports_have_the_bits_of_a_run() {
    let mut experiment = rig();
    let (q, qd) = start();
    let point = [0.35, -0.30];
    experiment.start = Start::Given { q, qd };
    let held = Drive::Handle {
        path: HandlePath::fixed(point).unwrap(),
        coupling: Coupling::Compliant,
    };
    for (port, drive) in [(Port::Force, Drive::Torque(None)), (Port::Motion, held)] {
        experiment.drive = drive;
        let run = simulate(&experiment).unwrap();
        let last = run.len() - 1;
        let outside = Outside {
            position: point,
            ..Outside::default()
        };
        for inner in [1_u32, 4, 400] {
            let mut arm = stepper(&experiment, port);
            for _ in 0..2400 / inner {
                arm.advance(&outside, f64::from(inner) * DT).unwrap();
            }
            let end = arm.snapshot();
            assert_eq!(bits(end.q.as_slice()), bits(&run.q[3 * last..]));
            assert_eq!(bits(end.qd.as_slice()), bits(&run.qd[3 * last..]));
            let states = end.memory.iter().zip(&run.effects);
            let states: Vec<f64> = states
                .flat_map(|(own, (kind, _))| own[..kind.info().states.max(1)].to_vec())
                .collect();
            assert_eq!(states, run.memory[run.memories() * last..]);
            assert_eq!(end.work[2], run.work.resisted[last]);
            assert_eq!(arm.time(), run.time[last]);
            let energy = arm.energy(&outside);
            assert_eq!(energy[0], run.energy.kinetic[last]);
            assert_eq!(energy[2], run.energy.contact[last]);
        }
    }
}

#[test]
fn going_back_and_again_gives_the_same_bits() {
    for port in [Port::Force, Port::Motion] {
        let mut arm = stepper(&rig(), port);
        let outside = Outside {
            force_on_arm: [3.0, -2.0],
            position: [0.35, -0.30],
            velocity: [0.05, 0.02],
            ..Outside::default()
        };
        arm.advance(&outside, 0.05).unwrap();
        let middle = arm.snapshot();
        arm.advance(&outside, 0.05).unwrap();
        let end = arm.snapshot();
        arm.advance(&outside, 1.0 / 60.0).unwrap();
        arm.restore(&middle);
        arm.advance(&outside, 0.05).unwrap();
        assert_eq!(arm.snapshot(), end);
    }
}

#[test]
fn an_uneven_step_is_made_of_equal_parts() {
    let mut arm = stepper(&rig(), Port::Force);
    for _ in 0..60 {
        arm.advance(&Outside::default(), 1.0 / 60.0).unwrap();
    }
    assert!((arm.time() - 1.0).abs() < 1e-14);
    let mut other = stepper(&rig(), Port::Force);
    other.advance(&Outside::default(), 1.0).unwrap();
    // Both are within the error of the integrator.
    assert!((arm.q() - other.q()).amax() < 1e-7);
}

#[test]
fn a_handle_moves_on_within_a_step_and_from_step_to_step() {
    let mut whole = stepper(&rig(), Port::Motion);
    let mut parts = whole.clone();
    let mut outside = Outside {
        position: [0.35, -0.30],
        velocity: [0.1, -0.05],
        ..Outside::default()
    };
    whole.advance(&outside, 0.02).unwrap();
    for _ in 0..20 {
        parts.advance(&outside, 1e-3).unwrap();
        outside.age += 1e-3;
    }
    assert!((whole.q() - parts.q()).amax() < 1e-14);
    assert!((outside.age - 0.02).abs() < 1e-15);
}

#[test]
fn inputs_with_rates_go_on_within_a_step() {
    let (mut whole, mut parts) = (stepper(&rig(), Port::Force), stepper(&rig(), Port::Force));
    let ramp = Outside {
        force_on_arm: [4.0, -2.0],
        force_rate: [300.0, 150.0],
        torque: [0.1, 0.2, -0.1].into(),
        torque_rate: [5.0, -3.0, 1.0].into(),
        ..Outside::default()
    };
    whole.advance(&ramp, 80.0 * DT).unwrap();
    for k in 0..80 {
        let (middle, since) = ((f64::from(k) + 0.5) * DT, f64::from(k) * DT);
        let now = Outside {
            force_on_arm: [0, 1].map(|i| ramp.force_on_arm[i] + ramp.force_rate[i] * middle),
            force_rate: [0.0; 2],
            torque_age: since,
            ..ramp
        };
        parts.advance(&now, DT).unwrap();
    }
    assert!((whole.q() - parts.q()).amax() < 1e-13);

    let mut handle = stepper(&rig(), Port::Motion);
    let mut held = handle.clone();
    let moving = Outside {
        position: [0.35, -0.30],
        acceleration: [2.0, -1.0],
        ..Outside::default()
    };
    handle.advance(&moving, 80.0 * DT).unwrap();
    for k in 0..80 {
        // The same parabola, a piece at a time.
        let since = f64::from(k) * DT;
        let [y, z] = [0, 1].map(|i| {
            let (r, a) = (moving.position[i], moving.acceleration[i]);
            (r + 0.5 * a * since * since, a * since)
        });
        let now = Outside {
            position: [y.0, z.0],
            velocity: [y.1, z.1],
            ..moving
        };
        held.advance(&now, DT).unwrap();
    }
    assert!((handle.q() - held.q()).amax() < 1e-12);
}

#[test]
fn the_work_of_a_port_is_the_energy_the_arm_gains() {
    let arm = arms::human_arm();
    let setup = arm_core::Setup::new(&arm, arm_core::Contact::new([2000.0; 2], [20.0; 2]));
    for port in [Port::Force, Port::Motion] {
        let viscous = [Effect::new(Kind::Viscous, 1).with(&[0.3])];
        let mut stepper = Stepper::new(&setup, &viscous, port, DT).unwrap();
        let (q, qd) = start();
        stepper.start(q, qd, 0.0).unwrap();
        let mut outside = Outside {
            force_on_arm: [4.0, 9.0],
            position: tip(&arm, &Pose::new(&q)),
            velocity: [0.1, 0.05],
            ..Outside::default()
        };
        let before: f64 = stepper.energy(&outside).iter().sum();
        for _ in 0..50 {
            stepper.advance(&outside, 0.01).unwrap();
            outside.age += 0.01;
        }
        let gained = stepper.energy(&outside).iter().sum::<f64>() - before;
        let [port_work, drive, resisted, damped] = *stepper.work();
        assert!(port_work.abs() > 0.1);
        assert!((gained - (port_work + drive - resisted - damped)).abs() < ENERGY);
    }
}

#[test]
fn the_force_that_holds_the_arm_is_that_of_statics() {
    let arm = arms::mechanical_arm();
    let setup = arm_core::Setup::new(&arm, arm_core::Contact::new([1e4; 2], [25.0; 2]));
    let q = Joints::<f64, 2>::from([-1.0, 1.2]);
    let pose = Pose::new(&q);
    let (j, g) = (jacobian(&arm, &pose), gravity(&arm, &pose));
    // F = J⁻ᵀ G by Cramer's rule.
    let det = j[(0, 0)] * j[(1, 1)] - j[(0, 1)] * j[(1, 0)];
    let force = [
        (g[0] * j[(1, 1)] - g[1] * j[(1, 0)]) / det,
        (j[(0, 0)] * g[1] - j[(0, 1)] * g[0]) / det,
    ];
    let mut held = Stepper::new(&setup, &[], Port::Force, DT).unwrap();
    held.start(q, Joints::zeros(), 0.0).unwrap();
    let outside = Outside {
        force_on_arm: force,
        ..Outside::default()
    };
    assert!(held.seen(&outside).qdd.amax() < 1e-9);

    let outside = Outside {
        position: tip(&arm, &pose),
        ..Outside::default()
    };
    // Tight, and through play in which nothing holds the arm where the search begins.
    let play = Effect::new(Kind::named("backlash").unwrap(), 0).with(&[2e-3, 2e-3]);
    for effects in [&[][..], &[play]] {
        let mut sprung = Stepper::new(&setup, effects, Port::Motion, DT).unwrap();
        let rest = sprung.equilibrium(&outside, &q).unwrap();
        sprung.start(rest, Joints::zeros(), 0.0).unwrap();
        let pulled = sprung.seen(&outside).force_on_arm;
        let pose = Pose::new(&rest);
        let torque = arm_core::static_torque(&arm, &pose, pulled, 0.0);
        assert!((torque - gravity(&arm, &pose)).amax() < 1e-9);
    }
}

#[test]
fn a_refused_or_failed_step_leaves_no_trace() {
    let mut arm = stepper(&rig(), Port::Force);
    let before = arm.snapshot();
    for duration in [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e9] {
        let refused = arm.advance(&Outside::default(), duration);
        assert!(
            matches!(refused, Err(SimulationError::Setting { .. })),
            "{duration}"
        );
        assert_eq!(arm.snapshot(), before);
    }
    let absurd = Outside {
        force_on_arm: [1e300, 1e300],
        ..Outside::default()
    };
    let failed = arm.advance(&absurd, 0.1);
    assert!(matches!(failed, Err(SimulationError::Diverged { .. })));
    assert_eq!(arm.snapshot(), before);
}

#[test]
fn a_contact_too_stiff_for_the_inner_step_is_refused() {
    let mut experiment = rig();
    experiment.setup.contact.stiffness = [1e9; 2];
    let mut arm = Stepper::new(&experiment.setup, &[], Port::Motion, DT).unwrap();
    let (q, qd) = start();
    let refused = arm.start(q, qd, 0.0);
    assert!(matches!(refused, Err(SimulationError::TooStiff { .. })));
}

#[test]
fn advancing_does_not_allocate() {
    let mut arm = stepper(&rig(), Port::Motion);
    let outside = Outside {
        position: [0.35, -0.30],
        ..Outside::default()
    };
    let counted = allocation_counter::measure(|| {
        for _ in 0..10 {
            arm.advance(&outside, 1e-3).unwrap();
            arm.tip(&outside);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn rates_are_those_of_the_values() {
    let experiment = rig();
    for port in [Port::Force, Port::Motion] {
        let mut arm = stepper(&experiment, port);
        let mut outside = Outside {
            force_on_arm: [4.0, 9.0],
            position: [0.36, -0.31],
            velocity: [0.1, 0.05],
            ..Outside::default()
        };
        // Away from the first instant, at which memories and contact are not yet in step.
        arm.advance(&outside, 0.1).unwrap();
        outside.age = 0.1;
        let (before, energy) = (arm.clone().seen(&outside), *arm.work());
        // A forward difference is off by half a step times the second derivative.
        let h = 1e-7;
        let mut later = arm.clone();
        later.advance(&outside, h).unwrap();
        let (qd, q) = (later.qd() - arm.qd(), later.q() - arm.q());
        outside.age += h;
        let after = later.seen(&outside);
        assert!((q / h - arm.qd()).amax() < h * before.qdd.amax());
        assert!((qd / h - before.qdd).amax() < 1e-2 * before.qdd.amax());
        for axis in 0..2 {
            let rate = (after.tip_velocity[axis] - before.tip_velocity[axis]) / h;
            assert!((rate - before.tip_acceleration[axis]).abs() < 1e-2 * before.qdd.amax());
            let rate = (after.force_on_arm[axis] - before.force_on_arm[axis]) / h;
            assert!((rate - before.force_rate[axis]).abs() < 1e-2 * (1.0 + rate.abs()));
        }
        for k in 0..4 {
            let rate = (later.work()[k] - energy[k]) / h;
            assert!((rate - before.power[k]).abs() < 1e-4 * (1.0 + rate.abs()));
        }
    }
}
