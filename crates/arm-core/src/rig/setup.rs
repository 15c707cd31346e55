//! Everything that effects outside the joints may alter: the rig before a run, and each reading of its sensors.

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
    /// How the base heaves, whatever the arm does.
    pub heave: Wave<T>,
    /// Where the hand's handle is beside where the robot's angles put it.
    pub displaced: Displaced<T>,
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
            heave: Wave::still(),
            displaced: Displaced::nowhere(),
            force_delay: T::ZERO,
        }
    }

    /// Whether the handle stands where it is commanded, seen from a base that does not heave.
    #[inline]
    pub fn is_as_commanded(&self) -> bool {
        !self.displaced.is_somewhere() && self.heave.is_still()
    }

    /// The chain of this rig.
    ///
    /// # Errors
    /// [`Invalid`] where an effect has made it impossible, for example a negative mass.
    pub fn chain(&self) -> Result<Chain<T, N>, Invalid> {
        Chain::new(self.segments, self.base, self.gravity)?.with_rotor_inertia(self.rotor)
    }
}

/// How far the handle is from where the robot's angles put it, as a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displaced<T> {
    /// A periodic error.
    pub ripple: Wave<T>,
    /// Way of a slip in y and z \[m\].
    pub slip: Plane<T>,
    /// When it begins \[s\].
    pub slip_start: T,
}

/// A place that swings: `amplitude · sin(2π frequency t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave<T> {
    /// In y and z \[m\].
    pub amplitude: Plane<T>,
    /// \[Hz\]
    pub frequency: T,
    /// At time zero \[rad\].
    pub phase: T,
}

impl<T: Scalar> Wave<T> {
    /// One that does not swing.
    pub fn still() -> Self {
        Self {
            amplitude: [T::ZERO; 2],
            frequency: T::ZERO,
            phase: T::ZERO,
        }
    }

    /// Whether it does not swing, in no lane.
    #[inline]
    pub fn is_still(&self) -> bool {
        let mut ways = self.amplitude.iter();
        ways.all(|way| way.every(|way| way == 0.0))
    }

    /// Position \[m\], velocity \[m/s\] and acceleration \[m/s²\] at a time \[s\].
    #[inline]
    pub fn at(&self, time: T) -> [Plane<T>; 3] {
        let omega = T::of(core::f64::consts::TAU) * self.frequency;
        let (sin, cos) = (omega * time + self.phase).sin_cos();
        let faster = omega.squared();
        [
            self.amplitude.map(|a| a * sin),
            self.amplitude.map(|a| a * omega * cos),
            self.amplitude.map(|a| -(a * faster * sin)),
        ]
    }
}

/// How long a slip of the handle takes \[s\].
pub const SLIP_TIME: f64 = 0.1;

impl<T: Scalar> Displaced<T> {
    /// Always where the robot's angles put it.
    pub fn nowhere() -> Self {
        Self {
            ripple: Wave::still(),
            slip: [T::ZERO; 2],
            slip_start: T::ZERO,
        }
    }

    /// Whether it is anywhere else, in any lane.
    #[inline]
    pub fn is_somewhere(&self) -> bool {
        let mut ways = self.slip.iter();
        !(self.ripple.is_still() && ways.all(|way| way.every(|way| way == 0.0)))
    }

    /// Position \[m\], velocity \[m/s\] and acceleration \[m/s²\] beside where the robot's angles put it, at a time \[s\].
    #[inline]
    pub fn at(&self, time: T) -> [Plane<T>; 3] {
        let [swing, swinging, swung] = self.ripple.at(time);
        let rate = T::of(1.0 / SLIP_TIME);
        let s = ((time - self.slip_start) * rate).max(T::ZERO).min(T::ONE);
        let rest = T::ONE - s;
        // The polynomial of least jerk: speed and acceleration are zero where it begins and ends.
        let part = s.squared() * s * (T::of(10.0) - s * (T::of(15.0) - T::of(6.0) * s));
        let speed = T::of(30.0) * (s * rest).squared() * rate;
        let gain = T::of(60.0) * s * rest * (rest - s) * rate.squared();
        let and_slip = |swing: Plane<T>, slipped: T| -> Plane<T> {
            core::array::from_fn(|axis| swing[axis] + self.slip[axis] * slipped)
        };
        [
            and_slip(swing, part),
            and_slip(swinging, speed),
            and_slip(swung, gain),
        ]
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
