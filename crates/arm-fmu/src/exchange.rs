//! Functions of Model Exchange that FMI 2.0 and 3.0 share.

/// Writes out the functions of one version.
macro_rules! exchange {
    (
        truth: $truth:ty,
        enter_event: $event:ident,
        enter_continuous: $continuous:ident,
        completed_step: $completed:ident,
        set_time: $set_time:ident,
        set_states: $set_states:ident,
        states: $states:ident,
        derivatives: $derivatives:ident,
        indicators: $indicators:ident,
        nominals: $nominals:ident,
    ) => {
        /// Interrupts the integration.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $event(instance: Handle) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { guarded(instance, stringify!($event), |s| s.enter_event_mode()) }
        }

        /// Begins the integration, or goes on with it.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $continuous(instance: Handle) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($continuous), |s| {
                    s.enter_continuous_time_mode()
                })
            }
        }

        /// Takes note of a step of the integrator: nothing happens in it.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $completed(
            instance: Handle,
            _no_set_state_before: $truth,
            enter_event_mode: *mut $truth,
            terminate: *mut $truth,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($completed), |s| {
                    s.completed_integrator_step()?;
                    give(enter_event_mode, 0);
                    give(terminate, 0);
                    Ok(())
                })
            }
        }

        /// Sets the time.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set_time(instance: Handle, time: f64) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { guarded(instance, stringify!($set_time), |s| s.set_time(time)) }
        }

        /// Sets the continuous states.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set_states(
            instance: Handle,
            values: *const f64,
            n: usize,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($set_states), |s| {
                    s.set_continuous_states(read(values, n)?)
                })
            }
        }

        /// Reads the continuous states.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $states(instance: Handle, values: *mut f64, n: usize) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($states), |s| {
                    s.continuous_states(write(values, n)?)
                })
            }
        }

        /// Reads the time derivatives of the continuous states.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $derivatives(
            instance: Handle,
            values: *mut f64,
            n: usize,
        ) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($derivatives), |s| {
                    s.state_derivatives(write(values, n)?)
                })
            }
        }

        /// Reads event indicators, of which there are none.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $indicators(instance: Handle, _: *mut f64, n: usize) -> c_int {
            // SAFETY: see `pointers`.
            unsafe { unsupported(instance, stringify!($indicators), n) }
        }

        /// Reads the usual sizes of the continuous states.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $nominals(instance: Handle, values: *mut f64, n: usize) -> c_int {
            // SAFETY: see `pointers`.
            unsafe {
                guarded(instance, stringify!($nominals), |s| {
                    s.nominals(write(values, n)?)
                })
            }
        }
    };
}

pub(crate) use exchange;
