//! Checksum that shows whether memory has changed.

use core::ffi::c_void;

use arm_capi_online::armrs_status::{self, ARMRS_CORRUPT, ARMRS_NULL};
use arm_capi_online::call::{ended, place};

/// Seals memory with its CRC-32 (IEEE 802.3): an arm or a compensation once it is made, an estimator before it is saved. Five
/// instructions for each bit of it, about 40 for each byte: not for every period.
///
/// # Safety
/// `memory` is null or points to `size` bytes; `seal` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_seal(
    memory: *const c_void,
    size: usize,
    seal: *mut u32,
) -> armrs_status {
    let run = || {
        // SAFETY: as promised by the caller.
        let seal = unsafe { place(seal)? };
        // SAFETY: as promised by the caller.
        *seal = unsafe { crc(memory, size)? };
        Ok(())
    };
    ended(run())
}

/// ARMRS_OK where memory has the seal that it was given, else ARMRS_CORRUPT: bits have flipped, or what was saved and read back
/// is something else.
///
/// # Safety
/// `memory` is null or points to `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armrs_verify(
    memory: *const c_void,
    size: usize,
    seal: u32,
) -> armrs_status {
    // SAFETY: as promised by the caller.
    let found = unsafe { crc(memory, size) };
    ended(found.and_then(|found| {
        if found == seal {
            Ok(())
        } else {
            Err(ARMRS_CORRUPT)
        }
    }))
}

/// The bits of the polynomial, reversed.
const POLYNOMIAL: u32 = 0xEDB8_8320;

/// # Safety
/// `memory` is null or points to `size` bytes.
unsafe fn crc(memory: *const c_void, size: usize) -> Result<u32, armrs_status> {
    let bytes = memory.cast::<u8>();
    if bytes.is_null() {
        return Err(ARMRS_NULL);
    }
    let mut crc = !0_u32;
    for at in 0..size {
        // A byte at a time through a volatile read: the memory is the caller's, and what lies between fields has no type.
        // SAFETY: as promised by the caller.
        crc ^= u32::from(unsafe { bytes.wrapping_add(at).read_volatile() });
        for _ in 0..8 {
            crc = (crc >> 1) ^ (POLYNOMIAL & (crc & 1).wrapping_neg());
        }
    }
    Ok(!crc)
}
