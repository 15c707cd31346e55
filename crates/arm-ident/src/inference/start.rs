//! Where a fit along simulated motion starts: what a passive joint typically has.

use arm_core::Chain;
use arm_numerics::statistics::extent::extent;

use crate::regression::trial::{Model, Trial};
use crate::regression::unknown::spring;

/// Shares of what is typical to start from, in turn.
pub(crate) const SHARES: [f64; 3] = [0.3, 1.0, 0.1];
/// Part of the whole arm's weight moment that each joint's typical sizes are read off at least: muscles that cross a wrist are made
/// for more than the weight of a hand.
const OF_THE_ARM: f64 = 0.3;

/// The weight moment that typical sizes of a joint are read off \[N m\]: of all segments from that joint on, stretched out.
pub fn weight_moment<const N: usize>(chain: &Chain<f64, N>, joint: usize) -> f64 {
    let [y, z] = chain.gravity();
    let g = libm::sqrt(y * y + z * z);
    let beyond = |joint: usize| {
        let mut reach = 0.0;
        let mut sum = 0.0;
        for segment in &chain.segments()[joint..] {
            sum += segment.mass * g * (reach + segment.com[0]);
            reach += segment.length;
        }
        sum
    };
    f64::max(beyond(joint), OF_THE_ARM * beyond(0))
}

/// The middle of the angles that a joint reached \[rad\]; zero without samples.
pub fn middle<'a, const N: usize>(trials: impl Iterator<Item = &'a Trial<N>>, joint: usize) -> f64 {
    let angles = trials.flat_map(|t| &t.q).map(|q| q[joint]);
    let (low, high) = extent(angles);
    if low > high { 0.0 } else { 0.5 * (low + high) }
}

/// The model with this share of what is typical in place of every fitted law. Springs rest in the middle of the measured angles, so that
/// the simulated arm stays near the measured one.
pub(crate) fn typical<const N: usize>(model: &Model<N>, fit: &[&Trial<N>], share: f64) -> Model<N> {
    let mut start = model.clone();
    for effect in &mut start.fitted {
        let (joint, size) = (effect.index.min(N - 1), effect.kind.prior().typical);
        if size > 0.0 {
            effect.parameters[0] = share * size * weight_moment(&model.chain, joint);
        }
        if let Some((_, rest)) = spring(effect) {
            effect.parameters[rest] = middle(fit.iter().copied(), joint);
        }
    }
    start
}
