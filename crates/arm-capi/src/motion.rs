//! Movements: a sample of one, and paths through waypoints.

use core::mem::MaybeUninit;

use arm_core::effect::Motion;
use arm_core::{Joints, Limits, Path, Route, Shape};

use crate::held::{Held, held};
use crate::status::{
    ARMRS_OUT_OF_RANGE, Refusal, armrs_problem, armrs_status, ended, finite, given, numbers, place,
    told,
};
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

/// Farthest angle of a waypoint [rad]: a hundred turns.
const FARTHEST: armrs_real = 628.0;

/// Makes a path.
///
/// `waypoints`: `count` times ARMRS_JOINTS angles [rad], waypoint by waypoint, 1 to ARMRS_WAYPOINTS of them. `limits`: one for each joint.
/// `pause`: time at rest in each waypoint between [s]. `smooth`: 0 for trapezoidal speed, else continuous acceleration.
/// Angles lie within 628 rad. `problem`, if not null, says what was refused.
///
/// cbindgen:ptrs-as-arrays=[[limits; ARMRS_JOINTS]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_path_init(
    path: *mut armrs_path,
    waypoints: *const armrs_real,
    count: usize,
    limits: *const armrs_limits,
    pause: armrs_real,
    smooth: u32,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (path, limits) = unsafe {
            (
                place(path)?,
                given(limits.cast::<[armrs_limits; ARMRS_JOINTS]>())?,
            )
        };
        let mut points = [joints(&[0.0; ARMRS_JOINTS]); ARMRS_WAYPOINTS];
        let allowed = [count as armrs_real, 1.0, ARMRS_WAYPOINTS as armrs_real];
        let many = || Refusal::named(ARMRS_OUT_OF_RANGE, ["number of waypoints", ""], 0);
        let used = points
            .get_mut(..count)
            .ok_or_else(|| many().numbers(allowed))?;
        for (i, point) in used.iter_mut().enumerate() {
            // SAFETY: there are `count` waypoints.
            *point = joints(unsafe { numbers(waypoints.wrapping_add(i * ARMRS_JOINTS))? });
            // What no speed could reach in a time that can be told.
            let far = point.iter().find(|q| q.abs() > FARTHEST);
            if let Some(&q) = far {
                let numbers = [q, -FARTHEST, FARTHEST];
                let refusal = Refusal::named(ARMRS_OUT_OF_RANGE, ["angle of waypoint", ""], i);
                return Err(refusal.numbers(numbers));
            }
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
        let route: Core = Route::new(&Path::new(shape, used, limits, pause)?)?;
        finite([route.duration()])?;
        path.keep(&route);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { told(run(), problem) }
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
            q: finite(array(&found.q))?,
            qd: finite(array(&found.qd))?,
            qdd: finite(array(&found.qdd))?,
        };
        Ok(())
    };
    ended(run())
}
