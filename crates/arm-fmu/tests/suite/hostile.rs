//! What an importer may do wrong: no crash, the right status, a message.

use std::ffi::{CString, c_int, c_void};
use std::ptr::{null, null_mut};

use arm_fmu::{fmi2, fmi3, guarded};

use crate::importer::{NOWHERE, Resources, do_step, get, logged, ready, three};

const ERROR: c_int = 3;
const FATAL: c_int = 4;

#[test]
fn nothing_is_an_error_and_nothing_to_free() {
    unsafe {
        let nothing = null_mut();
        fmi3::fmi3FreeInstance(nothing);
        fmi2::fmi2FreeInstance(nothing);
        assert_eq!(fmi3::fmi3ExitInitializationMode(nothing), ERROR);
        assert_eq!(
            fmi3::fmi3DoStep(nothing, 0.0, 0.1, 1, NOWHERE, NOWHERE, NOWHERE, null_mut()),
            ERROR
        );
        assert_eq!(
            fmi3::fmi3GetFloat64(nothing, null(), 0, null_mut(), 0),
            ERROR
        );
        assert_eq!(fmi3::fmi3EvaluateDiscreteStates(nothing), ERROR);
        assert_eq!(fmi2::fmi2GetReal(nothing, null(), 0, null_mut()), ERROR);
        assert_eq!(fmi2::fmi2CancelStep(nothing), ERROR);
    }
}

#[test]
fn an_instance_that_is_refused_is_null_and_says_why() {
    let resources = Resources::new("refused");
    let path = CString::new(resources.folder.to_str().unwrap()).unwrap();
    let token = resources.token.as_ptr();
    let empty = std::env::temp_dir().join(format!("armrs-empty-{}", std::process::id()));
    std::fs::create_dir_all(&empty).unwrap();
    let no_arm = CString::new(empty.to_str().unwrap()).unwrap();
    unsafe {
        for (token, path, event_mode, message) in [
            (c"{wrong}".as_ptr(), path.as_ptr(), 0, "has the token"),
            (c"".as_ptr(), path.as_ptr(), 0, "has the token"),
            (null(), path.as_ptr(), 0, "has the token"),
            (token, null(), 0, "no path of the resources"),
            (token, no_arm.as_ptr(), 0, "arm.json"),
            (token, c"/nowhere/at all".as_ptr(), 0, "arm.json"),
            (token, path.as_ptr(), 1, "event mode"),
        ] {
            assert!(three(token, path, event_mode).is_null());
            let [(status, text)] = &logged()[..] else {
                panic!("one message")
            };
            assert_eq!(*status, ERROR);
            assert!(text.contains(message), "{text}");
        }
        // Without a logger, too.
        let none = fmi2::fmi2Instantiate(null(), 1, null(), null(), null(), 0, 0);
        assert!(none.is_null());
        let scheduled = fmi2::fmi2Instantiate(null(), 2, token, path.as_ptr(), null(), 0, 0);
        assert!(scheduled.is_null());
        let environment = 42 as *mut c_void;
        let log = Some(crate::importer::log3 as unsafe extern "C" fn(_, _, _, _));
        let none = fmi3::fmi3InstantiateScheduledExecution(
            null(),
            token,
            path.as_ptr(),
            0,
            0,
            environment,
            log,
            null(),
            null(),
            null(),
        );
        assert!(none.is_null());
        assert!(logged()[0].1.contains("co-simulation"));
    }
    std::fs::remove_dir_all(empty).unwrap();
}

#[test]
fn arrays_that_are_null_or_of_the_wrong_length() {
    let resources = Resources::new("arrays");
    unsafe {
        let instance = resources.three();
        ready(instance);
        let mut value = [0.0; 2];
        assert_eq!(fmi3::fmi3GetFloat64(instance, null(), 0, null_mut(), 0), 0);
        assert_eq!(
            fmi3::fmi3GetFloat64(instance, null(), 1, value.as_mut_ptr(), 1),
            ERROR
        );
        assert_eq!(
            fmi3::fmi3GetFloat64(instance, [1].as_ptr(), 1, value.as_mut_ptr(), 2),
            ERROR
        );
        assert_eq!(
            fmi3::fmi3GetFloat64(instance, [9999].as_ptr(), 1, value.as_mut_ptr(), 1),
            ERROR
        );
        assert!(
            logged()
                .iter()
                .any(|(_, text)| text.contains("value reference 9999"))
        );
        let absurd = usize::MAX / 2;
        assert_eq!(
            fmi3::fmi3GetFloat64(instance, [1].as_ptr(), absurd, value.as_mut_ptr(), absurd),
            ERROR
        );
        assert_eq!(fmi3::fmi3SetFMUState(instance, null_mut()), ERROR);
        assert_eq!(fmi3::fmi3GetFMUState(instance, null_mut()), ERROR);
        assert_eq!(fmi3::fmi3FreeFMUState(instance, null_mut()), 0);
        let mut state = null_mut();
        assert_eq!(fmi3::fmi3FreeFMUState(instance, &mut state), 0);
        let garbage = [7_u8; 64];
        assert_eq!(
            fmi3::fmi3DeserializeFMUState(instance, garbage.as_ptr(), 64, &mut state),
            ERROR
        );
        assert_eq!(
            fmi3::fmi3DeserializeFMUState(instance, null(), 64, &mut state),
            ERROR
        );
        assert!(state.is_null());
        fmi3::fmi3FreeInstance(instance);
    }
}

#[test]
fn what_the_arm_has_none_of() {
    let resources = Resources::new("types");
    unsafe {
        let instance = resources.three();
        ready(instance);
        let reference = [1_u32];
        assert_eq!(fmi3::fmi3GetInt32(instance, null(), 0, null_mut(), 0), 0);
        let calls: [&dyn Fn() -> i32; 4] = [
            &|| fmi3::fmi3GetInt32(instance, reference.as_ptr(), 1, &mut 0, 1),
            &|| fmi3::fmi3SetBoolean(instance, reference.as_ptr(), 1, &1, 1),
            &|| fmi3::fmi3EnterConfigurationMode(instance),
            &|| fmi3::fmi3SetTime(instance, 1.0),
        ];
        for call in calls {
            assert_eq!(call(), ERROR);
            // An error like any other: the instance steps on after a reset alone.
            assert_eq!(do_step(instance, 0.0, 0.01), ERROR);
            assert_eq!(fmi3::fmi3Reset(instance), 0);
            ready(instance);
            assert_eq!(do_step(instance, 0.0, 0.01), 0);
        }
        let texts = logged();
        assert!(texts.iter().all(|(status, _)| *status == ERROR));
        let unsupported = texts.iter().filter(|(_, t)| t.contains("not supported"));
        assert_eq!(unsupported.count(), 3);
        fmi3::fmi3FreeInstance(instance);
    }
}

#[test]
fn a_panic_is_fatal_for_its_instance_alone() {
    let resources = Resources::new("panic");
    unsafe {
        let (lost, other) = (resources.three(), resources.three());
        ready(lost);
        ready(other);
        assert_eq!(guarded(lost, "test", |_| panic!("on purpose")), FATAL);
        assert!(logged()[0].1.contains("on purpose"));
        assert_eq!(do_step(lost, 0.0, 0.01), FATAL);
        assert_eq!(fmi3::fmi3Reset(lost), FATAL);
        assert_eq!(do_step(other, 0.0, 0.01), 0);
        fmi3::fmi3FreeInstance(lost);
        fmi3::fmi3FreeInstance(other);
    }
}

#[test]
fn categories_of_the_log() {
    let resources = Resources::new("log");
    unsafe {
        let instance = resources.three();
        let known = [c"logEvents".as_ptr(), c"logStatusError".as_ptr()];
        assert_eq!(fmi3::fmi3SetDebugLogging(instance, 1, 2, known.as_ptr()), 0);
        assert_eq!(fmi3::fmi3SetDebugLogging(instance, 1, 0, null()), 0);
        assert_eq!(
            fmi3::fmi3SetDebugLogging(instance, 1, 1, [c"logAll".as_ptr()].as_ptr()),
            ERROR
        );
        assert!(logged().last().unwrap().1.contains("logAll"));
        fmi3::fmi3FreeInstance(instance);
    }
}

#[test]
fn both_interfaces_and_threads_have_the_same_bits() {
    let resources = Resources::new("threads");
    // q and qd, after time, two forces and two torques.
    let references = [5_u32, 6, 7, 8];
    let run = || unsafe {
        let instance = resources.three();
        ready(instance);
        for k in 0..100 {
            assert_eq!(do_step(instance, f64::from(k) * 0.01, 0.01), 0);
        }
        let end = get(instance, &references);
        fmi3::fmi3FreeInstance(instance);
        end
    };
    let alone = run();
    let together: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    assert!(together.iter().all(|end| *end == alone));
    unsafe {
        let instance = resources.two();
        assert!(!instance.is_null());
        assert_eq!(fmi2::fmi2SetupExperiment(instance, 0, 0.0, 0.0, 0, 0.0), 0);
        assert_eq!(fmi2::fmi2EnterInitializationMode(instance), 0);
        assert_eq!(fmi2::fmi2ExitInitializationMode(instance), 0);
        for k in 0..100 {
            assert_eq!(fmi2::fmi2DoStep(instance, f64::from(k) * 0.01, 0.01, 1), 0);
        }
        let mut values = [0.0; 4];
        assert_eq!(
            fmi2::fmi2GetReal(instance, references.as_ptr(), 4, values.as_mut_ptr()),
            0
        );
        assert_eq!(values.map(f64::to_bits).to_vec(), alone);
        let mut last = 0.0;
        assert_eq!(fmi2::fmi2GetRealStatus(instance, 2, &mut last), 0);
        assert!((last - 1.0).abs() < 1e-12);
        assert_eq!(fmi2::fmi2Terminate(instance), 0);
        fmi2::fmi2FreeInstance(instance);
    }
}

#[test]
fn the_experiment_of_fmi_2_belongs_to_the_state() {
    let resources = Resources::new("experiment");
    unsafe {
        let instance = resources.two();
        assert_eq!(fmi2::fmi2SetupExperiment(instance, 0, 0.0, 5.0, 1, 6.0), 0);
        let mut state = null_mut();
        assert_eq!(fmi2::fmi2GetFMUstate(instance, &mut state), 0);
        assert_eq!(fmi2::fmi2Reset(instance), 0);
        assert_eq!(fmi2::fmi2SetFMUstate(instance, state), 0);
        assert_eq!(fmi2::fmi2FreeFMUstate(instance, &mut state), 0);
        assert_eq!(fmi2::fmi2EnterInitializationMode(instance), 0);
        assert_eq!(fmi2::fmi2ExitInitializationMode(instance), 0);
        assert_eq!(fmi2::fmi2DoStep(instance, 5.0, 0.5, 1), 0);
        // Too late to set it up anew.
        assert_eq!(
            fmi2::fmi2SetupExperiment(instance, 0, 0.0, 0.0, 0, 0.0),
            ERROR
        );
        fmi2::fmi2FreeInstance(instance);
    }
}
