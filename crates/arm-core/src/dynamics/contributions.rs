//! The torques of the equation of motion, each by itself.

use crate::dynamics::coriolis::centrifugal_of;
use crate::dynamics::inertia::{pairs, turning};
use crate::dynamics::kinematics::{to_joint_torque, to_links};
use crate::{Chain, Joints, Load, Pose, Products, Scalar, gravity, joints, static_torque};

/// The terms of `B q̈ + C q̇ + G = τ + Jᵀ F`, each shoulder first \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contributions<T, const N: usize> {
    /// `B q̈`.
    pub inertial: Joints<T, N>,
    /// The part of `C q̇` with squared speeds.
    pub centrifugal: Joints<T, N>,
    /// The part of `C q̇` with products of two speeds.
    pub coriolis: Joints<T, N>,
    /// `G`.
    pub gravity: Joints<T, N>,
    /// Net joint torque, right-hand side.
    pub joint: Joints<T, N>,
    /// `Jᵀ F` of force and moment on the arm, right-hand side.
    pub contact: Joints<T, N>,
}

impl<T: Scalar, const N: usize> Contributions<T, N> {
    /// Left-hand side less right-hand side; zero when the motion obeys the equation of motion \[N m\].
    pub fn imbalance(&self) -> Joints<T, N> {
        let mut sum = joints([T::ZERO; N]);
        for i in 0..N {
            sum[i] = self.inertial[i] + self.centrifugal[i] + self.coriolis[i] + self.gravity[i]
                - self.joint[i]
                - self.contact[i];
        }
        sum
    }
}

/// The torques of a motion under a load.
#[inline(always)]
pub fn contributions<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    pose: &Pose<T, N>,
    motion: (&Joints<T, N>, &Joints<T, N>),
    load: &Load<T, N>,
) -> Contributions<T, N> {
    let (qd, qdd) = motion;
    let acceleration = to_links(qdd);
    let (m, slopes) = pairs(&Products::of(chain), pose);
    let inertial: [T; N] = core::array::from_fn(|i| {
        let mut sum = T::ZERO;
        for k in 0..N {
            let entry = if i < k { m[k][i] } else { m[i][k] };
            sum += entry * acceleration[k];
        }
        sum
    });
    let centrifugal = centrifugal_of(&slopes, qd);
    let mut products = to_joint_torque(&turning(&slopes, &to_links(qd)));
    for i in 0..N {
        products[i] -= centrifugal[i];
    }
    Contributions {
        inertial: to_joint_torque(&inertial),
        centrifugal,
        coriolis: products,
        gravity: gravity(chain, pose),
        joint: load.torque,
        contact: static_torque(chain, pose, load.force_on_arm, load.moment_on_arm),
    }
}
