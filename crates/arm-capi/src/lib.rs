#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(not(any(target_os = "none", target_os = "unknown")))]
extern crate std;

mod arm;
mod compensation;
mod estimator;
mod layout;
mod monitor;
mod path;
mod refusal;
mod robot;
mod seal;

pub use arm::*;
pub use arm_capi_online::*;
pub use compensation::*;
pub use estimator::*;
pub use monitor::*;
pub use path::*;
pub use refusal::{ARMRS_WHAT, armrs_problem};
pub use robot::*;
pub use seal::*;

/// Declares the symbol that the header's `_init` macros refer to: of another precision, number of joints or version of the
/// interface it has another name, and a program does not link.
macro_rules! abi {
    ($($name:ident when $condition:meta;)*) => {$(
        /// The version of the interface. cbindgen:ignore
        #[cfg($condition)]
        #[unsafe(no_mangle)]
        pub extern "C" fn $name() -> u32 {
            3
        }
    )*};
}
abi! {
    armrs_abi_3_double_three_joints when not(any(feature = "single", feature = "two-joints"));
    armrs_abi_3_single_three_joints when all(feature = "single", not(feature = "two-joints"));
    armrs_abi_3_double_two_joints when all(not(feature = "single"), feature = "two-joints");
    armrs_abi_3_single_two_joints when all(feature = "single", feature = "two-joints");
}

/// Where no operating system ends a program there is nothing to unwind to. The function called here exists nowhere: if any
/// panic can be reached, the firmware does not link, and that is the proof that none can.
#[cfg(any(target_os = "none", target_os = "unknown"))]
#[panic_handler]
fn unreachable(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn armrs_panic_path_is_reachable() -> !;
    }
    // SAFETY: never executed, see above.
    unsafe { armrs_panic_path_is_reachable() }
}

/// Panics beyond the end of the table: the proof must see it.
///
/// # Safety
/// `table` points to four numbers.
#[cfg(feature = "panic-control")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_panic_control(table: *const armrs_real, index: usize) -> armrs_real {
    // SAFETY: as promised by the caller.
    let table = unsafe { core::slice::from_raw_parts(table, 4) };
    table[index]
}
