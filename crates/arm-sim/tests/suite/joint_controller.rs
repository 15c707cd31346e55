//! The robot follows what is required, and the supervisor stops it in every fault and never without one.

use arm_core::Shape;
use arm_core::monitor::Reason;
use arm_sim::{
    Controlled, Controller, Experiment, InjectedFault, Safety, SimulationError, control,
    sample_experiments,
};

/// Control periods within which a fault must be seen.
const SOON: u64 = 2;

fn experiment(duration: f64) -> Experiment<2> {
    let arm = arm_core::sample_arms::mechanical_arm();
    let (from, to) = ([-60.0, 50.0], [-40.0, 80.0]);
    let mut experiment =
        sample_experiments::led(arm, Shape::Smooth, (from, to), duration, [0.0; 2])
            .expect("a possible run");
    experiment.robot = Some(sample_experiments::robot().expect("the robot of the thesis"));
    experiment
}

fn run(duration: f64, fault: Option<(f64, InjectedFault)>, seed: u64) -> Controlled {
    let settings = (&Controller::default(), &Safety::default());
    control(&experiment(duration), settings, fault, seed).expect("a run")
}

#[test]
fn follows_the_required_angles() {
    let done = run(4.0, None, 1);
    assert_eq!(done.time.len(), 16_001);
    assert!(done.stop.is_none());
    // A tenth of a millimetre at the handle.
    assert!(
        done.tracking_error < 2e-4,
        "tracking error {} rad",
        done.tracking_error
    );
}

/// A movement with an acceleration of 1e-9 rad/s² ended the process with an allocation of 6.4 GB, after many others.
#[test]
#[cfg(target_os = "linux")]
fn what_needs_more_memory_than_there_is_is_refused_at_once() {
    let settings = (&Controller::default(), &Safety::default());
    let refused = control(&experiment(1e9), settings, None, 1).expect_err("too much");
    let SimulationError::Memory { needed, .. } = refused else {
        panic!("{refused}");
    };
    // 4e12 periods with angles, speeds, accelerations, a time and two angles read.
    assert_eq!(needed, 4_000_000_000_000 * 72);
}

#[test]
fn never_stops_without_a_fault() {
    for seed in 0..20 {
        let done = run(2.0 + 0.3 * seed as f64, None, seed);
        assert_eq!(done.stop, None, "seed {seed}");
    }
}

#[test]
fn every_fault_stops_the_robot_within_two_periods() {
    let faults = [
        (InjectedFault::Runaway(0), Reason::Limit),
        (InjectedFault::Runaway(1), Reason::Limit),
        (InjectedFault::Frozen(0), Reason::Frozen),
        (InjectedFault::Frozen(1), Reason::Frozen),
        (InjectedFault::NotANumber(0), Reason::NotFinite),
        (InjectedFault::NotANumber(1), Reason::NotFinite),
        (InjectedFault::Late(1e-3), Reason::Clock),
        (InjectedFault::Pressed([150.0, 0.0]), Reason::Limit),
        (InjectedFault::Pressed([0.0, -150.0]), Reason::Limit),
    ];
    for seed in 0..10 {
        // In the middle of either half, where both joints move.
        let at = [0.7, 0.9, 1.1, 2.9, 3.1][seed as usize % 5] + 1e-4 * seed as f64;
        for (fault, reason) in faults {
            let done = run(4.0, Some((at, fault)), seed);
            let stop = done.stop.expect("a stop");
            // An encoder that freezes in fast motion reads as an impossible deceleration at once.
            let braked = matches!(fault, InjectedFault::Frozen(_)) && stop.reason == Reason::Limit;
            assert!(stop.reason == reason || braked, "{fault:?}: {stop:?}");
            let periods = done.periods_to_stop.expect("a stop after the fault");
            assert!(periods <= SOON, "{fault:?}: {periods} periods");
        }
    }
}

#[test]
fn a_stop_does_no_harm() {
    let rest = run(4.0, None, 1).force_after_fault;
    assert_eq!(rest, 0.0);
    for joint in 0..2 {
        let done = run(4.0, Some((1.0, InjectedFault::Runaway(joint))), 1);
        assert!(done.way_after_stop < 0.01, "{} m", done.way_after_stop);
        assert!(
            done.force_after_fault < 60.0,
            "{} N",
            done.force_after_fault
        );
        let last = done.robot_q.len();
        assert_eq!(done.robot_q[last - 2..], done.robot_q[last - 4..last - 2]);
    }
}

#[test]
fn refuses_what_cannot_be_controlled() {
    let refused = |change: fn(&mut Controller, &mut Safety)| {
        let (mut controller, mut safety) = (Controller::default(), Safety::default());
        change(&mut controller, &mut safety);
        control(&experiment(2.0), (&controller, &safety), None, 0)
            .expect_err("a refusal")
            .to_string()
    };
    assert!(refused(|c, _| c.period = f64::NAN).contains("control period is NaN"));
    assert!(refused(|c, _| c.bandwidth = 1e4).contains("a fifth of the control rate"));
    assert!(refused(|_, s| s.force = -1.0).contains("force limit is -1"));
    let mut free = experiment(2.0);
    free.robot = None;
    let settings = (&Controller::default(), &Safety::default());
    let error = control(&free, settings, None, 0).expect_err("no robot");
    assert!(error.to_string().contains("without a robot"));
}
