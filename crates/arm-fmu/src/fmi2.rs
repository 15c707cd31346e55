//! FMI 2.0: all functions of `fmi2Functions.h`, those of co-simulation and Model Exchange with life, the others refused with a message.

use std::ffi::{CString, c_char, c_int, c_void};

use arm_cosim::Slave;

use crate::exchange::exchange;
use crate::instance::{self, Handle, Instance, Log, guarded, unsupported};
use crate::pointers::{error, give, read, text, write};
use crate::refused::{refused, without_variables};
use crate::resources;
use crate::shared::shared;

/// `fmi2ModelExchange`.
const MODEL_EXCHANGE: c_int = 0;
/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2Terminated`.
const TERMINATED: c_int = 3;

/// The callbacks of an importer; only the logger and its environment are used.
#[repr(C)]
pub struct Callbacks {
    /// Takes messages in the way of `printf`.
    pub logger: Option<
        unsafe extern "C" fn(Handle, *const c_char, c_int, *const c_char, *const c_char, ...),
    >,
    /// Not used.
    pub allocate: *const c_void,
    /// Not used.
    pub free: *const c_void,
    /// Not used.
    pub step_finished: *const c_void,
    /// Handed back to the logger.
    pub environment: Handle,
}

/// What an update of discrete states comes to.
#[repr(C)]
pub struct EventInfo {
    /// Whether another update is needed.
    pub again: c_int,
    /// Whether the run is to end.
    pub terminate: c_int,
    /// Whether nominal values changed.
    pub nominals_changed: c_int,
    /// Whether continuous states changed.
    pub values_changed: c_int,
    /// Whether the next event is known.
    pub next_event_defined: c_int,
    /// Its time.
    pub next_event: f64,
}

/// Sizes of the types.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// The version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Makes an instance of the arm in the resources; null when it is refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resource_location: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    logging: c_int,
) -> Handle {
    // SAFETY: see `pointers`.
    let (name, guid, uri) = unsafe { (text(name), text(guid), text(resource_location)) };
    // SAFETY: null, or valid as the importer promises.
    let callbacks = unsafe { callbacks.as_ref() };
    let log = Log::Two {
        message: callbacks.and_then(|c| c.logger),
        environment: callbacks.map_or(std::ptr::null_mut(), |c| c.environment),
        instance: CString::new(name.unwrap_or_default()).unwrap_or_default(),
    };
    Instance::handle(log, logging != 0, || {
        let make = match kind {
            CO_SIMULATION => Slave::new,
            MODEL_EXCHANGE => Slave::for_exchange,
            other => {
                return Err(error(format!(
                    "the interface {other} was asked for, known are {MODEL_EXCHANGE} and {CO_SIMULATION}"
                )));
            }
        };
        let folder = uri.map(|uri| resources::path_of_uri(&uri)).transpose()?;
        resources::open(folder, guid, make)
    })
}

/// Takes start and stop time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    instance: Handle,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2SetupExperiment", |s| {
            s.set_experiment(start, (stop_defined != 0).then_some(stop))
        })
    }
}

/// Begins the initialization.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(instance: Handle) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2EnterInitializationMode", |s| {
            let (start, stop) = s.experiment();
            s.enter_initialization_mode(start, Some(stop))
        })
    }
}

/// Reads variables.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    instance: Handle,
    references: *const u32,
    n: usize,
    values: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2GetReal", |s| {
            s.get(read(references, n)?, write(values, n)?)
        })
    }
}

/// Sets variables, all or none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    instance: Handle,
    references: *const u32,
    n: usize,
    values: *const f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2SetReal", |s| {
            s.set(read(references, n)?, read(values, n)?)
        })
    }
}

/// Makes a communication step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    instance: Handle,
    time: f64,
    step: f64,
    _no_set_state_before: c_int,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe { guarded(instance, "fmi2DoStep", |s| s.do_step(time, step)) }
}

/// Sets how inputs go on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    instance: Handle,
    references: *const u32,
    n: usize,
    orders: *const c_int,
    values: *const f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2SetRealInputDerivatives", |s| {
            s.set_input_derivatives(read(references, n)?, read(orders, n)?, read(values, n)?)
        })
    }
}

/// Reads first time derivatives of outputs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    instance: Handle,
    references: *const u32,
    n: usize,
    orders: *const c_int,
    values: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2GetRealOutputDerivatives", |s| {
            s.output_derivatives(read(references, n)?, read(orders, n)?, write(values, n)?)
        })
    }
}

/// Returns the end time of the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(
    instance: Handle,
    kind: c_int,
    value: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2GetRealStatus", |s| match kind {
            LAST_SUCCESSFUL_TIME => {
                give(value, s.time());
                Ok(())
            }
            _ => Err(error("only the last successful time is a number")),
        })
    }
}

/// Returns whether the slave requests to end: it never does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(
    instance: Handle,
    kind: c_int,
    value: *mut c_int,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2GetBooleanStatus", |_| match kind {
            TERMINATED => {
                give(value, 0);
                Ok(())
            }
            _ => Err(error("only the end of the run is true or false")),
        })
    }
}

/// Reads directional derivatives.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    instance: Handle,
    unknowns: *const u32,
    n_unknowns: usize,
    knowns: *const u32,
    n_knowns: usize,
    seed: *const f64,
    derivative: *mut f64,
) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2GetDirectionalDerivative", |s| {
            s.directional_derivative(
                read(unknowns, n_unknowns)?,
                read(knowns, n_knowns)?,
                read(seed, n_knowns)?,
                write(derivative, n_unknowns)?,
            )
        })
    }
}

/// Updates discrete states, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2NewDiscreteStates(instance: Handle, info: *mut EventInfo) -> c_int {
    // SAFETY: see `pointers`.
    unsafe {
        guarded(instance, "fmi2NewDiscreteStates", |s| {
            s.update_discrete_states()?;
            let nothing = EventInfo {
                again: 0,
                terminate: 0,
                nominals_changed: 0,
                values_changed: 0,
                next_event_defined: 0,
                next_event: 0.0,
            };
            give(info, nothing);
            Ok(())
        })
    }
}

exchange! {
    truth: c_int,
    enter_event: fmi2EnterEventMode,
    enter_continuous: fmi2EnterContinuousTimeMode,
    completed_step: fmi2CompletedIntegratorStep,
    set_time: fmi2SetTime,
    set_states: fmi2SetContinuousStates,
    states: fmi2GetContinuousStates,
    derivatives: fmi2GetDerivatives,
    indicators: fmi2GetEventIndicators,
    nominals: fmi2GetNominalsOfContinuousStates,
}

shared! {
    truth: c_int,
    logging: fmi2SetDebugLogging,
    free: fmi2FreeInstance,
    exit_initialization: fmi2ExitInitializationMode,
    terminate: fmi2Terminate,
    reset: fmi2Reset,
    get_state: fmi2GetFMUstate,
    set_state: fmi2SetFMUstate,
    free_state: fmi2FreeFMUstate,
    state_size: fmi2SerializedFMUstateSize,
    serialize: fmi2SerializeFMUstate,
    deserialize: fmi2DeSerializeFMUstate,
}

without_variables! {
    fmi2GetInteger(*mut c_int);
    fmi2GetBoolean(*mut c_int);
    fmi2GetString(*mut *const c_char);
    fmi2SetInteger(*const c_int);
    fmi2SetBoolean(*const c_int);
    fmi2SetString(*const *const c_char);
}

refused! {
    fmi2CancelStep();
    fmi2GetStatus(c_int, *mut c_int);
    fmi2GetIntegerStatus(c_int, *mut c_int);
    fmi2GetStringStatus(c_int, *mut *const c_char);
}
