//! What is not finite gives no result and stays in no memory.

use std::ptr::{null, null_mut};

use armrs_c::armrs_status::*;
use armrs_c::*;

use crate::{CHANNEL, LIMITS, arm, arm_with, empty, moving, named};

/// The motion with one of its numbers replaced: time, then angles, speeds and accelerations.
fn replaced(at: usize, value: armrs_real) -> armrs_motion {
    let mut motion = moving();
    match at {
        0 => motion.time = value,
        _ => {
            let (which, joint) = ((at - 1) / ARMRS_JOINTS, (at - 1) % ARMRS_JOINTS);
            [&mut motion.q, &mut motion.qd, &mut motion.qdd][which][joint] = value;
        }
    }
    motion
}

/// An arm with each kind that acts in joints, one at a time.
fn arms_with_all_effects() -> Vec<armrs_arm> {
    arm_core::effect::KINDS
        .iter()
        .filter(|kind| !kind.needs_more_than_an_arm())
        .map(|kind| kind.info())
        .filter(|info| info.place == arm_core::effect::Place::Joint)
        .map(|info| named(&std::ffi::CString::new(info.kind).unwrap(), 1))
        .filter_map(|effect| arm_with(&[effect]))
        .collect()
}

const NO_NUMBERS: [armrs_real; 3] = [
    armrs_real::NAN,
    armrs_real::INFINITY,
    armrs_real::NEG_INFINITY,
];
const UNTOUCHED: [armrs_real; ARMRS_JOINTS] = [42.0; ARMRS_JOINTS];

#[test]
fn a_motion_that_is_not_finite_gives_no_torque() {
    let arms = arms_with_all_effects();
    assert!(arms.len() > 5, "{}", arms.len());
    let load = armrs_load::default();
    for (arm, bad) in arms.iter().flat_map(|arm| NO_NUMBERS.map(|bad| (arm, bad))) {
        for at in 1..=3 * ARMRS_JOINTS {
            let (motion, accelerates) = (replaced(at, bad), at > 2 * ARMRS_JOINTS);
            let mut out = UNTOUCHED;
            // SAFETY: all pointers are good.
            unsafe {
                assert_eq!(
                    armrs_inverse_dynamics(arm, &motion, &load, out.as_mut_ptr()),
                    ARMRS_NOT_FINITE,
                    "{at} {bad}"
                );
                let status = armrs_resistance(arm, &motion, null(), out.as_mut_ptr());
                assert_eq!(status, ARMRS_NOT_FINITE, "{at} {bad}");
                if accelerates {
                    continue;
                }
                assert_eq!(
                    armrs_forward_dynamics(arm, &motion, &load, out.as_mut_ptr()),
                    ARMRS_NOT_FINITE,
                    "{at} {bad}"
                );
                if at <= ARMRS_JOINTS {
                    assert_eq!(
                        armrs_gravity(arm, motion.q.as_ptr(), out.as_mut_ptr()),
                        ARMRS_NOT_FINITE
                    );
                    let (mut tip, mut rows) = ([42.0; 2], [UNTOUCHED; 2]);
                    let status = armrs_kinematics(
                        arm,
                        motion.q.as_ptr(),
                        tip.as_mut_ptr(),
                        rows.as_mut_ptr(),
                    );
                    assert_eq!(status, ARMRS_NOT_FINITE);
                    assert_eq!((tip, rows), ([42.0; 2], [UNTOUCHED; 2]));
                }
            }
            assert_eq!(out, UNTOUCHED);
        }
        for at in 0..ARMRS_JOINTS + 3 {
            let mut load = armrs_load::default();
            match at.checked_sub(ARMRS_JOINTS) {
                None => load.torque[at] = bad,
                Some(2) => load.moment_on_arm = bad,
                Some(axis) => load.force_on_arm[axis] = bad,
            }
            let mut out = UNTOUCHED;
            // SAFETY: all pointers are good.
            unsafe {
                let status = armrs_forward_dynamics(arm, &moving(), &load, out.as_mut_ptr());
                assert_eq!(status, ARMRS_NOT_FINITE);
                if at >= ARMRS_JOINTS {
                    let status = armrs_inverse_dynamics(arm, &moving(), &load, out.as_mut_ptr());
                    assert_eq!(status, ARMRS_NOT_FINITE);
                }
            }
            assert_eq!(out, UNTOUCHED);
        }
    }
}

#[test]
fn a_motion_that_is_not_finite_stays_in_no_memory() {
    for mut arm in arms_with_all_effects() {
        // SAFETY: all pointers are good.
        unsafe {
            let mut before = UNTOUCHED;
            assert_eq!(armrs_arm_advance(&mut arm, &moving(), 0.001), ARMRS_OK);
            armrs_resistance(&arm, &moving(), null(), before.as_mut_ptr());
            for bad in NO_NUMBERS {
                for at in 0..=3 * ARMRS_JOINTS {
                    let status = armrs_arm_advance(&mut arm, &replaced(at, bad), 0.001);
                    assert_eq!(status, ARMRS_NOT_FINITE);
                }
                assert_eq!(
                    armrs_arm_advance(&mut arm, &moving(), bad),
                    ARMRS_NOT_FINITE
                );
            }
            let status = armrs_arm_advance(&mut arm, &moving(), -0.001);
            assert_eq!(status, ARMRS_OUT_OF_RANGE);
            let mut after = UNTOUCHED;
            assert_eq!(
                armrs_resistance(&arm, &moving(), null(), after.as_mut_ptr()),
                ARMRS_OK
            );
            assert_eq!(before, after);
        }
    }
}

#[test]
fn what_carries_an_arm_is_finite_or_nothing() {
    let arm = arm();
    let (mut estimator, mut settings) = (empty::<armrs_estimator>(), empty::<armrs_settings>());
    let mut compensation = empty::<armrs_compensation>();
    let (values, covariance) = (
        [0.1; ARMRS_UNKNOWNS],
        [[0.0; ARMRS_UNKNOWNS]; ARMRS_UNKNOWNS],
    );
    // SAFETY: all pointers are good.
    unsafe {
        armrs_estimator_settings(&mut settings, &arm, 0.004);
        for bad in NO_NUMBERS {
            let status = armrs_estimator_init(&mut estimator, &arm, bad, &settings, null_mut());
            assert_ne!(status, ARMRS_OK, "uncertainty {bad}");
            let mut broken = settings;
            for at in 0..7 {
                let (infinite_is_none, place) = match at {
                    0 => (false, &mut broken.period),
                    1 => (false, &mut broken.cutoff),
                    2 => (false, &mut broken.window),
                    3 => (false, &mut broken.noise[0]),
                    4 => (true, &mut broken.gate),
                    5 => (true, &mut broken.frozen_after),
                    _ => (true, &mut broken.dead_band),
                };
                *place = bad;
                let status = armrs_estimator_init(&mut estimator, &arm, 0.1, &broken, null_mut());
                if !(infinite_is_none && bad > 0.0) {
                    assert_ne!(status, ARMRS_OK, "setting {at} {bad}");
                }
                broken = settings;
            }
            let mut odd = values;
            odd[1] = bad;
            let status = armrs_compensation_init(
                &mut compensation,
                &arm,
                odd.as_ptr(),
                covariance.as_ptr().cast(),
                null_mut(),
            );
            assert_ne!(status, ARMRS_OK);
            let mut wide = covariance;
            wide[1][0] = bad;
            let status = armrs_compensation_init(
                &mut compensation,
                &arm,
                values.as_ptr(),
                wide.as_ptr().cast(),
                null_mut(),
            );
            assert_ne!(status, ARMRS_OK);
        }
        assert_eq!(
            armrs_estimator_init(&mut estimator, &arm, 0.1, &settings, null_mut()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_compensation_init(
                &mut compensation,
                &arm,
                values.as_ptr(),
                covariance.as_ptr().cast(),
                null_mut()
            ),
            ARMRS_OK
        );
        for bad in NO_NUMBERS {
            for at in 1..=2 * ARMRS_JOINTS {
                let motion = replaced(at, bad);
                let (mut torque, mut sd) = (UNTOUCHED, UNTOUCHED);
                let by_estimate = armrs_estimator_carry(
                    &estimator,
                    &motion,
                    torque.as_mut_ptr(),
                    sd.as_mut_ptr(),
                );
                let by_values = armrs_compensation_carry(
                    &compensation,
                    &motion,
                    torque.as_mut_ptr(),
                    sd.as_mut_ptr(),
                );
                assert_eq!(
                    (by_estimate, by_values),
                    (ARMRS_NOT_FINITE, ARMRS_NOT_FINITE),
                    "{at} {bad}"
                );
                assert_eq!((torque, sd), (UNTOUCHED, UNTOUCHED));
            }
        }
    }
}

#[test]
fn a_path_takes_numbers_only() {
    let mut path: armrs_path = empty();
    let way = [[0.0; ARMRS_JOINTS], [0.5; ARMRS_JOINTS]];
    // SAFETY: all pointers are good.
    let mut init = |way: &[[armrs_real; ARMRS_JOINTS]; 2], limits: &[_; ARMRS_JOINTS], pause| unsafe {
        let (way, limits) = (way.as_ptr().cast(), limits.as_ptr());
        armrs_path_init(&mut path, way, 2, limits, pause, 1, null_mut())
    };
    for bad in NO_NUMBERS.into_iter().chain([-1.0]) {
        let (mut slow, mut lazy) = (LIMITS, LIMITS);
        slow[0].speed = bad;
        lazy[0].acceleration = bad;
        assert_ne!(init(&way, &slow, 0.0), ARMRS_OK, "{bad}");
        assert_ne!(init(&way, &lazy, 0.0), ARMRS_OK, "{bad}");
        assert_ne!(init(&way, &LIMITS, bad), ARMRS_OK, "{bad}");
    }
    for bad in NO_NUMBERS {
        let mut away = way;
        away[1][0] = bad;
        assert_ne!(init(&away, &LIMITS, 0.0), ARMRS_OK);
    }
    assert_eq!(init(&way, &LIMITS, 0.0), ARMRS_OK);
    for bad in NO_NUMBERS {
        let mut motion = moving();
        // SAFETY: all pointers are good.
        let status = unsafe { armrs_path_at(&path, bad, &mut motion) };
        assert_eq!((status, motion), (ARMRS_NOT_FINITE, moving()));
    }
}

#[test]
fn a_robot_takes_numbers_only() {
    let mut robot: armrs_robot = empty();
    // SAFETY: all pointers are good.
    let mut init = |lengths: [armrs_real; 2]| unsafe {
        armrs_robot_init(
            &mut robot,
            lengths.as_ptr(),
            [1.05, -0.1].as_ptr(),
            1,
            null_mut(),
        )
    };
    for bad in NO_NUMBERS.into_iter().chain([-1.0]) {
        assert_ne!(init([0.45, bad]), ARMRS_OK);
    }
    assert_eq!(init([0.45; 2]), ARMRS_OK);
    let mut out = [42.0; 2];
    let to = out.as_mut_ptr();
    // SAFETY: all pointers are good.
    let speeds = |q: [armrs_real; 2], velocity: [armrs_real; 2]| unsafe {
        armrs_robot_speeds(&robot, q.as_ptr(), velocity.as_ptr(), to)
    };
    for bad in NO_NUMBERS {
        // SAFETY: all pointers are good.
        let (handle, angles) = unsafe {
            (
                armrs_robot_handle(&robot, [0.1, bad].as_ptr(), to),
                armrs_robot_angles(&robot, [0.5, bad].as_ptr(), to),
            )
        };
        assert_eq!((handle, angles), (ARMRS_NOT_FINITE, ARMRS_NOT_FINITE));
        assert_eq!(speeds([bad, 1.0], [0.1; 2]), ARMRS_NOT_FINITE);
        assert_eq!(speeds([0.1, 1.0], [bad, 0.1]), ARMRS_NOT_FINITE);
    }
    assert_eq!(
        speeds([0.3, 0.0], [0.1; 2]),
        ARMRS_NOT_FINITE,
        "at full stretch"
    );
    assert_eq!(out, [42.0; 2]);
}

#[test]
fn a_monitor_takes_numbers_only() {
    let mut monitor: armrs_monitor = empty();
    // SAFETY: all pointers are good.
    let mut init = |channels: &[armrs_channel]| unsafe {
        let (first, count) = (channels.as_ptr(), channels.len());
        armrs_monitor_init(&mut monitor, first, count, 1000, 2000, null_mut())
    };
    let mut odd = CHANNEL;
    odd.max = armrs_real::NAN;
    assert_ne!(init(&[odd]), ARMRS_OK);
    assert_eq!(init(&[CHANNEL; ARMRS_CHANNELS]), ARMRS_OK);
    for bad in NO_NUMBERS {
        for place in [0, ARMRS_CHANNELS - 1] {
            let mut seen: armrs_observation = empty();
            seen.values[place] = bad;
            // SAFETY: all pointers are good.
            unsafe {
                assert_eq!(
                    armrs_monitor_check(&mut monitor, &seen, null_mut()),
                    ARMRS_STOPPED
                );
                armrs_monitor_reset(&mut monitor);
            }
        }
    }
}

#[test]
fn a_monitor_reads_nothing_of_channels_that_it_does_not_watch() {
    let mut monitor: armrs_monitor = empty();
    let mut seen: armrs_observation = empty();
    seen.values[1] = armrs_real::NAN;
    // SAFETY: all pointers are good.
    unsafe {
        let channels = [CHANNEL; 2];
        for (count, status) in [(1, ARMRS_OK), (2, ARMRS_STOPPED)] {
            let made = armrs_monitor_init(
                &mut monitor,
                channels.as_ptr(),
                count,
                1000,
                2000,
                null_mut(),
            );
            assert_eq!(made, ARMRS_OK);
            let found = armrs_monitor_check(&mut monitor, &seen, null_mut());
            assert_eq!(found, status);
        }
    }
}
