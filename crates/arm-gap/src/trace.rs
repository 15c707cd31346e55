//! Trace.
use std::cell::Cell;
use std::hash::{Hash, Hasher};
pub struct T(&'static str, std::time::Instant, u64);
thread_local! { static D: Cell<usize> = const { Cell::new(0) }; }
pub fn t(name: &'static str) -> T { k(name, "") }
pub fn k(name: &'static str, key: &str) -> T {
    let mut h = std::collections::hash_map::DefaultHasher::new();
    key.hash(&mut h);
    D.with(|d| d.set(d.get() + 1));
    T(name, std::time::Instant::now(), h.finish())
}
impl Drop for T {
    fn drop(&mut self) {
        let d = D.with(|d| { d.set(d.get() - 1); d.get() });
        eprintln!("TR {:?} {} {} {:.6} {:016x}", std::thread::current().id(), d, self.0, self.1.elapsed().as_secs_f64(), self.2);
    }
}
