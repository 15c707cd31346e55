//! Movements: a sample of one, and paths through waypoints.

use core::ffi::c_int;
use core::mem::MaybeUninit;

use arm_core::effect::Motion;
use arm_core::{Joints, Limits, Path, Route, Shape};

use crate::held::{Held, held};
use crate::status::{ARMRS_OUT_OF_RANGE, armrs_status, ended, finite, given, place};
use crate::{ARMRS_JOINTS, ARMRS_WAYPOINTS, armrs_real};

/// Motion of the joints at one instant.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct armrs_motion {
    /// Time since the start [s].
    pub time: armrs_real,
    /// Angles [rad].
    pub q: [armrs_real; ARMRS_JOINTS],
    /// Speeds [rad/s].
    pub qd: [armrs_real; ARMRS_JOINTS],
    /// Accelerations [rad/s^2].
    pub qdd: [armrs_real; ARMRS_JOINTS],
}

impl armrs_motion {
    pub(crate) fn core(&self) -> Result<Motion<armrs_real, ARMRS_JOINTS>, armrs_status> {
        let [time] = finite([self.time])?;
        let (q, qd) = (finite(self.q)?, finite(self.qd)?);
        let mut motion = Motion::new(time, joints(&q), joints(&qd));
        motion.qdd = joints(&finite(self.qdd)?);
        Ok(motion)
    }

    /// Without its accelerations, for what does not read them.
    pub(crate) fn still(&self) -> Self {
        Self {
            qdd: [0.0; ARMRS_JOINTS],
            ..*self
        }
    }
}

pub(crate) fn joints(values: &[armrs_real; ARMRS_JOINTS]) -> Joints<armrs_real, ARMRS_JOINTS> {
    (*values).into()
}

pub(crate) fn array(values: &Joints<armrs_real, ARMRS_JOINTS>) -> [armrs_real; ARMRS_JOINTS] {
    (*values).into()
}

/// What a movement must not exceed.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_limits {
    /// Speed [rad/s].
    pub speed: armrs_real,
    /// Acceleration [rad/s^2].
    pub acceleration: armrs_real,
}

/// Joints led together on straight lines through waypoints, at rest in each.
#[repr(C)]
pub struct armrs_path {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_PATH_WORDS],
}

/// Size of an `armrs_path`.
#[cfg(not(feature = "single"))]
pub const ARMRS_PATH_WORDS: usize = 164;
/// Size of an `armrs_path`.
#[cfg(feature = "single")]
pub const ARMRS_PATH_WORDS: usize = 84;

type Core = Route<armrs_real, ARMRS_JOINTS, ARMRS_WAYPOINTS>;

held!(armrs_path holds Core, b"path 0.1");

/// Makes a path.
///
/// `waypoints`: `count` times ARMRS_JOINTS angles [rad], 1 to ARMRS_WAYPOINTS of them. `limits`: one for each joint.
/// `pause`: time at rest in each waypoint between [s]. `smooth`: 0 for trapezoidal speed, else continuous acceleration.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_path_init(
    path: *mut armrs_path,
    waypoints: *const [armrs_real; ARMRS_JOINTS],
    count: usize,
    limits: *const [armrs_limits; ARMRS_JOINTS],
    pause: armrs_real,
    smooth: c_int,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (path, limits) = unsafe { (place(path)?, given(limits)?) };
        let mut points = [joints(&[0.0; ARMRS_JOINTS]); ARMRS_WAYPOINTS];
        let used = points.get_mut(..count).ok_or(ARMRS_OUT_OF_RANGE)?;
        for (i, point) in used.iter_mut().enumerate() {
            // SAFETY: there are `count` waypoints.
            *point = joints(unsafe { given(waypoints.wrapping_add(i))? });
        }
        let limits = limits.map(|l| Limits {
            speed: l.speed,
            acceleration: l.acceleration,
        });
        let shape = if smooth == 0 {
            Shape::Trapezoid
        } else {
            Shape::Smooth
        };
        path.keep(&Route::new(&Path::new(shape, used, limits, pause)?)?);
        Ok(())
    };
    ended(run())
}

/// Time from the first to the last waypoint [s].
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_path_duration(
    path: *const armrs_path,
    duration: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (path, duration) = unsafe { (given(path)?, place(duration)?) };
        *duration = path.inner()?.duration();
        Ok(())
    };
    ended(run())
}

/// The motion at a time [s]; at rest before zero and after the end.
///
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_path_at(
    path: *const armrs_path,
    time: armrs_real,
    motion: *mut armrs_motion,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (path, motion) = unsafe { (given(path)?, place(motion)?) };
        let [time] = finite([time])?;
        let found = path.inner()?.at(time);
        *motion = armrs_motion {
            time,
            q: array(&found.q),
            qd: array(&found.qd),
            qdd: array(&found.qdd),
        };
        Ok(())
    };
    ended(run())
}
