//! What went wrong silently, or with settings as they come, once: each stays found.

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

use arm_core::effect::{ActsOn, KINDS};
use armrs_c::armrs_sample_status::*;
use armrs_c::armrs_status::*;
use armrs_c::*;

use crate::{ARM, CHANNEL, LIMITS, arm, arm_with, empty, named};

const BASE: [armrs_real; 2] = [0.0; 2];
const GRAVITY: [armrs_real; 2] = [0.0, -9.81];
const PERIOD: armrs_real = 0.001;

/// What `armrs_arm_init` says of segments and effects.
fn refused(
    segments: &[armrs_segment; ARMRS_JOINTS],
    effects: &[armrs_effect],
) -> (armrs_status, String, armrs_problem) {
    let (mut made, mut problem) = (empty::<armrs_arm>(), empty::<armrs_problem>());
    // SAFETY: all pointers are good.
    let status = unsafe {
        armrs_arm_init(
            &mut made,
            segments.as_ptr(),
            BASE.as_ptr(),
            GRAVITY.as_ptr(),
            effects.as_ptr(),
            effects.len(),
            &mut problem,
        )
    };
    // SAFETY: it ends with zero.
    let what = unsafe { CStr::from_ptr(problem.what.as_ptr()) };
    (status, what.to_string_lossy().into_owned(), problem)
}

fn torque_of(arm: &armrs_arm) -> [armrs_real; ARMRS_JOINTS] {
    let motion = armrs_motion {
        time: 0.23,
        q: [-0.4; ARMRS_JOINTS],
        qd: [0.7; ARMRS_JOINTS],
        qdd: [2.0; ARMRS_JOINTS],
    };
    let load = armrs_load {
        force_on_arm: [3.0, -2.0],
        ..Default::default()
    };
    let mut torque = [0.0; ARMRS_JOINTS];
    // SAFETY: all pointers are good.
    let status = unsafe { armrs_inverse_dynamics(arm, &motion, &load, torque.as_mut_ptr()) };
    assert_eq!(status, ARMRS_OK);
    torque
}

#[test]
fn two_kilograms_at_the_hand_weigh_what_they_weigh() {
    let mut mass = named(c"added_mass", 0);
    mass.parameters[0] = 2.0;
    let (bare, loaded) = (arm_with(&[]).unwrap(), arm_with(&[mass]).unwrap());
    let (mut without, mut with) = ([0.0; ARMRS_JOINTS], [0.0; ARMRS_JOINTS]);
    let level = [0.0; ARMRS_JOINTS];
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_gravity(&bare, level.as_ptr(), without.as_mut_ptr()),
            ARMRS_OK
        );
        assert_eq!(
            armrs_gravity(&loaded, level.as_ptr(), with.as_mut_ptr()),
            ARMRS_OK
        );
    }
    for j in 0..ARMRS_JOINTS {
        let lever = 0.3 * (ARMRS_JOINTS - j) as armrs_real;
        let expected = 2.0 * 9.81 * lever;
        assert!(
            (with[j] - without[j] - expected).abs() < 1e-4,
            "{j}: {with:?} {without:?}"
        );
    }
}

#[test]
fn every_kind_of_the_catalogue_acts_or_is_refused_by_name() {
    let bare = torque_of(&arm_with(&[]).unwrap());
    let (mut acting, mut refusals) = (0, 0);
    for (number, kind) in KINDS.iter().enumerate() {
        let info = kind.info();
        let mut effect = armrs_effect {
            kind: number as u32,
            joint: 1,
            parameters: arm_core::effect::Effect::new(*kind, 1).parameters,
        };
        for (value, parameter) in effect.parameters.iter_mut().zip(info.parameters) {
            if parameter.linear || (*value == 0.0 && kind.acts_on() == ActsOn::Arm) {
                *value = parameter.max.min(0.05) as armrs_real;
            }
        }
        let name = CString::new(info.kind).unwrap();
        let mut made: armrs_effect = empty();
        // SAFETY: all pointers are good.
        let by_name = unsafe { armrs_effect_named(name.as_ptr(), 1, &mut made) };
        if kind.needs_more_than_an_arm() {
            refusals += 1;
            assert_eq!(by_name, ARMRS_CANNOT_ACT, "{}", info.kind);
            let filler = named(c"viscous", 0);
            let (status, what, problem) = refused(&ARM, &[filler, effect]);
            assert_eq!(
                (status, problem.index),
                (ARMRS_CANNOT_ACT, 1),
                "{}",
                info.kind
            );
            assert!(what.starts_with(&format!("{}: ", info.kind)), "{what}");
        } else {
            acting += 1;
            assert_eq!(by_name, ARMRS_OK, "{}", info.kind);
            let Some(mut arm) = arm_with(&[effect]) else {
                panic!("{}: {:?}", info.kind, refused(&ARM, &[effect]));
            };
            let motion = armrs_motion {
                qd: [0.7; ARMRS_JOINTS],
                ..Default::default()
            };
            // SAFETY: all pointers are good.
            let status = unsafe { armrs_arm_advance(&mut arm, &motion, 0.1) };
            assert_eq!(status, ARMRS_OK);
            assert_ne!(torque_of(&arm), bare, "{} does nothing", info.kind);
        }
    }
    assert_eq!((acting, refusals), (23, 15));
}

#[test]
fn a_refusal_says_which_segment_and_which_parameter() {
    let mut segments = ARM;
    segments[1].mass = -1.0;
    let (status, what, problem) = refused(&segments, &[]);
    assert_eq!(
        (status, what.as_str(), problem.index),
        (ARMRS_OUT_OF_RANGE, "mass of segment", 1)
    );
    assert_eq!(problem.found, -1.0);
    let mut friction = named(c"coulomb", 1);
    friction.parameters[0] = 1e9;
    let (status, what, problem) = refused(&ARM, &[friction]);
    assert_eq!(
        (status, what.as_str(), problem.index),
        (ARMRS_OUT_OF_RANGE, "coulomb: torque", 0)
    );
    assert_eq!((problem.found, problem.min), (1e9, 0.0));
    let many = [friction; ARMRS_EFFECTS + 1];
    let (status, what, problem) = refused(&ARM, &many);
    assert_eq!(
        (status, what.as_str()),
        (ARMRS_OUT_OF_RANGE, "number of effects")
    );
    assert_eq!(problem.found, (ARMRS_EFFECTS + 1) as armrs_real);
}

#[test]
fn an_arm_that_cannot_be_is_refused() {
    type Change = fn(&mut armrs_segment);
    let all: [(Change, &str); 6] = [
        (|s| s.mass = 1000.0, "mass of segment"),
        (|s| s.length = 300.0, "length of segment"),
        (|s| s.com[0] = 15.0, "centre of mass of segment, along"),
        (|s| s.com[0] = -0.2, "centre of mass of segment, along"),
        (|s| s.com[1] = 0.6, "centre of mass of segment, normal"),
        (|s| s.inertia = 9.0, "inertia of segment"),
    ];
    for (change, name) in all {
        let mut segments = ARM;
        change(&mut segments[ARMRS_JOINTS - 1]);
        let (status, what, problem) = refused(&segments, &[]);
        assert_eq!((status, what.as_str()), (ARMRS_IMPLAUSIBLE, name));
        assert_eq!(problem.index as usize, ARMRS_JOINTS - 1);
        assert!(problem.found < problem.min || problem.found > problem.max);
    }
    // What an effect makes of the arm counts as well.
    let mut moved = named(c"gravity_moment", 0);
    moved.parameters[0] = 2.0;
    assert_eq!(refused(&ARM, &[moved]).0, ARMRS_IMPLAUSIBLE);
}

#[test]
fn angles_that_are_none_give_no_result() {
    let arm = arm();
    let (mut point, mut rows) = ([42.0; 2], [[42.0; ARMRS_JOINTS]; 2]);
    // Beyond 1e8 rad single precision tells no angle; a double is finite there.
    let far = [1e9; ARMRS_JOINTS];
    // SAFETY: all pointers are good.
    let status =
        unsafe { armrs_kinematics(&arm, far.as_ptr(), point.as_mut_ptr(), rows.as_mut_ptr()) };
    if size_of::<armrs_real>() == 4 {
        assert_eq!((status, point), (ARMRS_NOT_FINITE, [42.0; 2]));
    } else {
        assert_eq!(status, ARMRS_OK);
        assert!(point.iter().all(|p| p.abs() <= 0.9));
    }
    let (mut path, mut problem) = (empty::<armrs_path>(), empty::<armrs_problem>());
    for absurd in [1e30, -1e10] {
        let way = [[0.0; ARMRS_JOINTS], [absurd; ARMRS_JOINTS]];
        // SAFETY: all pointers are good.
        let status = unsafe {
            armrs_path_init(
                &mut path,
                way.as_ptr().cast(),
                2,
                LIMITS.as_ptr(),
                0.0,
                1,
                &mut problem,
            )
        };
        assert_eq!((status, problem.index), (ARMRS_OUT_OF_RANGE, 1), "{absurd}");
    }
}

/// An estimator for the arm with the settings that it gets.
fn estimator() -> armrs_estimator {
    let (mut estimator, mut settings) = (empty(), empty());
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(
            armrs_estimator_settings(&mut settings, &arm(), PERIOD),
            ARMRS_OK
        );
        assert_eq!(
            armrs_estimator_init(&mut estimator, &arm(), 0.1, &settings, null_mut()),
            ARMRS_OK
        );
    }
    estimator
}

fn sample(k: u32) -> armrs_sample {
    let t = k as armrs_real * PERIOD;
    let (s, c) = arm_core::Scalar::sin_cos(2.0 * t);
    let motion = armrs_motion {
        time: t,
        q: [-0.4 + 0.3 * s; ARMRS_JOINTS],
        qd: [0.6 * c; ARMRS_JOINTS],
        qdd: [-1.2 * s; ARMRS_JOINTS],
    };
    let mut sample = armrs_sample {
        q: motion.q,
        lead: motion.q,
        led: 0,
        load: Default::default(),
    };
    let load = armrs_load::default();
    // SAFETY: all pointers are good.
    let status =
        unsafe { armrs_inverse_dynamics(&arm(), &motion, &load, sample.load.torque.as_mut_ptr()) };
    assert_eq!(status, ARMRS_OK);
    sample
}

fn update(estimator: &mut armrs_estimator, sample: *const armrs_sample) -> armrs_sample_status {
    let mut found = ARMRS_TAKEN;
    // SAFETY: all pointers are good, or null where none is.
    let status = unsafe { armrs_estimator_update(estimator, sample, &mut found) };
    assert_eq!(status, ARMRS_OK);
    found
}

#[test]
fn no_guard_is_off_as_settings_come() {
    let mut s: armrs_settings = empty();
    // SAFETY: all pointers are good.
    let status = unsafe { armrs_estimator_settings(&mut s, &arm(), PERIOD) };
    assert_eq!(status, ARMRS_OK);
    let guards = [
        s.fastest,
        s.steepest,
        s.largest_force,
        s.largest_torque,
        s.gate,
        s.frozen_after,
    ];
    assert!(
        guards
            .iter()
            .chain(&s.envelope)
            .all(|g| g.is_finite() && *g > 0.0),
        "{s:?}"
    );
    assert!(s.range.iter().flatten().all(|q| q.is_finite()));
}

#[test]
fn a_first_sample_that_cannot_be_is_not_started_from() {
    let turn = 2.0 * core::f64::consts::PI as armrs_real;
    type Change = fn(&mut armrs_sample, armrs_real);
    let all: [(Change, armrs_real); 5] = [
        (|s, v| s.q[0] = v, 1e10),
        (|s, v| s.load.torque[1] = v, 1e30),
        (|s, v| s.load.force_on_arm[0] = v, -1e30),
        (|s, v| s.load.moment_on_arm = v, 1e30),
        (|s, v| s.q[1] += v, turn),
    ];
    for (change, value) in all {
        let mut estimator = estimator();
        let mut bad = sample(0);
        change(&mut bad, value);
        assert_eq!(update(&mut estimator, &bad), ARMRS_NOT_POSSIBLE, "{value}");
        assert_eq!(update(&mut estimator, &sample(1)), ARMRS_SETTLING);
        for k in 2..400 {
            update(&mut estimator, &sample(k));
        }
        let mut bad = sample(400);
        change(&mut bad, value);
        assert_eq!(update(&mut estimator, &bad), ARMRS_NOT_POSSIBLE, "{value}");
    }
}

#[test]
fn what_is_not_finite_inside_starts_anew_and_is_told() {
    let mut estimator = estimator();
    for k in 0..1000 {
        update(&mut estimator, &sample(k));
    }
    let mut health: armrs_health = empty();
    // Every word of its state becomes NaN in turn: nothing that is written is not finite, and it recovers or is told.
    let words = size_of::<armrs_estimator>() / size_of::<armrs_real>();
    let step = if cfg!(miri) { 97 } else { 7 };
    let (mut restarts, mut untrusted) = (0, 0);
    for word in (8 / size_of::<armrs_real>()..words).step_by(step) {
        let mut spoiled = estimator_copy(&estimator);
        // SAFETY: within the struct. Only numbers are changed: flags and counts of the state keep their bits.
        unsafe {
            let place = (&raw mut spoiled).cast::<armrs_real>().add(word);
            let value = place.read_unaligned();
            if !(value.is_normal() && value.abs() > 1e-6 && value.abs() < 1e6) {
                continue;
            }
            place.write_unaligned(armrs_real::NAN);
        }
        for k in 1000..1400 {
            update(&mut spoiled, &sample(k));
            let (motion, mut torque) = (armrs_motion::default(), [42.0; ARMRS_JOINTS]);
            // SAFETY: all pointers are good.
            let status = unsafe {
                armrs_estimator_carry(&spoiled, &motion, torque.as_mut_ptr(), null_mut())
            };
            assert!(torque.iter().all(|t| t.is_finite()));
            untrusted += u32::from(status != ARMRS_OK);
        }
        // SAFETY: all pointers are good.
        if unsafe { armrs_estimator_health(&spoiled, &mut health) } == ARMRS_OK {
            restarts += health.restarts;
        }
    }
    assert!(restarts > 0 && untrusted > 0, "{restarts} {untrusted}");
}

fn estimator_copy(of: &armrs_estimator) -> armrs_estimator {
    // SAFETY: plain memory, as C copies it.
    unsafe { core::ptr::read(of) }
}

#[test]
fn a_loop_that_stalls_and_a_value_that_jumps_stop_the_device() {
    let channel = armrs_channel {
        min: -10.0,
        max: 10.0,
        fastest: 100.0,
        farthest: 1.5,
        ..CHANNEL
    };
    let watched = |channel: &armrs_channel, second: (u64, armrs_real)| {
        let (mut monitor, mut stop) = (empty::<armrs_monitor>(), empty::<armrs_stop>());
        let mut seen: armrs_observation = empty();
        // SAFETY: all pointers are good.
        unsafe {
            let status = armrs_monitor_init(&mut monitor, channel, 1, 1000, 2000, null_mut());
            assert_eq!(status, ARMRS_OK);
            assert_eq!(
                armrs_monitor_check(&mut monitor, &seen, &mut stop),
                ARMRS_OK
            );
            (seen.now, seen.stamp, seen.values[0]) = (second.0, second.0, second.1);
            let status = armrs_monitor_check(&mut monitor, &seen, &mut stop);
            (status == ARMRS_STOPPED).then_some(stop.reason)
        }
    };
    assert_eq!(watched(&channel, (2000, 0.05)), None);
    assert_eq!(
        watched(&channel, (50_000, 0.05)),
        Some(armrs_reason::ARMRS_REASON_STALLED)
    );
    assert_eq!(
        watched(&channel, (1000, 0.2)),
        Some(armrs_reason::ARMRS_REASON_JUMP)
    );
    let slow = armrs_channel {
        fastest: 0.0,
        ..channel
    };
    assert_eq!(watched(&slow, (1000, 0.2)), None);
    assert_eq!(
        watched(&slow, (1000, 1.6)),
        Some(armrs_reason::ARMRS_REASON_JUMP)
    );
}

#[test]
fn a_monitor_watches_something_and_for_some_time() {
    let mut monitor = empty::<armrs_monitor>();
    // SAFETY: all pointers are good.
    unsafe {
        let none = armrs_monitor_init(&mut monitor, null(), 0, 1000, 2000, null_mut());
        let never = armrs_monitor_init(&mut monitor, &CHANNEL, 1, 1000, 0, null_mut());
        assert_eq!((none, never), (ARMRS_OUT_OF_RANGE, ARMRS_OUT_OF_RANGE));
    }
}

/// Whether a monitor of all channels stops when one of its words is not what it was. One channel is compared in each period.
fn stops(word: usize, change: impl Fn(*mut u32) -> bool) -> Option<bool> {
    let (mut monitor, mut stop) = (empty::<armrs_monitor>(), empty::<armrs_stop>());
    let (seen, channels): (armrs_observation, _) = (empty(), [CHANNEL; ARMRS_CHANNELS]);
    // SAFETY: all pointers are good; only numbers are changed.
    unsafe {
        let (first, count) = (channels.as_ptr(), ARMRS_CHANNELS);
        let status = armrs_monitor_init(&mut monitor, first, count, 1000, 2000, null_mut());
        assert_eq!(status, ARMRS_OK);
        if !change((&raw mut monitor).cast::<u32>().add(word)) {
            return None;
        }
        // Before its channel is compared a limit that now excludes the value may stop it.
        let stopped = (0..ARMRS_CHANNELS)
            .any(|_| armrs_monitor_check(&mut monitor, &seen, &mut stop) == ARMRS_STOPPED);
        assert!(!stopped || stop.reason != armrs_reason::ARMRS_REASON_CLOCK);
        Some(stopped)
    }
}

#[test]
fn a_bit_that_flips_in_a_limit_stops_the_device() {
    let (mut limits, mut counts) = (0, 0);
    let high = size_of::<armrs_real>() / 4 - 1;
    for word in 2..size_of::<armrs_monitor>() / 4 {
        for bit in [0, 7, 20, 23, 30, 31] {
            // SAFETY: the word is one of the monitor.
            let of_limit = stops(word, |place| unsafe {
                let value = (place as *const armrs_real).read_unaligned();
                let limit = word % (high + 1) == 0 && (value.abs() == 1.0 || value.is_infinite());
                if limit {
                    // The high word of a number.
                    let high = place.add(high);
                    high.write(high.read() ^ (1 << bit));
                }
                limit
            });
            limits += usize::from(of_limit == Some(true));
            // SAFETY: the word is one of the monitor.
            let of_count = stops(word, |place| unsafe {
                let count = place.read() == ARMRS_CHANNELS as u32;
                if count {
                    place.write(place.read() ^ (1 << bit));
                }
                count
            });
            counts += usize::from(of_count == Some(true));
            assert_ne!(of_count, Some(false), "the number of channels");
        }
    }
    // Some of what looks like a limit lies in places that are not in use.
    assert_eq!(
        limits,
        4 * ARMRS_CHANNELS * 6,
        "four limits of each channel"
    );
    assert_eq!(counts, 6, "the number of channels");
}

#[test]
// Bytes between fields have no value there.
#[cfg_attr(miri, ignore)]
fn sealed_memory_tells_every_bit_that_flips() {
    let mut arm = arm();
    let (size, mut seal) = (size_of::<armrs_arm>(), 0);
    let memory = (&raw mut arm).cast::<u8>();
    // SAFETY: all pointers are good.
    unsafe {
        assert_eq!(armrs_seal(memory.cast(), size, &mut seal), ARMRS_OK);
        assert_eq!(armrs_verify(memory.cast(), size, seal), ARMRS_OK);
        for bit in 0..8 * size {
            let place = memory.add(bit / 8);
            *place ^= 1 << (bit % 8);
            assert_eq!(
                armrs_verify(memory.cast(), size, seal),
                ARMRS_CORRUPT,
                "bit {bit}"
            );
            *place ^= 1 << (bit % 8);
        }
        assert_eq!(armrs_seal(null(), 4, &mut seal), ARMRS_NULL);
        // The check value of CRC-32 (IEEE 802.3).
        assert_eq!(
            armrs_seal(c"123456789".as_ptr().cast(), 9, &mut seal),
            ARMRS_OK
        );
    }
    assert_eq!(seal, 0xCBF4_3926);
}

#[test]
fn the_version_of_the_header_is_that_of_the_library() {
    let header = include_str!("../../include/armrs.h");
    let line = format!("#define ARMRS_VERSION \"{}\"", env!("CARGO_PKG_VERSION"));
    assert!(header.contains(&line));
}
