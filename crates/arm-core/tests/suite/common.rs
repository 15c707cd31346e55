//! Random arms and states from written seeds.

use arm_core::effect::{Effect, Kind, Motion, States};
use arm_core::{Chain, Joints, Segment};

/// SplitMix64 (Steele, Lea, Flood 2014): small, portable and good enough for test states.
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    pub fn joints<const N: usize>(&mut self, bound: f64) -> Joints<f64, N> {
        Joints::from_fn(|_, _| self.uniform(-bound, bound))
    }

    /// An arm with off-axis centres of mass, a tilted gravity and rotor inertia.
    pub fn arm<const N: usize>(&mut self) -> Chain<f64, N> {
        let segments = core::array::from_fn(|_| {
            let length = self.uniform(0.1, 0.5);
            Segment {
                length,
                mass: self.uniform(0.3, 3.0),
                com: [self.uniform(0.1, 0.9) * length, self.uniform(-0.03, 0.03)],
                inertia: self.uniform(0.001, 0.02),
            }
        });
        let base = [self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0)];
        let gravity = [self.uniform(-1.0, 1.0), self.uniform(-10.0, -9.0)];
        Chain::new(segments, base, gravity)
            .and_then(|c| c.with_rotor_inertia(core::array::from_fn(|_| self.uniform(0.0, 0.01))))
            .expect("random arms are within the allowed ranges")
    }
}

impl Random {
    /// Values for the parameters of a kind: within its bounds, of order one, away from both ends.
    pub fn effect(&mut self, kind: Kind, index: usize) -> Effect<f64> {
        let mut effect = Effect::new(kind, index);
        for (value, p) in effect.parameters.iter_mut().zip(kind.info().parameters) {
            let (low, high) = (p.min.max(-2.0), p.max.min(2.0));
            *value = low + (high - low) * self.uniform(0.2, 0.8);
        }
        effect
    }

    /// States of an effect.
    pub fn states(&mut self) -> States<f64> {
        core::array::from_fn(|_| self.uniform(-1.0, 1.0))
    }

    /// A motion of an arm, with forces through its joints.
    pub fn motion<const N: usize>(&mut self) -> Motion<f64, N> {
        let mut motion = Motion::new(self.uniform(0.0, 2.0), self.joints(2.0), self.joints(2.0));
        motion.qdd = self.joints(5.0);
        motion.joint_force = core::array::from_fn(|_| self.uniform(0.0, 30.0));
        motion.activity = core::array::from_fn(|_| self.uniform(0.0, 1.0));
        motion
    }
}
