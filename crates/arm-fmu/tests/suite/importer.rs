//! A small importer: instances of a sample arm through both interfaces, with what they log.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::PathBuf;
use std::ptr::{null, null_mut};

use arm_cosim::{ArmSpec, Slave};
use arm_fmu::{Handle, fmi2, fmi3};

thread_local! {
    /// What the instances of this thread have logged: status and text.
    pub static LOG: RefCell<Vec<(c_int, String)>> = const { RefCell::new(Vec::new()) };
}

/// What was logged since the last call.
pub fn logged() -> Vec<(c_int, String)> {
    LOG.with_borrow_mut(std::mem::take)
}

fn text(pointer: *const c_char) -> String {
    // SAFETY: texts of the FMU end with a zero byte.
    unsafe { CStr::from_ptr(pointer) }
        .to_str()
        .expect("UTF-8")
        .to_owned()
}

pub unsafe extern "C" fn log3(
    environment: Handle,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    assert_eq!(environment as usize, 42, "the environment is handed back");
    assert!(!text(category).is_empty());
    LOG.with_borrow_mut(|log| log.push((status, text(message))));
}

/// Resources of the sample arm in a folder of their own.
pub struct Resources {
    pub folder: PathBuf,
    pub token: CString,
}

impl Resources {
    pub fn new(name: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("armrs ä 100% {name} {}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let spec = ArmSpec::sample();
        std::fs::write(folder.join("arm.json"), spec.to_json().unwrap()).unwrap();
        let token = CString::new(Slave::new(spec).unwrap().token()).unwrap();
        Self { folder, token }
    }

    /// An instance of FMI 3.0.
    pub fn three(&self) -> Handle {
        let path = CString::new(format!("{}/", self.folder.display())).unwrap();
        unsafe { three(self.token.as_ptr(), path.as_ptr(), 0) }
    }

    /// An instance of FMI 2.0, without any callbacks.
    pub fn two(&self) -> Handle {
        // On Windows a path begins with a drive: C:\a is file:///C:/a.
        let path = self.folder.to_str().unwrap().replace('\\', "/");
        let encoded: String = path.trim_start_matches('/').bytes().map(encode).collect();
        let uri = CString::new(format!("file:///{encoded}")).unwrap();
        unsafe {
            fmi2::fmi2Instantiate(
                c"arm".as_ptr(),
                1,
                self.token.as_ptr(),
                uri.as_ptr(),
                null(),
                0,
                1,
            )
        }
    }
}

impl Drop for Resources {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn encode(byte: u8) -> String {
    match byte {
        b'/' | b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' => {
            (byte as char).to_string()
        }
        other => format!("%{other:02X}"),
    }
}

/// Requests an instance of FMI 3.0.
pub unsafe fn three(token: *const c_char, path: *const c_char, event_mode: u8) -> Handle {
    let environment = 42 as *mut c_void;
    unsafe {
        fmi3::fmi3InstantiateCoSimulation(
            c"arm".as_ptr(),
            token,
            path,
            0,
            0,
            event_mode,
            0,
            null(),
            0,
            environment,
            Some(log3),
            null(),
        )
    }
}

/// Brings an instance of FMI 3.0 into step mode.
pub unsafe fn ready(instance: Handle) {
    unsafe {
        assert_eq!(
            fmi3::fmi3EnterInitializationMode(instance, 0, 0.0, 0.0, 0, 0.0),
            0
        );
        assert_eq!(fmi3::fmi3ExitInitializationMode(instance), 0);
    }
}

/// A step of FMI 3.0 with all places to write to.
pub unsafe fn do_step(instance: Handle, time: f64, step: f64) -> c_int {
    let (mut flags, mut last) = ([9_u8; 3], f64::NAN);
    let p = flags.as_mut_ptr();
    let status =
        unsafe { fmi3::fmi3DoStep(instance, time, step, 1, p, p.add(1), p.add(2), &mut last) };
    if status == 0 {
        assert_eq!(flags, [0; 3]);
        assert!((last - time - step).abs() < 1e-9);
    }
    status
}

/// Values by reference through FMI 3.0.
pub unsafe fn get(instance: Handle, references: &[u32]) -> Vec<u64> {
    let mut values = vec![0.0; references.len()];
    let n = values.len();
    let status =
        unsafe { fmi3::fmi3GetFloat64(instance, references.as_ptr(), n, values.as_mut_ptr(), n) };
    assert_eq!(status, 0);
    values.into_iter().map(f64::to_bits).collect()
}

/// No place to write to.
pub const NOWHERE: *mut u8 = null_mut();
