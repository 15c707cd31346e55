//! Functions that the standards require and that this library refuses.

/// Functions that the standard requires in every library, refused here.
macro_rules! refused {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[doc = "Refused: not supported by this FMU."]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(instance: Handle $(, _: $argument)*) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { unsupported(instance, stringify!($name), 1) }
        }
    )*};
}

/// As `refused`, for functions on variables of a type that the arm has none of: none at all may be read or set.
macro_rules! without_variables {
    ($($name:ident($($argument:ty),*);)*) => {$(
        #[doc = "Refused for one variable or more: the arm has only those of 64 bit."]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(instance: Handle, _: *const u32, n: usize $(, _: $argument)*) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { unsupported(instance, stringify!($name), n) }
        }
    )*};
}

pub(crate) use {refused, without_variables};
