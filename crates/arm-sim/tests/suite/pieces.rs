//! A run that is given away a piece after another: the bits of the whole, in memory that does not grow.

use std::ops::ControlFlow;

use arm_core::{Elbow, Robot};
use arm_sim::{
    Engine, Experiment, Integrator, Piece, Recording, SimulationError, definite, digest,
    sample_experiments, simulate_in_pieces, simulate_with,
};

/// Everything recorded, piece by piece, put together again.
fn together<const N: usize>(
    engine: Engine,
    experiment: &Experiment<N>,
    samples: usize,
) -> Recording<N> {
    let (mut all, mut error, mut lengths) = (Recording::default(), Vec::new(), Vec::new());
    simulate_in_pieces(engine, experiment, samples, &mut |piece| {
        let r = piece.recording;
        assert_eq!(piece.from, all.len());
        lengths.push(r.len());
        error.extend(piece.energy_error());
        let columns: [(&mut Vec<f64>, &Vec<f64>); 28] = [
            (&mut all.time, &r.time),
            (&mut all.q, &r.q),
            (&mut all.qd, &r.qd),
            (&mut all.qdd, &r.qdd),
            (&mut all.tip, &r.tip),
            (&mut all.handle, &r.handle),
            (&mut all.robot_q, &r.robot_q),
            (&mut all.robot_qd, &r.robot_qd),
            (&mut all.robot_qdd, &r.robot_qdd),
            (&mut all.force_on_arm, &r.force_on_arm),
            (&mut all.moment_on_arm, &r.moment_on_arm),
            (&mut all.torque.inertial, &r.torque.inertial),
            (&mut all.torque.centrifugal, &r.torque.centrifugal),
            (&mut all.torque.coriolis, &r.torque.coriolis),
            (&mut all.torque.gravity, &r.torque.gravity),
            (&mut all.torque.frame, &r.torque.frame),
            (&mut all.torque.resisting, &r.torque.resisting),
            (&mut all.torque.drive, &r.torque.drive),
            (&mut all.torque.contact, &r.torque.contact),
            (&mut all.resisting, &r.resisting),
            (&mut all.memory, &r.memory),
            (&mut all.energy.kinetic, &r.energy.kinetic),
            (&mut all.energy.potential, &r.energy.potential),
            (&mut all.energy.contact, &r.energy.contact),
            (&mut all.work.handle, &r.work.handle),
            (&mut all.work.drive, &r.work.drive),
            (&mut all.work.resisted, &r.work.resisted),
            (&mut all.work.damped, &r.work.damped),
        ];
        for (whole, part) in columns {
            whole.extend(part);
        }
        all.effects.clone_from(&r.effects);
        ControlFlow::Continue(())
    })
    .expect("the experiment runs");
    let (last, full) = lengths.split_last().expect("a piece");
    assert!(full.iter().all(|&n| n == samples) && (1..=samples).contains(last));
    assert_eq!(error, all.energy_error());
    all
}

#[test]
fn pieces_have_the_bits_of_the_whole() {
    let mut experiment = sample_experiments::reference().expect("a sample experiment");
    experiment.duration = 0.5;
    for integrator in [
        Integrator::Rk4,
        Integrator::SemiImplicitEuler,
        Integrator::Imex,
    ] {
        experiment.integrator = integrator;
        let whole = simulate_with(Engine::Native, &experiment).expect("the experiment runs");
        for samples in [1, 7, whole.len(), 1000] {
            let found = together(Engine::Native, &experiment, samples);
            assert_eq!(
                digest(&found),
                digest(&whole),
                "{integrator:?}, {samples} in a piece"
            );
            assert_eq!(found, whole);
        }
    }
}

#[cfg(feature = "rapier")]
#[test]
fn pieces_of_the_second_engine_too() {
    let experiment =
        sample_experiments::mechanical_experiment(1.0, [0.0; 2]).expect("a sample experiment");
    let whole = simulate_with(Engine::Rapier, &experiment).expect("the experiment runs");
    assert_eq!(together(Engine::Rapier, &experiment, 300), whole);
}

#[test]
fn a_run_is_broken_off_where_nobody_wants_more() {
    let experiment =
        sample_experiments::mechanical_experiment(1.0, [0.0; 2]).expect("a sample experiment");
    let mut seen = 0;
    let done = simulate_in_pieces(Engine::Native, &experiment, 10, &mut |piece| {
        seen += piece.recording.len();
        if seen < 30 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    assert_eq!((done, seen), (Ok(()), 30));
}

#[test]
fn what_the_robot_does_not_reach_is_refused_before_the_first_piece() {
    let mut experiment = sample_experiments::reference().expect("a sample experiment");
    experiment.effects.clear();
    experiment.robot = Some(Robot::new([0.2, 0.2], [1.05, -0.1], Elbow::Up).expect("a robot"));
    let refused = simulate_in_pieces(Engine::Native, &experiment, 10, &mut |_| panic!("a piece"));
    assert!(
        matches!(refused, Err(SimulationError::Unreachable { .. })),
        "{refused:?}"
    );
}

#[test]
fn what_is_not_a_number_is_named_by_its_place_in_the_run() {
    let mut experiment =
        sample_experiments::mechanical_experiment(1.0, [0.0; 2]).expect("a sample experiment");
    experiment.output_interval = None;
    let mut refused = None;
    simulate_in_pieces(Engine::Native, &experiment, 50, &mut |piece| {
        if piece.from == 100 {
            let mut spoilt = piece.recording.clone();
            spoilt.tip[2 * 7] = f64::NAN;
            let mut piece = Piece::from(&spoilt);
            piece.from = 100;
            refused = definite(&piece).err();
        }
        ControlFlow::Continue(())
    })
    .expect("the experiment runs");
    assert_eq!(
        refused,
        Some(SimulationError::Samples {
            name: "tip",
            sample: 108,
            problem: "not a number, which has no definite bits"
        })
    );
}

#[test]
fn memory_does_not_grow_with_the_run() {
    let most = |duration: f64| {
        let mut experiment = sample_experiments::reference().expect("a sample experiment");
        experiment.duration = duration;
        experiment.output_interval = None;
        let used = allocation_counter::measure(|| {
            let mut samples = 0;
            simulate_in_pieces(Engine::Native, &experiment, 100, &mut |piece| {
                samples += piece.recording.len();
                ControlFlow::Continue(())
            })
            .expect("the experiment runs");
            assert!(samples as f64 * experiment.dt > duration);
        });
        used.bytes_max
    };
    assert_eq!(most(0.1), most(2.0));
}
