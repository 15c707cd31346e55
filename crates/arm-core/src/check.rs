//! Checks of values that the core is given.

use crate::numeric::scalar::Real;
use crate::{Invalid, Scalar};

pub(crate) fn finite<T: Scalar>(name: &'static str, index: usize, value: T) -> Result<(), Invalid> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(Invalid::NotFinite { name, index })
    }
}

/// Smallest number that counts as positive: the smallest normal one of single precision.
pub(crate) const SMALLEST: f64 = f32::MIN_POSITIVE as f64;

// Once in the code: a device makes many checks of one set-up.
#[inline(never)]
fn at_least<T: Scalar>(
    name: &'static str,
    index: usize,
    value: T,
    min: f64,
) -> Result<(), Invalid> {
    finite(name, index, value)?;
    if value.within(min, f64::INFINITY) {
        return Ok(());
    }
    let found = core::cell::Cell::new(min);
    value.every(|v| {
        found.set(v);
        v >= min
    });
    Err(Invalid::OutOfRange {
        name,
        index,
        found: found.get(),
        min,
        max: f64::INFINITY,
    })
}

pub(crate) fn at_least_zero<T: Scalar>(
    name: &'static str,
    index: usize,
    value: T,
) -> Result<(), Invalid> {
    at_least(name, index, value, 0.0)
}

pub(crate) fn positive<T: Scalar>(
    name: &'static str,
    index: usize,
    value: T,
) -> Result<(), Invalid> {
    at_least(name, index, value, SMALLEST)
}

/// That a range is one; either end may be infinite.
pub(crate) fn ordered<T: Real>(
    name: &'static str,
    index: usize,
    [min, max]: [T; 2],
) -> Result<(), Invalid> {
    match min.partial_cmp(&max) {
        None => Err(Invalid::NotFinite { name, index }),
        Some(order) if order.is_gt() => Err(Invalid::OutOfRange {
            name,
            index,
            found: max.to_f64(),
            min: min.to_f64(),
            max: f64::INFINITY,
        }),
        Some(_) => Ok(()),
    }
}
