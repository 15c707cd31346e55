//! The slave's time and the importer's.

use arm_cosim::{ArmSpec, Slave, Status};

/// From steps of a length that is nearly, but not quite, a whole number of inner steps.
fn run(step: f64, inner: f64) -> Slave {
    let mut spec = ArmSpec::sample();
    spec.step = inner;
    let mut arm = Slave::new(spec).unwrap();
    arm.enter_initialization_mode(0.0, None).unwrap();
    arm.exit_initialization_mode().unwrap();
    for k in 0..2000 {
        arm.do_step(f64::from(k) * step, step).unwrap();
    }
    assert!((arm.time() - 2000.0 * step).abs() < 2e-6 * inner);
    arm
}

#[test]
fn steps_in_single_precision_do_not_run_away() {
    let angles = |mut arm: Slave| {
        let mut q = [0.0; 2];
        let at = ["q[1]", "q[2]"].map(|name| arm.reference(name).unwrap());
        arm.get(&at, &mut q).unwrap();
        q
    };
    for inner in [0.25e-3, 1e-3] {
        let single = angles(run(f64::from(1e-3_f32), inner));
        let double = angles(run(1e-3, inner));
        // The end is 95 ns later.
        for (a, b) in single.into_iter().zip(double) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
    }
    for share in [1e-9, 3e-7, -3e-7, 9e-7, 2e-6] {
        run(1e-3 + share * 0.25e-3, 0.25e-3);
    }
}

#[test]
fn a_step_that_time_cannot_hold_is_refused() {
    for (start, step) in [(1e300, 0.01), (1e15, 0.01), (1.0, 1e-300)] {
        let mut arm = Slave::new(ArmSpec::sample()).unwrap();
        arm.enter_initialization_mode(start, None).unwrap();
        arm.exit_initialization_mode().unwrap();
        let refused = arm.do_step(start, step).unwrap_err();
        assert_eq!(refused.status, Status::Error);
        assert!(refused.message.contains("cannot hold"), "{refused}");
        // Numbers of 300 digits are no line that anybody reads.
        assert!(refused.message.len() < 100, "{refused}");
    }
}
