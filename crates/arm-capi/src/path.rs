//! Functions that create paths through waypoints.

use arm_capi_online::armrs_status::{self, *};
use arm_capi_online::call::{finite, given, joints, numbers, place};
use arm_capi_online::held::Held;
use arm_core::{Limits, Path, Route, Shape};

use crate::refusal::{Refusal, armrs_problem, status_of};
use crate::{ARMRS_JOINTS, ARMRS_WAYPOINTS, armrs_path, armrs_real};

/// What a movement must not exceed.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct armrs_limits {
    /// Speed [rad/s].
    pub speed: armrs_real,
    /// Acceleration [rad/s^2].
    pub acceleration: armrs_real,
}

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
        let route = Route::new(&Path::new(shape, used, limits, pause)?)?;
        finite([route.duration()])?;
        path.keep(&route);
        Ok(())
    };
    // SAFETY: as promised by the caller.
    unsafe { status_of(run(), problem) }
}
