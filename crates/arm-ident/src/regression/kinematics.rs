//! Motion at the samples of a trial.

use arm_core::{Chain, Joints, Plane};

/// Motion at the samples of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinematics<const N: usize> {
    /// Angles \[rad\].
    pub q: Vec<Joints<f64, N>>,
    /// Speeds \[rad/s\].
    pub qd: Vec<Joints<f64, N>>,
    /// Accelerations \[rad/s²\].
    pub qdd: Vec<Joints<f64, N>>,
    /// Acceleration of the first joint \[m/s²\], where its path was measured; else it rests.
    pub base: Option<Vec<Plane<f64>>>,
    /// Speed of each joint up to which it may rest \[rad/s\]: of a simulated motion zero, else what noise makes of rest.
    pub rest: [f64; N],
    /// Force on the arm \[N\], where it was simulated with the motion.
    pub force: Option<Vec<Plane<f64>>>,
}

impl<const N: usize> Kinematics<N> {
    /// The arm at a sample while its first joint moves: gravity minus the acceleration of that joint acts on it.
    pub fn chain_in_moving_frame(&self, chain: &Chain<f64, N>, i: usize) -> Chain<f64, N> {
        let ([gy, gz], base) = (chain.gravity(), self.base.as_ref());
        base.map_or(*chain, |a| chain.with_gravity([gy - a[i][0], gz - a[i][1]]))
    }
}
