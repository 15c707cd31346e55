//! Joints that accelerate away from rest because their friction falls with speed.

use arm_core::effect::{Motion, States};

use super::instant::{Mode, Modes};
use crate::closed_chain::model::Model;

/// Fastest rate with which the speed of a joint that slips grows by itself because its friction falls with it \[1/s\].
///
/// * `most` - dry friction at these speeds, where it is known \[N m\]
/// * `yielding` - see [`super::instant::Arm::yielding`]
pub(super) fn growth<const N: usize>(
    model: &Model<f64, N>,
    motion: &Motion<f64, N>,
    memory: &[States<f64>],
    modes: &Modes<N>,
    (most, yielding): (Option<[f64; N]>, impl FnOnce() -> [f64; N]),
) -> f64 {
    /// A change of speed in which friction is almost linear \[rad/s\].
    const CHANGE: f64 = 1e-6;
    let mut faster = *motion;
    for j in 0..N {
        if let Mode::Slips(way) = modes[j] {
            faster.qd[j] += CHANGE * way;
        }
    }
    let slow = most.unwrap_or_else(|| model.dry_friction(motion, memory));
    let fast = model.dry_friction(&faster, memory);
    let falls = |j: &usize| fast[*j] < slow[*j];
    if !(0..N).any(|j| falls(&j)) {
        return 0.0;
    }
    let yielding = yielding();
    (0..N)
        .filter(falls)
        .map(|j| (slow[j] - fast[j]) / CHANGE * yielding[j])
        .fold(0.0, f64::max)
}
