//! One instance behind the pointer that an importer holds, and the status of every call on it.

use std::any::Any;
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use arm_cosim::{Refused, Slave, SlaveState, Status};

use crate::pointers::{error, give, read, write};

/// What an importer holds: an instance, or null.
pub type Handle = *mut c_void;

/// Category of messages on calls that were not done.
pub const ERRORS: &str = "logStatusError";
/// Category of messages on what an instance does.
pub const EVENTS: &str = "logEvents";

/// Where messages go.
#[derive(Clone)]
pub enum Log {
    /// FMI 3.0.
    Three {
        message: Option<unsafe extern "C" fn(Handle, c_int, *const c_char, *const c_char)>,
        environment: Handle,
    },
    /// FMI 2.0: in the way of `printf`.
    Two {
        message: Option<
            unsafe extern "C" fn(Handle, *const c_char, c_int, *const c_char, *const c_char, ...),
        >,
        environment: Handle,
        instance: CString,
    },
}

impl Log {
    /// Reports to the importer.
    pub fn tell(&self, status: Status, category: &str, text: &str) {
        let (category, text) = (zero_ended(category), zero_ended(text));
        match self {
            Self::Three {
                message: Some(message),
                environment,
            } => {
                // SAFETY: the importer's function, its environment, and texts that end with a zero byte.
                unsafe {
                    message(
                        *environment,
                        status as c_int,
                        category.as_ptr(),
                        text.as_ptr(),
                    )
                }
            }
            Self::Two {
                message: Some(message),
                environment,
                instance,
            } => {
                // SAFETY: as above. The text is an argument and never the format.
                unsafe {
                    message(
                        *environment,
                        instance.as_ptr(),
                        status as c_int,
                        category.as_ptr(),
                        c"%s".as_ptr(),
                        text.as_ptr(),
                    );
                }
            }
            Self::Three { message: None, .. } | Self::Two { message: None, .. } => {}
        }
    }
}

fn zero_ended(text: &str) -> CString {
    CString::new(text.replace('\0', "?")).unwrap_or_default()
}

/// An instance.
pub struct Instance {
    pub slave: Slave,
    pub log: Log,
    /// Whether events are logged.
    pub logging: bool,
    /// Lost to a panic.
    dead: bool,
}

impl Instance {
    /// The handle of a new instance; null, and a message, when it cannot be made.
    pub fn handle(
        log: Log,
        logging: bool,
        open: impl FnOnce() -> Result<Slave, Refused>,
    ) -> Handle {
        match catch_unwind(AssertUnwindSafe(open)) {
            Ok(Ok(slave)) => {
                if logging {
                    let text = format!("instantiated {:?}, {}", slave.spec().name, slave.token());
                    log.tell(Status::Ok, EVENTS, &text);
                }
                let instance = Self {
                    slave,
                    log,
                    logging,
                    dead: false,
                };
                Box::into_raw(Box::new(instance)).cast()
            }
            Ok(Err(refused)) => {
                log.tell(Status::Error, ERRORS, &refused.message);
                std::ptr::null_mut()
            }
            Err(panic) => {
                log.tell(Status::Fatal, ERRORS, &panic_text(&*panic));
                std::ptr::null_mut()
            }
        }
    }

    /// Sets which categories are logged; errors always are.
    pub fn set_logging(&mut self, on: bool, categories: &[String]) -> Result<(), Refused> {
        for category in categories {
            if category != ERRORS && category != EVENTS {
                return Err(error(format!(
                    "unknown log category {category:?}, known are {ERRORS} and {EVENTS}"
                )));
            }
        }
        self.logging = on && (categories.is_empty() || categories.iter().any(|c| c == EVENTS));
        Ok(())
    }
}

/// Does something with an instance and gives the status of the standards, whatever happens.
///
/// # Safety
/// `handle` is null or an instance that was not freed.
pub unsafe fn guarded(
    handle: Handle,
    what: &str,
    body: impl FnOnce(&mut Slave) -> Result<(), Refused>,
) -> c_int {
    // SAFETY: as promised.
    unsafe { with(handle, what, |instance| body(&mut instance.slave)) }
}

/// As [`guarded`], with the whole instance.
///
/// # Safety
/// As [`guarded`].
pub unsafe fn with(
    handle: Handle,
    what: &str,
    body: impl FnOnce(&mut Instance) -> Result<(), Refused>,
) -> c_int {
    // SAFETY: as promised.
    let Some(instance) = (unsafe { handle.cast::<Instance>().as_mut() }) else {
        return Status::Error as c_int;
    };
    let (status, message) = if instance.dead {
        (Status::Fatal, "the instance was lost before".to_owned())
    } else {
        match catch_unwind(AssertUnwindSafe(|| body(instance))) {
            Ok(Ok(())) => return Status::Ok as c_int,
            Ok(Err(refused)) => (refused.status, refused.message),
            Err(panic) => {
                instance.dead = true;
                (Status::Fatal, panic_text(&*panic))
            }
        }
    };
    instance
        .log
        .tell(status, ERRORS, &format!("{what}: {message}"));
    status as c_int
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("internal error: {}", text.unwrap_or("unknown"))
}

/// A call that is not supported. One for no variables at all is done.
///
/// # Safety
/// As [`guarded`].
pub unsafe fn unsupported(handle: Handle, what: &str, variables: usize) -> c_int {
    let refuse = |instance: &mut Instance| match variables {
        0 => Ok(()),
        _ => instance
            .slave
            .failed("not supported by this FMU".to_owned()),
    };
    // SAFETY: as promised.
    unsafe { with(handle, what, refuse) }
}

/// Frees an instance.
///
/// # Safety
/// As [`guarded`]; the handle is not used again.
pub unsafe fn free(handle: Handle) {
    if !handle.is_null() {
        // SAFETY: made by `Instance::handle` and not freed before, as promised.
        drop(unsafe { Box::from_raw(handle.cast::<Instance>()) });
    }
}

/// Writes the state into the one that `place` holds, or into a new one where it holds null.
///
/// # Safety
/// As [`guarded`]; what `place` holds is null or a state that was not freed.
pub unsafe fn get_state(handle: Handle, what: &str, place: *mut *mut c_void) -> c_int {
    let body = |slave: &mut Slave| {
        // SAFETY: null or a place for one state, as promised.
        let [held] = (unsafe { write(place, 1) })? else {
            return Err(error("no place for the state"));
        };
        // SAFETY: null or a state, as promised.
        match unsafe { held.cast::<SlaveState>().as_mut() } {
            Some(old) => *old = slave.state(),
            None => *held = Box::into_raw(Box::new(slave.state())).cast(),
        }
        Ok(())
    };
    // SAFETY: as promised.
    unsafe { guarded(handle, what, body) }
}

/// A state by its pointer.
///
/// # Safety
/// Null or a state that was not freed.
unsafe fn state<'a>(state: *mut c_void) -> Result<&'a SlaveState, Refused> {
    // SAFETY: as promised.
    unsafe { state.cast::<SlaveState>().as_ref() }.ok_or_else(|| error("the state is null"))
}

/// Goes back to a state.
///
/// # Safety
/// As [`get_state`].
pub unsafe fn set_state(handle: Handle, what: &str, from: *mut c_void) -> c_int {
    // SAFETY: as promised.
    unsafe { guarded(handle, what, |slave| slave.set_state(state(from)?)) }
}

/// Frees the state that `place` holds, and leaves null there; without a place there is nothing to free.
///
/// # Safety
/// As [`get_state`].
pub unsafe fn free_state(handle: Handle, what: &str, place: *mut *mut c_void) -> c_int {
    let body = |_: &mut Slave| {
        // SAFETY: null, or valid as the importer promises.
        if let Some(held) = unsafe { place.as_mut() }
            && !held.is_null()
        {
            // SAFETY: a state that was not freed, as promised.
            drop(unsafe { Box::from_raw(held.cast::<SlaveState>()) });
            *held = std::ptr::null_mut();
        }
        Ok(())
    };
    // SAFETY: as promised.
    unsafe { guarded(handle, what, body) }
}

/// Returns the number of bytes of a state.
///
/// # Safety
/// As [`get_state`].
pub unsafe fn state_size(handle: Handle, what: &str, of: *mut c_void, size: *mut usize) -> c_int {
    let body = |_: &mut Slave| {
        // SAFETY: as promised.
        unsafe { give(size, state(of)?.to_bytes().len()) };
        Ok(())
    };
    // SAFETY: as promised.
    unsafe { guarded(handle, what, body) }
}

/// Writes a state as bytes.
///
/// # Safety
/// As [`get_state`]; `to` has room for `size` bytes.
pub unsafe fn serialize(
    handle: Handle,
    what: &str,
    of: *mut c_void,
    (to, size): (*mut u8, usize),
) -> c_int {
    let body = |_: &mut Slave| {
        // SAFETY: as promised.
        let bytes = unsafe { state(of)? }.to_bytes();
        if size < bytes.len() {
            return Err(error(format!(
                "room for {size} bytes, the state has {}",
                bytes.len()
            )));
        }
        // SAFETY: as promised.
        let room = unsafe { write(to, size)? };
        room[..bytes.len()].copy_from_slice(&bytes);
        Ok(())
    };
    // SAFETY: as promised.
    unsafe { guarded(handle, what, body) }
}

/// Makes a state from bytes.
///
/// # Safety
/// As [`get_state`]; `from` has `size` bytes.
pub unsafe fn deserialize(
    handle: Handle,
    what: &str,
    (from, size): (*const u8, usize),
    place: *mut *mut c_void,
) -> c_int {
    let body = |_: &mut Slave| {
        // SAFETY: as promised.
        let state = SlaveState::from_bytes(unsafe { read(from, size)? })?;
        // SAFETY: null or a place for one state, as promised.
        let [held] = (unsafe { write(place, 1) })? else {
            return Err(error("no place for the state"));
        };
        *held = Box::into_raw(Box::new(state)).cast();
        Ok(())
    };
    // SAFETY: as promised.
    unsafe { guarded(handle, what, body) }
}
