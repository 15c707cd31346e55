//! The C interface with any numbers: a refusal, or results that are finite.
#![no_main]

use std::mem::MaybeUninit;

use armrs_c::armrs_status::ARMRS_OK;
use armrs_c::*;
use libfuzzer_sys::arbitrary::{self, Arbitrary};
use libfuzzer_sys::fuzz_target;

type Joints = [f64; ARMRS_JOINTS];

/// A number of a size that an arm has, or any bits.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Number {
    Tenths(i8),
    Any(f64),
}

impl Number {
    fn value(self) -> f64 {
        match self {
            Self::Tenths(n) => 0.1 * f64::from(n),
            Self::Any(value) => value,
        }
    }
}

fn values<const N: usize>(of: [Number; N]) -> [f64; N] {
    of.map(Number::value)
}

#[derive(Arbitrary, Debug)]
struct Effect {
    kind: u8,
    joint: u8,
    parameters: [Number; 6],
}

#[derive(Arbitrary, Debug)]
struct Moving {
    time: Number,
    q: [Number; ARMRS_JOINTS],
    qd: [Number; ARMRS_JOINTS],
    qdd: [Number; ARMRS_JOINTS],
}

#[derive(Arbitrary, Debug)]
enum Dynamics {
    Inverse,
    Forward,
}

#[derive(Arbitrary, Debug)]
enum Call {
    Advance(Moving, Number),
    Kinematics([Number; ARMRS_JOINTS]),
    Gravity([Number; ARMRS_JOINTS]),
    Dynamics(Dynamics, Moving, [Number; 6]),
    Path(Vec<[Number; ARMRS_JOINTS]>, [Number; 3], bool, Number),
    Learn([Number; 2], Box<[[Number; 12]; 4]>),
}

#[derive(Arbitrary, Debug)]
struct Case {
    segments: [[Number; 5]; ARMRS_JOINTS],
    /// An arm as arms are instead of these segments.
    sound: bool,
    base: [Number; 2],
    gravity: [Number; 2],
    effects: Vec<Effect>,
    calls: Vec<Call>,
}

/// Storage as C has it before `_init`: zeros.
fn empty<T>() -> T {
    // SAFETY: all structs of the interface are plain numbers.
    unsafe { MaybeUninit::zeroed().assume_init() }
}

impl Moving {
    fn motion(&self) -> armrs_motion {
        armrs_motion {
            time: self.time.value(),
            q: values(self.q),
            qd: values(self.qd),
            qdd: values(self.qdd),
        }
    }
}

fn load(of: [Number; 6]) -> armrs_load {
    let [a, b, c, y, z, moment] = values(of);
    armrs_load {
        torque: [a, b, c],
        force_on_arm: [y, z],
        moment_on_arm: moment,
    }
}

fn finite(status: armrs_status, out: &[f64]) {
    assert!(
        status != ARMRS_OK || out.iter().all(|v| v.is_finite()),
        "{out:?}"
    );
}

fn arm(case: &Case) -> Option<armrs_arm> {
    let segments = case.segments.map(|s| {
        let [length, mass, along, normal, inertia] = values(s);
        armrs_segment {
            length,
            mass,
            com: [along, normal],
            inertia,
        }
    });
    let sound = armrs_segment {
        length: 0.3,
        mass: 1.2,
        com: [0.15, 0.0],
        inertia: 0.009,
    };
    let segments = if case.sound {
        [sound; ARMRS_JOINTS]
    } else {
        segments
    };
    let effects: Vec<armrs_effect> = case
        .effects
        .iter()
        .map(|e| armrs_effect {
            kind: u32::from(e.kind),
            joint: u32::from(e.joint),
            parameters: values(e.parameters),
        })
        .collect();
    let (base, gravity) = (values(case.base), values(case.gravity));
    let (mut arm, mut problem): (armrs_arm, armrs_problem) = (empty(), empty());
    // SAFETY: all pointers are good.
    let status = unsafe {
        armrs_arm_init(
            &mut arm,
            segments.as_ptr(),
            base.as_ptr(),
            gravity.as_ptr(),
            effects.as_ptr(),
            effects.len(),
            &mut problem,
        )
    };
    (status == ARMRS_OK).then_some(arm)
}

fn path(
    waypoints: &[[Number; ARMRS_JOINTS]],
    [speed, acceleration, pause]: [Number; 3],
    smooth: bool,
    time: Number,
) {
    let points: Vec<Joints> = waypoints.iter().map(|w| values(*w)).collect();
    let limits = [armrs_limits {
        speed: speed.value(),
        acceleration: acceleration.value(),
    }; ARMRS_JOINTS];
    let (mut path, mut problem): (armrs_path, armrs_problem) = (empty(), empty());
    // SAFETY: all pointers are good.
    unsafe {
        let first = points.as_ptr().cast::<f64>();
        let init = armrs_path_init(
            &mut path,
            first,
            points.len(),
            limits.as_ptr(),
            pause.value(),
            u32::from(smooth),
            &mut problem,
        );
        let mut duration = 0.0;
        let status = armrs_path_duration(&path, &mut duration);
        assert_eq!(init == ARMRS_OK, status == ARMRS_OK);
        finite(status, &[duration]);
        let mut motion = armrs_motion::default();
        let status = armrs_path_at(&path, time.value(), &mut motion);
        finite(status, &[motion.q, motion.qd, motion.qdd].concat());
    }
}

fn learn(arm: &armrs_arm, [period, uncertainty]: [Number; 2], samples: &[[Number; 12]; 4]) {
    let (mut estimator, mut settings): (armrs_estimator, armrs_settings) = (empty(), empty());
    let mut problem: armrs_problem = empty();
    // SAFETY: all pointers are good.
    unsafe {
        if armrs_estimator_settings(&mut settings, arm, period.value()) != ARMRS_OK {
            return;
        }
        let uncertainty = uncertainty.value();
        let status =
            armrs_estimator_init(&mut estimator, arm, uncertainty, &settings, &mut problem);
        if status != ARMRS_OK {
            return;
        }
        for sample in samples {
            let [a, b, c, d, e, f, rest @ ..] = *sample;
            let sample = armrs_sample {
                q: values([a, b, c]),
                lead: values([d, e, f]),
                led: u32::from(a.value() > 0.0),
                load: load(rest),
            };
            let mut heed = armrs_sample_status::ARMRS_MISSING;
            armrs_estimator_update(&mut estimator, &sample, &mut heed);
            let motion = armrs_motion {
                q: sample.q,
                ..Default::default()
            };
            let (mut carry, mut sd) = ([0.0; ARMRS_JOINTS], [0.0; ARMRS_JOINTS]);
            let status =
                armrs_estimator_carry(&estimator, &motion, carry.as_mut_ptr(), sd.as_mut_ptr());
            finite(status, &[carry, sd].concat());
            let mut health: armrs_health = empty();
            let status = armrs_estimator_health(&estimator, &mut health);
            finite(status, &health.residual);
        }
    }
}

fuzz_target!(|case: Case| {
    let Some(mut arm) = arm(&case) else {
        return;
    };
    for call in &case.calls {
        let mut out: Joints = [0.0; ARMRS_JOINTS];
        // SAFETY: all pointers are good.
        unsafe {
            match call {
                Call::Advance(moving, period) => {
                    armrs_arm_advance(&mut arm, &moving.motion(), period.value());
                }
                Call::Kinematics(q) => {
                    let (q, mut tip, mut rows) = (values(*q), [0.0; 2], [[0.0; ARMRS_JOINTS]; 2]);
                    let status =
                        armrs_kinematics(&arm, q.as_ptr(), tip.as_mut_ptr(), rows.as_mut_ptr());
                    finite(status, &[tip.to_vec(), rows.concat()].concat());
                }
                Call::Gravity(q) => {
                    let q = values(*q);
                    let status = armrs_gravity(&arm, q.as_ptr(), out.as_mut_ptr());
                    finite(status, &out);
                }
                Call::Dynamics(which, moving, on) => {
                    let dynamics = match which {
                        Dynamics::Inverse => armrs_inverse_dynamics,
                        Dynamics::Forward => armrs_forward_dynamics,
                    };
                    let status = dynamics(&arm, &moving.motion(), &load(*on), out.as_mut_ptr());
                    finite(status, &out);
                }
                Call::Path(waypoints, limits, smooth, time) => {
                    path(waypoints, *limits, *smooth, *time)
                }
                Call::Learn(numbers, samples) => learn(&arm, *numbers, samples),
            }
        }
    }
});
