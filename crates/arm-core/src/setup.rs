//! What effects outside the joints may alter: the rig before a run, and each reading of its sensors.

use crate::{Chain, Contact, Invalid, Joints, Plane, Scalar, Segment};

/// The rig as it is built, before a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup<T, const N: usize> {
    /// Segments, proximal first.
    pub segments: [Segment<T>; N],
    /// Rotor inertia at each joint \[kg m²\].
    pub rotor: [T; N],
    /// First joint \[m\].
    pub base: Plane<T>,
    /// Acceleration of gravity \[m/s²\].
    pub gravity: Plane<T>,
    /// Contact between hand and handle.
    pub contact: Contact<T>,
    /// Where the hand holds the handle beside its tip: along the last segment and to its left \[m\].
    pub placement: Plane<T>,
    /// Movement of the base with the first joint's angle: metres for each radian from `base_rest`.
    pub base_motion: Plane<T>,
    /// First joint angle at which the base stands at `base` \[rad\].
    pub base_rest: T,
    /// Periodic error of the robot's position: amplitude in y and z \[m\].
    pub ripple: Plane<T>,
    /// Its frequency \[Hz\].
    pub ripple_frequency: T,
    /// Its phase at time zero \[rad\].
    pub ripple_phase: T,
    /// Delay of the force channels against the angles \[s\].
    pub force_delay: T,
}

impl<T: Scalar, const N: usize> Setup<T, N> {
    /// A rig without imperfections around a chain.
    pub fn new(chain: &Chain<T, N>, contact: Contact<T>) -> Self {
        Self {
            segments: *chain.segments(),
            rotor: *chain.rotor_inertia(),
            base: chain.base(),
            gravity: chain.gravity(),
            contact,
            placement: [T::ZERO; 2],
            base_motion: [T::ZERO; 2],
            base_rest: T::ZERO,
            ripple: [T::ZERO; 2],
            ripple_frequency: T::ZERO,
            ripple_phase: T::ZERO,
            force_delay: T::ZERO,
        }
    }

    /// The chain of this rig.
    ///
    /// # Errors
    /// [`Invalid`] where an effect has made it impossible, for example a negative mass.
    pub fn chain(&self) -> Result<Chain<T, N>, Invalid> {
        Chain::new(self.segments, self.base, self.gravity)?.with_rotor_inertia(self.rotor)
    }
}

/// One sample of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<T, const N: usize> {
    /// Time since the start of the trial \[s\].
    pub time: T,
    /// Joint angles \[rad\].
    pub q: Joints<T, N>,
    /// Force on the arm \[N\].
    pub force_on_arm: Plane<T>,
    /// Moment on the arm \[N m\].
    pub moment_on_arm: T,
}

impl<T: Scalar, const N: usize> Reading<T, N> {
    /// A channel of the force sensor: 0 = `Fy`, 1 = `Fz`, 2 = `Mx`; none beyond.
    #[inline]
    pub fn channel_mut(&mut self, channel: usize) -> Option<&mut T> {
        match channel {
            0 | 1 => self.force_on_arm.get_mut(channel),
            2 => Some(&mut self.moment_on_arm),
            _ => None,
        }
    }
}
