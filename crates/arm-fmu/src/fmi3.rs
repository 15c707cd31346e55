//! FMI 3.0: all functions of `fmi3Functions.h`, those of co-simulation and Model Exchange with life, the others refused with a message.

use std::ffi::{c_char, c_int, c_void};
use std::path::PathBuf;

use arm_cosim::{Slave, Status};

use crate::exchange::exchange;
use crate::instance::{self, ERRORS, Handle, Instance, Log, guarded, unsupported};
use crate::pointers::{error, give, read, text, write};
use crate::refused::{refused, without_variables};
use crate::resources;
use crate::shared::shared;

type Message = Option<unsafe extern "C" fn(Handle, c_int, *const c_char, *const c_char)>;
/// A callback that is never called.
type Unused = *const c_void;

/// The version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Makes an instance of the arm in the resources; null when it is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resource_path: *const c_char,
    _visible: u8,
    logging: u8,
    event_mode_used: u8,
    _early_return_allowed: u8,
    _intermediate: *const u32,
    n_intermediate: usize,
    environment: Handle,
    message: Message,
    _intermediate_update: Unused,
) -> Handle {
    let log = Log::Three {
        message,
        environment,
    };
    // SAFETY: see `pointers`.
    let (token, folder) = unsafe { (text(token), text(resource_path)) };
    Instance::handle(log, logging != 0, || {
        if event_mode_used != 0 {
            return Err(error("event mode was asked for, this FMU has none"));
        }
        if n_intermediate > 0 {
            return Err(error(
                "intermediate update was asked for, this FMU has none",
            ));
        }
        resources::open(folder.map(PathBuf::from), token, Slave::new)
    })
}

/// Makes an instance of the arm in the resources that the importer integrates; null when it is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    _name: *const c_char,
    token: *const c_char,
    resource_path: *const c_char,
    _visible: u8,
    logging: u8,
    environment: Handle,
    message: Message,
) -> Handle {
    let log = Log::Three {
        message,
        environment,
    };
    // SAFETY: see `pointers`.
    let (token, folder) = unsafe { (text(token), text(resource_path)) };
    Instance::handle(log, logging != 0, || {
        resources::open(folder.map(PathBuf::from), token, Slave::for_exchange)
    })
}

/// Refused: this FMU is for co-simulation and Model Exchange.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
    _name: *const c_char,
    _token: *const c_char,
    _resource_path: *const c_char,
    _visible: u8,
    _logging: u8,
    environment: Handle,
    message: Message,
    _clock_update: Unused,
    _lock: Unused,
    _unlock: Unused,
) -> Handle {
    let log = Log::Three {
        message,
        environment,
    };
    log.tell(
        Status::Error,
        ERRORS,
        "scheduled execution was asked for, this FMU is for co-simulation and Model Exchange",
    );
    std::ptr::null_mut()
}

/// Begins the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: Handle,
    _tolerance_defined: u8,
    _tolerance: f64,
    start: f64,
    stop_defined: u8,
    stop: f64,
) -> c_int {
    let stop = (stop_defined != 0).then_some(stop);
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3EnterInitializationMode", |s| {
            s.enter_initialization_mode(start, stop)
        })
    }
}

/// Reads variables.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: Handle,
    references: *const u32,
    n: usize,
    values: *mut f64,
    n_values: usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3GetFloat64", |s| {
            s.get(read(references, n)?, write(values, n_values)?)
        })
    }
}

/// Sets variables, all or none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: Handle,
    references: *const u32,
    n: usize,
    values: *const f64,
    n_values: usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3SetFloat64", |s| {
            s.set(read(references, n)?, read(values, n_values)?)
        })
    }
}

/// Makes a communication step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: Handle,
    time: f64,
    step: f64,
    _no_set_state_before: u8,
    event_handling_needed: *mut u8,
    terminate: *mut u8,
    early_return: *mut u8,
    last_successful_time: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3DoStep", |s| {
            let done = s.do_step(time, step);
            for flag in [event_handling_needed, terminate, early_return] {
                give(flag, 0);
            }
            give(last_successful_time, s.time());
            done
        })
    }
}

/// Reads first time derivatives of outputs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetOutputDerivatives(
    instance: Handle,
    references: *const u32,
    n: usize,
    orders: *const i32,
    values: *mut f64,
    n_values: usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3GetOutputDerivatives", |s| {
            s.output_derivatives(
                read(references, n)?,
                read(orders, n)?,
                write(values, n_values)?,
            )
        })
    }
}

/// Reads directional derivatives.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetDirectionalDerivative(
    instance: Handle,
    unknowns: *const u32,
    n_unknowns: usize,
    knowns: *const u32,
    n_knowns: usize,
    seed: *const f64,
    n_seed: usize,
    derivative: *mut f64,
    n_derivative: usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3GetDirectionalDerivative", |s| {
            s.directional_derivative(
                read(unknowns, n_unknowns)?,
                read(knowns, n_knowns)?,
                read(seed, n_seed)?,
                write(derivative, n_derivative)?,
            )
        })
    }
}

/// Updates discrete states, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    instance: Handle,
    again: *mut u8,
    terminate: *mut u8,
    nominals_changed: *mut u8,
    values_changed: *mut u8,
    next_event_defined: *mut u8,
    next_event: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3UpdateDiscreteStates", |s| {
            s.update_discrete_states()?;
            for flag in [
                again,
                terminate,
                nominals_changed,
                values_changed,
                next_event_defined,
            ] {
                give(flag, 0);
            }
            give(next_event, 0.0);
            Ok(())
        })
    }
}

/// Returns the number of event indicators: none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetNumberOfEventIndicators(
    instance: Handle,
    number: *mut usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3GetNumberOfEventIndicators", |_| {
            give(number, 0);
            Ok(())
        })
    }
}

/// Returns the number of continuous states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetNumberOfContinuousStates(
    instance: Handle,
    number: *mut usize,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi3GetNumberOfContinuousStates", |s| {
            give(number, s.states());
            Ok(())
        })
    }
}

exchange! {
    truth: u8,
    enter_event: fmi3EnterEventMode,
    enter_continuous: fmi3EnterContinuousTimeMode,
    completed_step: fmi3CompletedIntegratorStep,
    set_time: fmi3SetTime,
    set_states: fmi3SetContinuousStates,
    states: fmi3GetContinuousStates,
    derivatives: fmi3GetContinuousStateDerivatives,
    indicators: fmi3GetEventIndicators,
    nominals: fmi3GetNominalsOfContinuousStates,
}

shared! {
    truth: u8,
    logging: fmi3SetDebugLogging,
    free: fmi3FreeInstance,
    exit_initialization: fmi3ExitInitializationMode,
    terminate: fmi3Terminate,
    reset: fmi3Reset,
    get_state: fmi3GetFMUState,
    set_state: fmi3SetFMUState,
    free_state: fmi3FreeFMUState,
    state_size: fmi3SerializedFMUStateSize,
    serialize: fmi3SerializeFMUState,
    deserialize: fmi3DeserializeFMUState,
}

without_variables! {
    fmi3GetFloat32(*mut f32, usize);
    fmi3GetInt8(*mut i8, usize);
    fmi3GetUInt8(*mut u8, usize);
    fmi3GetInt16(*mut i16, usize);
    fmi3GetUInt16(*mut u16, usize);
    fmi3GetInt32(*mut i32, usize);
    fmi3GetUInt32(*mut u32, usize);
    fmi3GetInt64(*mut i64, usize);
    fmi3GetUInt64(*mut u64, usize);
    fmi3GetBoolean(*mut u8, usize);
    fmi3GetString(*mut *const c_char, usize);
    fmi3GetBinary(*mut usize, *mut *const u8, usize);
    fmi3GetClock(*mut u8);
    fmi3SetFloat32(*const f32, usize);
    fmi3SetInt8(*const i8, usize);
    fmi3SetUInt8(*const u8, usize);
    fmi3SetInt16(*const i16, usize);
    fmi3SetUInt16(*const u16, usize);
    fmi3SetInt32(*const i32, usize);
    fmi3SetUInt32(*const u32, usize);
    fmi3SetInt64(*const i64, usize);
    fmi3SetUInt64(*const u64, usize);
    fmi3SetBoolean(*const u8, usize);
    fmi3SetString(*const *const c_char, usize);
    fmi3SetBinary(*const usize, *const *const u8, usize);
    fmi3SetClock(*const u8);
    fmi3GetAdjointDerivative(*const u32, usize, *const f64, usize, *mut f64, usize);
    fmi3GetIntervalDecimal(*mut f64, *mut c_int);
    fmi3GetIntervalFraction(*mut u64, *mut u64, *mut c_int);
    fmi3GetShiftDecimal(*mut f64);
    fmi3GetShiftFraction(*mut u64, *mut u64);
    fmi3SetIntervalDecimal(*const f64);
    fmi3SetIntervalFraction(*const u64, *const u64);
    fmi3SetShiftDecimal(*const f64);
    fmi3SetShiftFraction(*const u64, *const u64);
}

refused! {
    fmi3GetNumberOfVariableDependencies(u32, *mut usize);
    fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3EvaluateDiscreteStates();
    fmi3EnterStepMode();
    fmi3ActivateModelPartition(u32, f64);
}
