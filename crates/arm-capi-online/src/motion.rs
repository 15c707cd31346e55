//! Movements: samples, and paths through waypoints.

use core::mem::MaybeUninit;

use arm_core::Route;
use arm_core::effect::Motion;

use crate::armrs_status;
use crate::call::{array, ended, finite, given, joints, place};
use crate::held::{Held, held};
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
    /// As the core has it; an error for what is not finite.
    pub fn core(&self) -> Result<Motion<armrs_real, ARMRS_JOINTS>, armrs_status> {
        let [time] = finite([self.time])?;
        let (q, qd) = (finite(self.q)?, finite(self.qd)?);
        let mut motion = Motion::new(time, joints(&q), joints(&qd));
        motion.qdd = joints(&finite(self.qdd)?);
        Ok(motion)
    }

    /// Without its accelerations, for what does not read them.
    pub fn still(&self) -> Self {
        Self {
            qdd: [0.0; ARMRS_JOINTS],
            ..*self
        }
    }
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
