//! The two-link robot that leads the hand.

use core::mem::MaybeUninit;

use arm_core::{Joints, Robot};

use crate::call::{ended, finite, given, numbers, places};
use crate::held::{Held, held};
use crate::{armrs_real, armrs_status};

/// A robot of two links.
#[repr(C)]
pub struct armrs_robot {
    tag: u64,
    words: [MaybeUninit<u64>; ARMRS_ROBOT_WORDS],
}

/// Size of an `armrs_robot`.
pub const ARMRS_ROBOT_WORDS: usize = 5;

held!(armrs_robot holds Robot<armrs_real>, b"robot0.1");

/// Position of the handle at two joint angles [m].
///
/// cbindgen:ptrs-as-arrays=[[q; 2], [handle; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_robot_handle(
    robot: *const armrs_robot,
    q: *const armrs_real,
    handle: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (robot, q, handle) = unsafe { (given(robot)?, numbers::<2>(q)?, places(handle)?) };
        *handle = finite(robot.inner()?.handle(&Joints::<_, 2>::new(q[0], q[1])))?;
        Ok(())
    };
    ended(run())
}

/// Joint angles that hold the handle at a point [rad].
///
/// cbindgen:ptrs-as-arrays=[[handle; 2], [q; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_robot_angles(
    robot: *const armrs_robot,
    handle: *const armrs_real,
    q: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (robot, handle, q) = unsafe { (given(robot)?, numbers(handle)?, places(q)?) };
        *q = finite(robot.inner()?.angles(*handle)?.into())?;
        Ok(())
    };
    ended(run())
}

/// Joint speeds that move the handle [rad/s]. ARMRS_NOT_FINITE at full stretch, where there are none.
///
/// cbindgen:ptrs-as-arrays=[[q; 2], [velocity; 2], [speeds; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_robot_speeds(
    robot: *const armrs_robot,
    q: *const armrs_real,
    velocity: *const armrs_real,
    speeds: *mut armrs_real,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (robot, q) = unsafe { (given(robot)?, numbers::<2>(q)?) };
        // SAFETY: as promised by the caller.
        let (velocity, speeds) = unsafe { (numbers(velocity)?, places(speeds)?) };
        let q = Joints::<_, 2>::new(q[0], q[1]);
        *speeds = finite(robot.inner()?.speeds(&q, *velocity).into())?;
        Ok(())
    };
    ended(run())
}
