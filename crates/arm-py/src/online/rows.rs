//! Rows of numbers from Python, and a state that several threads may use.

use std::sync::{Mutex, MutexGuard, PoisonError};

use arm_core::{Joints, Real};
use numpy::PyReadonlyArray2;

/// Numbers from Python, one row a sample.
pub(super) type Table<'py> = PyReadonlyArray2<'py, f64>;

/// A row of numbers in the precision of a device.
pub(super) fn row_of<T: Real, const N: usize>(row: &[f64]) -> Joints<T, N> {
    Joints::from_fn(|i, _| T::of(row[i]))
}

/// What a thread that panicked left is as good as what any other left.
pub(super) fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
