//! Scales of quantities in a joint: the weight moment that it carries, and the middle of its angles.

use arm_core::Chain;
use arm_numerics::statistics::extent::extent;

use crate::regression::trial::Trial;

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
