//! The second engine against the native one: the same experiments from bodies and joints.
//!
//! Limits are about twice the differences measured, which `src/engines/rapier/mod.rs` lists.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Invalid, Pose, Segment, Setup, Shape, tip};
use arm_sim::{
    Coupling, Drive, Engine, Experiment, HandlePath, Interpolation, RapierSettings, Recording,
    Series, SimulationError, Start, digest, sample_experiments, simulate_rapier, simulate_with,
};

use crate::common::{largest, most, run, smooth};

/// Rest angles of the elastic joints, not those of the path \[rad\].
const REST: [f64; 3] = [-0.785, 0.6, 0.1];

fn rapier<const N: usize>(experiment: &Experiment<N>) -> Recording<N> {
    simulate_with(Engine::Rapier, experiment).expect("the experiment runs on rapier")
}

/// Largest difference of the engines at a step: angles \[rad\], speeds \[rad/s\] and forces on the arm \[N\].
///
/// The native engine runs at an eighth of the coarsest step here, where its own error is below 1e-9.
fn difference<const N: usize>(experiment: &Experiment<N>, dt: f64) -> [f64; 3] {
    let mut experiment = experiment.clone();
    experiment.output_interval = Some(0.01);
    experiment.dt = 6.25e-5;
    let native = run(&experiment);
    experiment.dt = dt;
    let other = rapier(&experiment);
    [
        largest(&native.q, &other.q),
        largest(&native.qd, &other.qd),
        largest(&native.force_on_arm, &other.force_on_arm),
    ]
}

/// An arm whose centres of mass are off its axes, under a gravity that is not upright.
fn bent_arm() -> Chain<f64, 3> {
    let segment = |length, mass, com, inertia| Segment {
        length,
        mass,
        com,
        inertia,
    };
    let segments = [
        segment(0.322, 2.114, [0.186, 0.020], 0.0155),
        segment(0.264, 1.264, [0.121, -0.010], 0.0055),
        segment(0.093, 0.753, [0.081, 0.015], 0.0060),
    ];
    Chain::new(segments, [0.3, -0.2], [0.5, -9.81]).expect("an arm")
}

/// The bent arm thrown from a moving start and left alone.
fn free_swing() -> Experiment<3> {
    let setup = Setup::new(&bent_arm(), Contact::new([0.0; 2], [0.0; 2]));
    let mut experiment = Experiment::new(setup, Drive::Torque(None), 2.0);
    experiment.start = Start::Given {
        q: [-0.7, 0.8, 0.3].into(),
        qd: [0.5, -1.0, 0.7].into(),
    };
    experiment
}

/// The human arm of table 4.10, let go with its hand in a handle that stands still.
fn falling() -> Experiment<3> {
    let arm = arm_core::sample_arms::human_arm();
    let q = [-1.1, 0.8, 0.1].into();
    let contact = Contact::new([sample_experiments::STIFFNESS; 2], [25.0; 2]);
    let path = HandlePath::fixed(tip(&arm, &Pose::new(&q))).expect("a point");
    let coupling = Coupling::Compliant;
    let drive = Drive::Handle { path, coupling };
    let mut experiment = Experiment::new(Setup::new(&arm, contact), drive, 1.0);
    experiment.start = Start::Given {
        q,
        qd: [0.0; 3].into(),
    };
    experiment.effects = (0..3)
        .map(|joint| Effect::new(Kind::Viscous, joint).with(&[0.2]))
        .collect();
    experiment
}

fn rigidly<const N: usize>(mut experiment: Experiment<N>) -> Experiment<N> {
    if let Drive::Handle { coupling, .. } = &mut experiment.drive {
        *coupling = Coupling::Rigid;
    }
    experiment
}

fn assert_below(found: [f64; 3], limits: [f64; 3]) {
    for ((what, found), limit) in ["q", "qd", "force"].iter().zip(found).zip(limits) {
        assert!(
            found < limit,
            "{what} differs by {found:e}, allowed is {limit:e}"
        );
    }
}

/// Exponent by which the difference of the angles falls from 0.5 ms to 0.25 ms.
fn order<const N: usize>(experiment: &Experiment<N>) -> f64 {
    let [coarse, fine] = [0.5e-3, 0.25e-3].map(|dt| difference(experiment, dt)[0]);
    libm::log2(coarse / fine)
}

#[test]
fn table_4_10_is_led_as_by_the_native_engine() {
    let experiment = sample_experiments::human_experiment(20.0, REST).expect("a sample experiment");
    assert_below(difference(&experiment, 0.25e-3), [2.5e-8, 2.5e-6, 8e-5]);
}

#[test]
fn table_4_9_is_led_as_by_the_native_engine() {
    let rest = [REST[0], REST[1]];
    let experiment =
        sample_experiments::mechanical_experiment(20.0, rest).expect("a sample experiment");
    assert_below(difference(&experiment, 0.25e-3), [1.2e-8, 2e-6, 2.5e-5]);
}

#[test]
fn a_free_swing_of_three_segments_agrees() {
    assert_below(difference(&free_swing(), 0.25e-3), [6e-5, 1e-3, 1e-12]);
}

#[test]
fn a_free_swing_of_two_segments_agrees() {
    let segments = [bent_arm().segments()[0], bent_arm().segments()[1]];
    let arm = Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("an arm");
    let setup = Setup::new(&arm, Contact::new([0.0; 2], [0.0; 2]));
    let mut experiment = Experiment::new(setup, Drive::Torque(None), 2.0);
    experiment.start = Start::Given {
        q: [-0.9, 0.6].into(),
        qd: [0.5, -1.0].into(),
    };
    assert_below(difference(&experiment, 0.25e-3), [1e-5, 1e-4, 1e-12]);
}

#[test]
fn halving_the_step_quarters_the_difference() {
    let free = order(&free_swing());
    assert!((free - 2.0).abs() < 0.1, "free swing: {free}");
    let led = order(&smooth(2.0));
    assert!((led - 2.0).abs() < 0.1, "led by a damped contact: {led}");
    let held = order(&rigidly(smooth(2.0)));
    assert!((held - 2.0).abs() < 0.1, "held rigidly: {held}");
}

#[test]
fn the_motion_obeys_the_equation_of_motion_of_the_core() {
    let mut experiment = smooth(2.0);
    experiment
        .effects
        .push(Effect::new(Kind::MotorInertia, 1).with(&[0.02]));
    let mut worst = || {
        let recording = rapier(&experiment);
        experiment.dt *= 0.5;
        let t = &recording.torque;
        most((0..recording.q.len()).map(|i| {
            let rigid = t.inertial[i] + t.centrifugal[i] + t.coriolis[i] + t.gravity[i];
            rigid + t.resisting[i] - t.drive[i] - t.contact[i]
        }))
    };
    // What is left over is the error of a step: no more sweeps make it smaller.
    let (coarse, fine) = (worst(), worst());
    assert!(
        fine < 0.6 * coarse && fine < 1e-5,
        "{coarse} and {fine} N m"
    );
}

#[test]
fn more_sweeps_do_not_change_the_result() {
    for experiment in [smooth(1.0), rigidly(smooth(1.0))] {
        let with = |sweeps| {
            simulate_rapier(&experiment, &RapierSettings { sweeps })
                .and_then(arm_sim::Partial::complete)
                .expect("the experiment runs on rapier")
        };
        let (few, many) = (with(RapierSettings::default().sweeps), with(300));
        let [q, force] = [(&few.q, &many.q), (&few.force_on_arm, &many.force_on_arm)]
            .map(|(few, many)| largest(few, many));
        // Against 7e-8 rad and 1e-4 N between the engines.
        assert!(q < 1e-9 && force < 1e-4, "{q:e} rad, {force:e} N");
    }
}

#[test]
fn rotors_in_every_joint_agree() {
    let mut experiment = free_swing();
    for (joint, inertia) in [0.1, 0.2, 0.3].into_iter().enumerate() {
        let rotor = Effect::new(Kind::MotorInertia, joint).with(&[inertia]);
        experiment.effects.push(rotor);
    }
    assert_below(difference(&experiment, 0.25e-3), [1e-5, 3e-5, 1e-12]);
}

#[test]
fn effects_with_states_and_over_two_joints_agree() {
    let mut experiment = free_swing();
    experiment.effects = vec![
        Effect::new(Kind::Viscous, 0).with(&[0.2]),
        Effect::new(Kind::Relaxation, 1).with(&[1.0, 0.5]),
        Effect::new(Kind::Thixotropy, 2).with(&[0.05, 0.1]),
        Effect::new(Kind::Biarticular, 2).with(&[0.5]),
        Effect::new(Kind::AddedMass, 0).with(&[0.3]),
    ];
    assert_below(difference(&experiment, 0.25e-3), [5e-5, 5e-4, 1e-12]);
    experiment.output_interval = Some(0.01);
    let memory = largest(&run(&experiment).memory, &rapier(&experiment).memory);
    assert!(memory < 5e-5, "states differ by {memory}");
}

#[test]
fn a_late_reflex_agrees() {
    let mut experiment = free_swing();
    let reflex = Effect::new(Kind::StretchReflex, 1).with(&[0.5, 0.5, 0.0, 0.04]);
    experiment.effects = vec![Effect::new(Kind::Viscous, 0).with(&[0.2]), reflex];
    assert_below(difference(&experiment, 0.25e-3), [5e-5, 5e-4, 1e-12]);
}

/// Friction under load changes the force that makes it: both engines must find the same balance, also where it is strong.
#[test]
fn friction_under_load_agrees() {
    for coefficient in [0.003, 0.02] {
        let mut experiment = free_swing();
        let friction = Effect::new(Kind::LoadFriction, 1).with(&[coefficient, 0.1]);
        experiment.effects.push(friction);
        let [angles, ..] = difference(&experiment, 0.125e-3);
        println!("load friction {coefficient} m: {angles} rad");
        assert!(angles < 2e-4, "{coefficient} m: {angles} rad");
    }
}

#[test]
fn motors_drive_the_joints_alike() {
    let (times, torques) = ([0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 1.0, 3.0, 2.0, 0.0]);
    let torques = torques.map(|t| [t, 0.5 * t, 0.05 * t]);
    let series = Series::new("torque", &times, &torques, Interpolation::Cubic);
    let mut experiment = free_swing();
    experiment.duration = 1.0;
    experiment.drive = Drive::Torque(Some(series.expect("a series")));
    assert_below(difference(&experiment, 0.25e-3), [2e-5, 2.5e-4, 1e-12]);
}

#[test]
fn a_rigid_coupling_agrees_in_angles_and_force() {
    // Forces at samples where the jerk of the handle jumps are means over a step, hence the wider limit.
    assert_below(
        difference(&rigidly(smooth(4.0)), 0.25e-3),
        [7e-8, 2e-6, 6e-3],
    );
    let arm = arm_core::sample_arms::mechanical_arm();
    let path = ([-60.0, 50.0], [-40.0, 80.0]);
    let two = sample_experiments::led(arm, Shape::Smooth, path, 4.0, [0.0; 2])
        .expect("a sample experiment");
    assert_below(difference(&rigidly(two), 0.25e-3), [3e-8, 1e-6, 4e-3]);
}

#[test]
fn a_hand_falls_through_the_play_of_its_handle_alike() {
    let mut experiment = falling();
    experiment.setup.contact.play = [0.002; 2];
    // The spring sets in within a step.
    assert_below(difference(&experiment, 0.125e-3), [7e-5, 5e-3, 0.15]);
}

/// Largest error of the energy balance \[J\]; 8 J are in motion.
fn energy_error(experiment: &Experiment<3>, from: f64, to: f64) -> f64 {
    let recording = rapier(experiment);
    let samples = recording.time.iter().zip(recording.energy_error());
    let within = samples.filter(|(t, _)| (from..to).contains(*t));
    within.fold(0.0, |worst, (_, e)| worst.max(e.abs()))
}

#[test]
fn the_energy_of_a_free_swing_is_kept_to_second_order() {
    let mut experiment = free_swing();
    let fine = energy_error(&experiment, 0.0, 2.0);
    assert!(fine < 3e-5, "{fine} J");
    experiment.dt = 0.5e-3;
    let order = libm::log2(energy_error(&experiment, 0.0, 2.0) / fine);
    assert!((order - 2.0).abs() < 0.1, "order {order}");
}

/// Over a minute it goes up and down by 7e-4 J at this step; at 1 ms it falls by 1e-2 J.
#[test]
fn the_energy_of_a_free_swing_does_not_drift() {
    let mut experiment = free_swing();
    experiment.duration = 20.0;
    let worst = energy_error(&experiment, 0.0, 20.0);
    assert!(worst < 1.5e-3, "{worst} J");
}

#[test]
fn the_energy_balance_of_a_led_arm_closes() {
    let recording = rapier(&smooth(2.0));
    let worst = most(recording.energy_error());
    assert!(worst < 1e-6, "{worst} J");
}

/// A digest differs when a bit differs. Where this fails on one platform only, something has reached its mathematics; where
/// it fails everywhere after a new version of rapier or a change of this engine, put the new number here and say why.
#[test]
fn every_run_has_the_same_bits() {
    let mut experiment = falling();
    experiment
        .effects
        .push(Effect::new(Kind::Relaxation, 1).with(&[1.0, 0.5]));
    let bits = || digest(&rapier(&experiment)).expect("finite values");
    let first = bits();
    assert_eq!(bits(), first, "the second run in one thread");
    std::thread::scope(|scope| {
        let runs = [(); 2].map(|()| scope.spawn(bits));
        for run in runs {
            assert_eq!(run.join().expect("no panic"), first, "beside another run");
        }
    });
    assert_eq!(first, 0xe4b7_3042_a2cf_60c4, "found {first:#018x}");
}

#[test]
fn what_rapier_cannot_do_is_refused() {
    let mut moving = smooth(0.1);
    moving
        .effects
        .push(Effect::new(Kind::ShoulderMotion, 0).with(&[0.01, 0.02]));
    let refused = simulate_with(Engine::Rapier, &moving);
    assert_eq!(
        refused.expect_err("a moving base").to_string(),
        "the rapier engine cannot simulate a first joint that moves with its angle"
    );

    let mut heaving = smooth(0.1);
    heaving
        .effects
        .push(Effect::new(Kind::ShoulderHeave, 0).with(&[0.01, 0.02]));
    let refused = simulate_with(Engine::Rapier, &heaving);
    assert_eq!(
        refused.expect_err("a heaving base").to_string(),
        "the rapier engine cannot simulate a first joint that heaves"
    );

    let mut point_mass = free_swing();
    point_mass.setup.segments[1].inertia = 0.0;
    run(&point_mass);
    let refused = simulate_with(Engine::Rapier, &point_mass).expect_err("no inertia");
    let SimulationError::Invalid(Invalid::OutOfRange { index, found, .. }) = refused else {
        panic!("{refused}");
    };
    assert_eq!((index, found), (1, 0.0));

    // The spring alone would allow twice the step.
    let mut stiff = smooth(2.0);
    stiff.setup.contact.damping = [1500.0; 2];
    stiff.dt = 1e-3;
    let refused = simulate_with(Engine::Rapier, &stiff).map(|_| ());
    let Err(SimulationError::TooStiff { largest, .. }) = refused else {
        panic!("{refused:?}");
    };
    let mut stable = stiff.clone();
    stable.dt = 2.0 / libm::ceil(2.0 / (0.9 * largest));
    rapier(&stable);
}

#[test]
fn a_run_that_diverges_names_the_step_and_keeps_the_record() {
    let mut experiment = free_swing();
    // A damper that reverses a speed more than twice over in one step.
    experiment
        .effects
        .push(Effect::new(Kind::Viscous, 2).with(&[100.0]));
    let partial = simulate_rapier(&experiment, &RapierSettings::default()).expect("accepted");
    let Some(SimulationError::Diverged { step, time, .. }) = partial.stopped else {
        panic!("{:?}", partial.stopped);
    };
    assert_eq!(time, step as f64 * experiment.dt);
    assert_eq!(partial.recording.len(), step);
}
