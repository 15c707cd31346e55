//! A step of 0.25 ms through the C interface (inputs set, step made, outputs read) against a step of the native run.

use std::ffi::{CString, c_int};
use std::hint::black_box;
use std::path::PathBuf;
use std::ptr::{null, null_mut};

use arm_core::{Contact, Joints, Setup, sample_arms};
use arm_cosim::{ArmSpec, Slave, StartSpec};
use arm_fmu::{Handle, fmi3};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Port, Start, simulate};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const STEP: f64 = 0.25e-3;
const STEPS: usize = 4000;
const START: [f64; 3] = [-1.1, 0.8, 0.1];
const HANDLE: [f64; 2] = [0.45, -0.25];

type Set = unsafe extern "C" fn(Handle, *const u32, usize, *const f64, usize) -> c_int;
type Get = unsafe extern "C" fn(Handle, *const u32, usize, *mut f64, usize) -> c_int;

/// The human arm on a contact, held by a handle that rests.
fn experiment() -> Experiment<3> {
    let setup = Setup::new(
        &sample_arms::human_arm(),
        Contact::new([10_000.0; 2], [25.0; 2]),
    );
    let drive = Drive::Handle {
        path: HandlePath::fixed(HANDLE).expect("a point"),
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(setup, drive, STEPS as f64 * STEP);
    experiment.start = Start::Given {
        q: START.into(),
        qd: Joints::zeros(),
    };
    experiment.output_interval = Some(0.02);
    experiment
}

/// An instance of the same arm, from a folder of resources as an importer has it.
fn instance() -> (Handle, PathBuf) {
    let experiment = experiment();
    let start = StartSpec {
        q: START.to_vec(),
        qd: vec![0.0; 3],
        handle: HANDLE,
    };
    let spec = ArmSpec::new("arm", Port::Motion, &experiment.setup, &[]).starting(start);
    let folder = std::env::temp_dir().join(format!("armrs-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("arm.json"), spec.to_json().expect("JSON")).expect("a file");
    let token = CString::new(Slave::new(spec).expect("an arm").token()).expect("a text");
    let path = CString::new(folder.to_str().expect("UTF-8")).expect("a text");
    // SAFETY: valid texts, no callbacks.
    let handle = unsafe {
        let name = c"arm".as_ptr();
        fmi3::fmi3InstantiateCoSimulation(
            name,
            token.as_ptr(),
            path.as_ptr(),
            0,
            0,
            0,
            0,
            null(),
            0,
            null_mut(),
            None,
            null(),
        )
    };
    assert!(!handle.is_null());
    (handle, folder)
}

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("step");
    group
        .throughput(Throughput::Elements(STEPS as u64))
        .sample_size(30);
    let experiment = experiment();
    group.bench_function("native", |b| {
        b.iter(|| simulate(black_box(&experiment)).expect("runs"));
    });
    let (handle, folder) = instance();
    let (set, get): (Set, Get) = (
        black_box(fmi3::fmi3SetFloat64),
        black_box(fmi3::fmi3GetFloat64),
    );
    // robot.r[1], robot.v[1], robot.r[2], robot.v[2] come after time; contact.F after three torques and the motion of the arm.
    let inputs = [1_u32, 2, 3, 4];
    let outputs = [18_u32, 19];
    let values = [HANDLE[0], 0.0, HANDLE[1], 0.0];
    group.bench_function("fmi3", |b| {
        b.iter(|| {
            // SAFETY: a live instance, arrays of the lengths given.
            unsafe {
                fmi3::fmi3Reset(handle);
                fmi3::fmi3EnterInitializationMode(handle, 0, 0.0, 0.0, 0, 0.0);
                fmi3::fmi3ExitInitializationMode(handle);
                let mut force = [0.0; 2];
                for k in 0..STEPS {
                    set(handle, inputs.as_ptr(), 4, values.as_ptr(), 4);
                    let (p, d) = (null_mut(), null_mut());
                    let status = fmi3::fmi3DoStep(handle, k as f64 * STEP, STEP, 1, p, p, p, d);
                    assert_eq!(status, 0);
                    get(handle, outputs.as_ptr(), 2, force.as_mut_ptr(), 2);
                }
                black_box(force)
            }
        });
    });
    // SAFETY: not used after this.
    unsafe { fmi3::fmi3FreeInstance(handle) };
    std::fs::remove_dir_all(folder).expect("the folder is ours");
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
