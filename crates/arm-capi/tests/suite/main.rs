//! The C interface called as C calls it: results as of the core, refusals without a crash. Runs under Miri as well.

mod finite;
mod guards;

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use armrs_c::armrs_status::*;
use armrs_c::*;

const ARM: [armrs_segment; ARMRS_JOINTS] = [armrs_segment {
    length: 0.3,
    mass: 1.2,
    com: [0.15, 0.0],
    inertia: 0.009,
}; ARMRS_JOINTS];

const LIMITS: [armrs_limits; ARMRS_JOINTS] = [armrs_limits {
    speed: 1.0,
    acceleration: 4.0,
}; ARMRS_JOINTS];
const CHANNEL: armrs_channel = armrs_channel {
    quantity: 0,
    min: -1.0,
    max: 1.0,
    fastest: 0.0,
    farthest: 0.0,
    frozen_after: 0,
};

/// Storage as C has it before `_init`: zeros.
fn empty<T>() -> T {
    // SAFETY: all structs of the interface are plain numbers.
    unsafe { MaybeUninit::zeroed().assume_init() }
}

fn named(name: &core::ffi::CStr, joint: u32) -> armrs_effect {
    let mut effect = empty();
    // SAFETY: both pointers are good.
    let status = unsafe { armrs_effect_named(name.as_ptr(), joint, &mut effect) };
    assert_eq!(status, ARMRS_OK);
    effect
}

/// What `armrs_arm_init` says of segments and of so many effects.
///
/// # Safety
/// Every pointer is good or null.
unsafe fn init(
    arm: &mut armrs_arm,
    segments: *const armrs_segment,
    (effects, count): (*const armrs_effect, usize),
) -> armrs_status {
    let (base, gravity) = ([0.0; 2], [0.0, -9.81]);
    let (base, gravity) = (base.as_ptr(), gravity.as_ptr());
    // SAFETY: as promised.
    unsafe { armrs_arm_init(arm, segments, base, gravity, effects, count, null_mut()) }
}

/// The arm with effects, where it takes them.
fn arm_with(effects: &[armrs_effect]) -> Option<armrs_arm> {
    let mut arm = empty();
    // SAFETY: all pointers are good.
    let status = unsafe { init(&mut arm, ARM.as_ptr(), (effects.as_ptr(), effects.len())) };
    (status == ARMRS_OK).then_some(arm)
}

fn arm() -> armrs_arm {
    let mut effects = [named(c"viscous", 0), named(c"coulomb", 1)];
    effects[0].parameters[0] = 0.25;
    effects[1].parameters[0] = 0.16;
    arm_with(&effects).expect("a valid arm")
}

fn moving() -> armrs_motion {
    armrs_motion {
        q: [-0.4; ARMRS_JOINTS],
        qd: [0.5; ARMRS_JOINTS],
        qdd: [1.0; ARMRS_JOINTS],
        ..Default::default()
    }
}

#[test]
fn an_arm_level_and_at_rest_needs_what_the_head_says() {
    let (arm, mut torque, mut tip) = (arm(), [0.0; ARMRS_JOINTS], [0.0; 2]);
    let mut rows = [[0.0; ARMRS_JOINTS]; 2];
    let level = [0.0; ARMRS_JOINTS];
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_gravity(&arm, level.as_ptr(), torque.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_kinematics(&arm, level.as_ptr(), tip.as_mut_ptr(), rows.as_mut_ptr()),
            ARMRS_OK
        );
    }
    let last = 1.2 * 9.81 * 0.15;
    assert!((torque[ARMRS_JOINTS - 1] - last).abs() < 1e-5 * last);
    assert!((tip[0] - 0.3 * ARMRS_JOINTS as armrs_real).abs() < 1e-6 && tip[1] == 0.0);
    assert!((rows[1][0] - tip[0]).abs() < 1e-6 && rows[0][0] == 0.0);
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    let (arm, motion) = (arm(), moving());
    let mut load = armrs_load {
        force_on_arm: [3.0, -2.0],
        moment_on_arm: 0.2,
        ..Default::default()
    };
    let (mut torque, mut found, mut resisting) = (
        [0.0; ARMRS_JOINTS],
        [0.0; ARMRS_JOINTS],
        [0.0; ARMRS_JOINTS],
    );
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_inverse_dynamics(&arm, &motion, &load, torque.as_mut_ptr()),
            ARMRS_OK
        );
        load.torque = torque;
        assert_eq!(
            armrs_forward_dynamics(&arm, &motion, &load, found.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_resistance(&arm, &motion, null(), resisting.as_mut_ptr()),
            ARMRS_OK
        );
    }
    assert!(
        found
            .iter()
            .zip(motion.qdd)
            .all(|(a, b)| (a - b).abs() < 1e-3),
        "{found:?}"
    );
    assert!(
        (resisting[0] - 0.125).abs() < 1e-6 && (resisting[1] - 0.16).abs() < 1e-6,
        "{resisting:?}"
    );
}

#[test]
fn a_path_ends_where_it_should() {
    let (mut path, mut motion, mut duration) =
        (empty::<armrs_path>(), armrs_motion::default(), 0.0);
    let waypoints = [
        [0.0; ARMRS_JOINTS],
        [0.5; ARMRS_JOINTS],
        [0.2; ARMRS_JOINTS],
    ];
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_path_duration(&path, &mut duration),
            ARMRS_NOT_INITIALISED
        );
        let status = armrs_path_init(
            &mut path,
            waypoints.as_ptr().cast(),
            3,
            LIMITS.as_ptr(),
            0.1,
            1,
            null_mut(),
        );
        assert_eq!(status, ARMRS_OK);
        assert_eq!(armrs_path_duration(&path, &mut duration), ARMRS_OK);
        assert_eq!(armrs_path_at(&path, duration + 1.0, &mut motion), ARMRS_OK);
        assert_eq!(
            armrs_path_init(
                &mut path,
                waypoints.as_ptr().cast(),
                ARMRS_WAYPOINTS + 1,
                LIMITS.as_ptr(),
                0.1,
                1,
                null_mut()
            ),
            ARMRS_OUT_OF_RANGE
        );
        assert_eq!(
            armrs_path_init(&mut path, null(), 2, LIMITS.as_ptr(), 0.1, 1, null_mut()),
            ARMRS_NULL
        );
        assert_eq!(
            armrs_path_init(
                &mut path,
                waypoints.as_ptr().cast(),
                0,
                LIMITS.as_ptr(),
                0.1,
                1,
                null_mut()
            ),
            ARMRS_OUT_OF_RANGE
        );
    }
    assert_eq!(motion.q, [0.2; ARMRS_JOINTS]);
    assert_eq!(motion.qd, [0.0; ARMRS_JOINTS]);
}

#[test]
fn a_robot_reaches_and_says_when_not() {
    let (mut robot, mut q, mut handle, mut speeds) =
        (empty::<armrs_robot>(), [0.0; 2], [0.0; 2], [0.0; 2]);
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_robot_init(
                &mut robot,
                [0.45; 2].as_ptr(),
                [1.05, -0.1].as_ptr(),
                1,
                null_mut()
            ),
            ARMRS_OK
        );
        assert_eq!(
            armrs_robot_angles(&robot, [0.5, 0.2].as_ptr(), q.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_robot_handle(&robot, q.as_ptr(), handle.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_robot_speeds(&robot, q.as_ptr(), [0.1, 0.0].as_ptr(), speeds.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_robot_angles(&robot, [-5.0, 0.2].as_ptr(), q.as_mut_ptr()),
            ARMRS_OUT_OF_REACH
        );
        assert_eq!(
            armrs_robot_angles(&robot, [armrs_real::NAN, 0.2].as_ptr(), q.as_mut_ptr()),
            ARMRS_NOT_FINITE
        );
    }
    assert!((handle[0] - 0.5).abs() < 1e-6 && (handle[1] - 0.2).abs() < 1e-6);
    assert!(speeds.iter().all(|s| s.is_finite()));
}

#[test]
fn an_estimator_learns_and_a_compensation_carries() {
    let arm = arm();
    let (mut estimator, mut settings) = (empty::<armrs_estimator>(), empty::<armrs_settings>());
    let (mut heed, mut estimate) = (armrs_sample_status::ARMRS_TAKEN, empty::<armrs_estimate>());
    let (mut torque, mut sd) = ([0.0; ARMRS_JOINTS], [0.0; ARMRS_JOINTS]);
    let mut motion = moving();
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_estimator_update(&mut estimator, null(), null_mut()),
            ARMRS_NOT_INITIALISED
        );
        assert_eq!(
            armrs_estimator_settings(&mut settings, &arm, 0.004),
            ARMRS_OK
        );
        assert_eq!(
            armrs_estimator_init(&mut estimator, &arm, 0.1, &settings, null_mut()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_estimator_update(&mut estimator, null(), &mut heed),
            ARMRS_OK
        );
        assert_eq!(heed, armrs_sample_status::ARMRS_MISSING);
        for k in 0..100 {
            motion.q = [-0.4 + 0.002 * k as armrs_real; ARMRS_JOINTS];
            motion.qdd = [0.0; ARMRS_JOINTS];
            let mut sample = armrs_sample {
                q: motion.q,
                lead: motion.q,
                led: 0,
                load: Default::default(),
            };
            armrs_inverse_dynamics(
                &arm,
                &motion,
                &Default::default(),
                sample.load.torque.as_mut_ptr(),
            );
            assert_eq!(
                armrs_estimator_update(&mut estimator, &sample, &mut heed),
                ARMRS_OK
            );
        }
        assert_eq!(heed, armrs_sample_status::ARMRS_TAKEN);
        assert_eq!(
            armrs_estimator_get(&estimator, 2 * ARMRS_JOINTS + 1, &mut estimate),
            ARMRS_OK
        );
        assert_eq!(
            armrs_estimator_get(&estimator, 2 * ARMRS_JOINTS + 2, &mut estimate),
            ARMRS_OUT_OF_RANGE
        );
        motion.qd = [0.0; ARMRS_JOINTS];
        assert_eq!(
            armrs_estimator_carry(&estimator, &motion, torque.as_mut_ptr(), sd.as_mut_ptr()),
            ARMRS_OK
        );
    }
    assert!(estimate.value.is_finite() && sd.iter().all(|s| *s > 0.0));
    let mut weight = [0.0; ARMRS_JOINTS];
    // SAFETY: all pointers are good.
    unsafe {
        armrs_gravity(&arm, motion.q.as_ptr(), weight.as_mut_ptr());
        let mut compensation = empty::<armrs_compensation>();
        let (mut values, mut covariance) = (
            [0.0; ARMRS_UNKNOWNS],
            [[0.0; ARMRS_UNKNOWNS]; ARMRS_UNKNOWNS],
        );
        for (j, value) in values.iter_mut().take(ARMRS_JOINTS).enumerate() {
            *value = 1.2 * (0.15 + 0.3 * (ARMRS_JOINTS - 1 - j) as armrs_real);
        }
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
        assert_eq!(
            armrs_compensation_carry(&compensation, &motion, torque.as_mut_ptr(), sd.as_mut_ptr()),
            ARMRS_OK
        );
        covariance[3][3] = -1.0;
        assert_eq!(
            armrs_compensation_init(
                &mut compensation,
                &arm,
                values.as_ptr(),
                covariance.as_ptr().cast(),
                null_mut()
            ),
            ARMRS_OUT_OF_RANGE
        );
    }
    assert!(
        torque.iter().zip(weight).all(|(a, b)| (a - b).abs() < 1e-5),
        "{torque:?} {weight:?}"
    );
    assert_eq!(sd, [0.0; ARMRS_JOINTS]);
}

#[test]
fn a_monitor_stops_until_reset() {
    let mut monitor = empty::<armrs_monitor>();
    let mut seen: armrs_observation = empty();
    let mut stop: armrs_stop = empty();
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_monitor_check(&mut monitor, &seen, null_mut()),
            ARMRS_NOT_INITIALISED
        );
        assert_eq!(
            armrs_monitor_init(&mut monitor, &CHANNEL, 1, 1000, 2000, null_mut()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_monitor_check(&mut monitor, &seen, &mut stop),
            ARMRS_OK
        );
        seen.values[0] = 2.0;
        seen.now = 1000;
        seen.stamp = 1000;
        assert_eq!(
            armrs_monitor_check(&mut monitor, &seen, &mut stop),
            ARMRS_STOPPED
        );
        assert_eq!(
            (stop.reason, stop.channel, stop.value),
            (armrs_reason::ARMRS_REASON_LIMIT, 0, 2.0)
        );
        seen.values[0] = 0.0;
        assert_eq!(
            armrs_monitor_check(&mut monitor, &seen, null_mut()),
            ARMRS_STOPPED
        );
        assert_eq!(armrs_monitor_reset(&mut monitor), ARMRS_OK);
        assert_eq!(
            armrs_monitor_check(&mut monitor, &seen, &mut stop),
            ARMRS_OK
        );
        let odd = armrs_channel {
            quantity: 99,
            ..CHANNEL
        };
        assert_eq!(
            armrs_monitor_init(&mut monitor, &odd, 1, 1000, 2000, null_mut()),
            ARMRS_OUT_OF_RANGE
        );
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let (mut made, mut torque) = (empty::<armrs_arm>(), [0.0; ARMRS_JOINTS]);
    // SAFETY: the pointers are good, or null.
    unsafe {
        assert_eq!(
            armrs_gravity(&made, [0.0; ARMRS_JOINTS].as_ptr(), torque.as_mut_ptr()),
            ARMRS_NOT_INITIALISED
        );
        assert_eq!(
            armrs_gravity(null(), [0.0; ARMRS_JOINTS].as_ptr(), torque.as_mut_ptr()),
            ARMRS_NULL
        );
        assert_eq!(init(&mut made, null(), (null(), 0)), ARMRS_NULL);
        assert_eq!(init(&mut made, ARM.as_ptr(), (null(), 1)), ARMRS_NULL);
        assert_eq!(
            init(&mut made, ARM.as_ptr(), (null(), 13)),
            ARMRS_OUT_OF_RANGE
        );
        let mut bad = ARM;
        bad[1].mass = -1.0;
        assert_eq!(
            init(&mut made, bad.as_ptr(), (null(), 0)),
            ARMRS_OUT_OF_RANGE
        );
        bad[1].mass = armrs_real::NAN;
        assert_eq!(init(&mut made, bad.as_ptr(), (null(), 0)), ARMRS_NOT_FINITE);
        let mut effect: armrs_effect = empty();
        assert_eq!(
            armrs_effect_named(c"colomb".as_ptr(), 0, &mut effect),
            ARMRS_UNKNOWN
        );
        assert_eq!(armrs_effect_named(null(), 0, &mut effect), ARMRS_NULL);
        effect = named(c"coulomb", 7);
        assert_eq!(
            init(&mut made, ARM.as_ptr(), (&effect, 1)),
            ARMRS_OUT_OF_RANGE
        );
        effect.kind = 1_000_000;
        assert_eq!(init(&mut made, ARM.as_ptr(), (&effect, 1)), ARMRS_UNKNOWN);
    }
}
