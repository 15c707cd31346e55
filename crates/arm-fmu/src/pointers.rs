//! Arguments from C. The importer guarantees what the standards require: pointers are null or valid for the number of elements
//! given with them, strings end with a zero byte, and an instance is used by one thread at a time and not after it was freed.

use std::alloc::Layout;
use std::ffi::{CStr, c_char};

use arm_cosim::{Refused, Status};

/// A refusal as an error.
pub fn error(message: impl Into<String>) -> Refused {
    Refused {
        status: Status::Error,
        message: message.into(),
    }
}

/// Refuses what cannot be an array: a null pointer, or more bytes than there are addresses.
fn possible<T>(start: *const T, n: usize) -> Result<(), Refused> {
    if start.is_null() {
        return Err(error("a null pointer was given for an array"));
    }
    match Layout::array::<T>(n) {
        Ok(_) => Ok(()),
        Err(_) => Err(error(format!(
            "{n} elements are more than an array can have"
        ))),
    }
}

/// An array of `n` elements; empty arrays may be null.
///
/// # Safety
/// See the module.
pub unsafe fn read<'a, T>(start: *const T, n: usize) -> Result<&'a [T], Refused> {
    if n == 0 {
        return Ok(&[]);
    }
    possible(start, n)?;
    // SAFETY: not null, of a possible size, and valid for `n` elements as the importer promises.
    Ok(unsafe { std::slice::from_raw_parts(start, n) })
}

/// An array of `n` elements to be written.
///
/// # Safety
/// See the module.
pub unsafe fn write<'a, T>(start: *mut T, n: usize) -> Result<&'a mut [T], Refused> {
    if n == 0 {
        return Ok(&mut []);
    }
    possible(start, n)?;
    // SAFETY: as in `read`.
    Ok(unsafe { std::slice::from_raw_parts_mut(start, n) })
}

/// Writes one value to the pointer of the importer; nothing if that is null.
///
/// # Safety
/// See the module.
pub unsafe fn give<T>(place: *mut T, value: T) {
    if !place.is_null() {
        // SAFETY: not null, and valid as the importer promises.
        unsafe { place.write(value) }
    }
}

/// A text; nothing for a null pointer. Bytes that are not UTF-8 are replaced.
///
/// # Safety
/// See the module.
pub unsafe fn text(start: *const c_char) -> Option<String> {
    if start.is_null() {
        return None;
    }
    // SAFETY: not null, and ended by a zero byte as the importer promises.
    let text = unsafe { CStr::from_ptr(start) };
    Some(text.to_string_lossy().into_owned())
}
