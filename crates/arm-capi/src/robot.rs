//! Functions that create the two-link robot that leads the hand.

use arm_capi_online::armrs_status;
use arm_capi_online::call::{numbers, place};
use arm_capi_online::held::Held;
use arm_core::{Elbow, Robot};

use crate::refusal::{armrs_problem, status_of};
use crate::{armrs_real, armrs_robot};

/// Makes a robot from two lengths and the position of its first joint [m]; `elbow_up`: on which side the elbow is, seen on
/// the line from base to handle.
///
/// cbindgen:ptrs-as-arrays=[[lengths; 2], [base; 2]]
/// # Safety
/// The pointers are null or point to what is said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_robot_init(
    robot: *mut armrs_robot,
    lengths: *const armrs_real,
    base: *const armrs_real,
    elbow_up: u32,
    problem: *mut armrs_problem,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let (robot, lengths, base) = unsafe { (place(robot)?, numbers(lengths)?, numbers(base)?) };
        let elbow = if elbow_up == 0 {
            Elbow::Down
        } else {
            Elbow::Up
        };
        robot.keep(&Robot::new(*lengths, *base, elbow)?);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}
