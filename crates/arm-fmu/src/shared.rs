//! Functions that FMI 2.0 and 3.0 have in the same shape; only their names differ, and what a truth value is in C.

/// Writes out the functions of one version.
macro_rules! shared {
    (
        truth: $truth:ty,
        logging: $logging:ident,
        free: $free:ident,
        exit_initialization: $exit:ident,
        terminate: $terminate:ident,
        reset: $reset:ident,
        get_state: $get_state:ident,
        set_state: $set_state:ident,
        free_state: $free_state:ident,
        state_size: $state_size:ident,
        serialize: $serialize:ident,
        deserialize: $deserialize:ident,
    ) => {
        /// Switches the log of events on or off; errors are always logged.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $logging(
            instance: Handle,
            on: $truth,
            n: usize,
            categories: *const *const c_char,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                instance::with(instance, stringify!($logging), |i| {
                    let names: Vec<_> = read(categories, n)?
                        .iter()
                        .filter_map(|c| text(*c))
                        .collect();
                    i.set_logging(on != 0, &names)
                })
            }
        }

        /// Frees an instance; null is nothing to free.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $free(instance: Handle) {
            // SAFETY: see `pointers`.
            unsafe { instance::free(instance) }
        }

        /// Ends the initialization.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $exit(instance: Handle) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($exit), |s| {
                    s.exit_initialization_mode()
                })
            }
        }

        /// Ends the run.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $terminate(instance: Handle) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { guarded(instance, stringify!($terminate), |s| s.terminate()) }
        }

        /// Goes back to how the instance was made.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $reset(instance: Handle) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { guarded(instance, stringify!($reset), |s| s.reset()) }
        }

        /// Keeps the state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get_state(instance: Handle, state: *mut *mut c_void) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { instance::get_state(instance, stringify!($get_state), state) }
        }

        /// Goes back to a state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set_state(instance: Handle, state: *mut c_void) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { instance::set_state(instance, stringify!($set_state), state) }
        }

        /// Frees a state; null is nothing to free.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $free_state(instance: Handle, state: *mut *mut c_void) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { instance::free_state(instance, stringify!($free_state), state) }
        }

        /// Returns the number of bytes of a state.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $state_size(
            instance: Handle,
            state: *mut c_void,
            size: *mut usize,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { instance::state_size(instance, stringify!($state_size), state, size) }
        }

        /// Writes a state as bytes.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $serialize(
            instance: Handle,
            state: *mut c_void,
            bytes: *mut u8,
            size: usize,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { instance::serialize(instance, stringify!($serialize), state, (bytes, size)) }
        }

        /// Makes a state from bytes.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $deserialize(
            instance: Handle,
            bytes: *const u8,
            size: usize,
            state: *mut *mut c_void,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                instance::deserialize(instance, stringify!($deserialize), (bytes, size), state)
            }
        }
    };
}

pub(crate) use shared;
