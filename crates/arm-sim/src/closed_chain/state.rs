//! The drive of the arm at one instant, its state, and the quantities that follow from both.

use arm_core::effect::Motion;
use arm_core::{Joints, Lanes, Plane, Scalar, Setup};

use crate::Handle;

/// What drives the arm at one instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Input<T, const N: usize> {
    pub time: T,
    pub handle: Handle<T>,
    /// Torques of motors \[N m\].
    pub torque: Joints<T, N>,
    /// Where the base is; the handle is seen from there.
    pub base: BaseMotion<T>,
    /// Of the muscles that move each joint, see [`Motion::activity`].
    pub activity: [T; N],
}

/// A base that moves whatever the arm does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BaseMotion<T> {
    /// How far it is from its place \[m\].
    pub position: Plane<T>,
    /// \[m/s\]
    pub velocity: Plane<T>,
    /// \[m/s²\]
    pub acceleration: Plane<T>,
}

impl<T: Scalar> BaseMotion<T> {
    pub fn still() -> Self {
        Self {
            position: [T::ZERO; 2],
            velocity: [T::ZERO; 2],
            acceleration: [T::ZERO; 2],
        }
    }
}

impl<T: Scalar, const N: usize> Input<T, N> {
    /// Motion of the arm at this instant, the input of effects; without accelerations and joint forces.
    #[inline]
    pub fn motion(&self, q: &Joints<T, N>, qd: &Joints<T, N>) -> Motion<T, N> {
        Motion {
            activity: self.activity,
            ..Motion::new(self.time, *q, *qd)
        }
    }

    /// Adds the displacement of the handle in a rig to its commanded position, and the motion of a heaving base.
    #[inline]
    pub fn stands_as_in(&mut self, setup: &Setup<T, N>) {
        if setup.displaced.is_somewhere() {
            let [position, velocity, acceleration] = setup.displaced.at(self.time);
            for axis in 0..2 {
                self.handle.position[axis] += position[axis];
                self.handle.velocity[axis] += velocity[axis];
                self.handle.acceleration[axis] += acceleration[axis];
            }
        }
        if !setup.heave.is_still() {
            self.move_base(setup.heave.at(self.time));
        }
    }

    /// Moves the base: position \[m\], velocity \[m/s\] and acceleration \[m/s²\].
    #[inline]
    pub fn move_base(&mut self, [position, velocity, acceleration]: [Plane<T>; 3]) {
        for axis in 0..2 {
            self.base.position[axis] += position[axis];
            self.base.velocity[axis] += velocity[axis];
            self.base.acceleration[axis] += acceleration[axis];
            self.handle.position[axis] -= position[axis];
            self.handle.velocity[axis] -= velocity[axis];
            self.handle.acceleration[axis] -= acceleration[axis];
        }
    }
}

impl<const L: usize, const N: usize> Input<Lanes<L>, N> {
    /// What drives one lane.
    pub fn lane(&self, lane: usize) -> Input<f64, N> {
        let plane = |of: &Plane<Lanes<L>>| [of[0].0[lane], of[1].0[lane]];
        Input {
            time: self.time.0[lane],
            handle: Handle {
                position: plane(&self.handle.position),
                velocity: plane(&self.handle.velocity),
                acceleration: plane(&self.handle.acceleration),
            },
            torque: Joints::from_fn(|j, _| self.torque[j].0[lane]),
            base: BaseMotion {
                position: plane(&self.base.position),
                velocity: plane(&self.base.velocity),
                acceleration: plane(&self.base.acceleration),
            },
            activity: core::array::from_fn(|j| self.activity[j].0[lane]),
        }
    }
}

/// Angles, speeds and the work done so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State<T, const N: usize> {
    pub q: Joints<T, N>,
    pub qd: Joints<T, N>,
    /// By handle and drive, against resistance and damping \[J\].
    pub work: [T; 4],
}

impl<T: Scalar, const N: usize> State<T, N> {
    /// Whether every angle and speed of every lane is finite: zero times anything else is not zero.
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        let mut sum = T::ZERO;
        for i in 0..N {
            sum += T::ZERO * self.q[i] + T::ZERO * self.qd[i];
        }
        sum.is_finite()
    }

    /// Goes on for a time by semi-implicit Euler: first the speeds, and with the new ones the angles. The sum `(q + h q̇) + h² q̈` has
    /// a shorter dependency chain, but rounds the angle twice; fits with finite differences then take 1.6 times as long.
    #[inline(always)]
    pub fn advance(&mut self, h: T, now: &Outcome<T, N>) {
        for i in 0..N {
            self.qd[i] += h * now.qdd[i];
        }
        for i in 0..N {
            self.q[i] += h * self.qd[i];
        }
        for i in 0..4 {
            self.work[i] += h * now.power[i];
        }
    }
}

impl<const L: usize, const N: usize> State<Lanes<L>, N> {
    /// The state of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> State<f64, N> {
        State {
            q: Joints::from_fn(|j, _| self.q[j].0[lane]),
            qd: Joints::from_fn(|j, _| self.qd[j].0[lane]),
            // Not by `map`, which would copy every lane.
            work: core::array::from_fn(|i| self.work[i].0[lane]),
        }
    }

    /// Puts a state into one lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, state: &State<f64, N>) {
        for j in 0..N {
            self.q[j].0[lane] = state.q[j];
            self.qd[j].0[lane] = state.qd[j];
        }
        for (all, one) in self.work.iter_mut().zip(state.work) {
            all.0[lane] = one;
        }
    }
}

/// What follows from state and input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome<T, const N: usize> {
    pub qdd: Joints<T, N>,
    pub force_on_arm: Plane<T>,
    /// Time derivative of [`State::work`] \[W\].
    pub power: [T; 4],
    /// Force through each joint where an effect needs it, else zero \[N\].
    pub joint_force: [T; N],
}

impl<T: Scalar, const N: usize> Outcome<T, N> {
    /// Nothing moves and nothing acts.
    pub fn none() -> Self {
        Self {
            qdd: Joints::repeat(T::ZERO),
            force_on_arm: [T::ZERO; 2],
            power: [T::ZERO; 4],
            joint_force: [T::ZERO; N],
        }
    }
}

impl<const L: usize, const N: usize> Outcome<Lanes<L>, N> {
    /// Puts what follows in one lane there, without forces.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, of: &Outcome<f64, N>) {
        for j in 0..N {
            self.qdd[j].0[lane] = of.qdd[j];
        }
        for (all, one) in self.power.iter_mut().zip(of.power) {
            all.0[lane] = one;
        }
    }
}

/// Powers as in [`Outcome::power`].
#[inline(always)]
pub(crate) fn powers<T: Scalar, const N: usize>(
    (force, v): (Plane<T>, Plane<T>),
    [drive, resisting]: [&Joints<T, N>; 2],
    qd: &Joints<T, N>,
    lost: T,
) -> [T; 4] {
    let (mut driven, mut resisted) = (T::ZERO, T::ZERO);
    for i in 0..N {
        driven += drive[i] * qd[i];
        resisted += resisting[i] * qd[i];
    }
    [force[0] * v[0] + force[1] * v[1], driven, resisted, lost]
}

#[inline(always)]
pub(crate) fn sum<T: Scalar, const N: usize>(a: &Joints<T, N>, b: &Joints<T, N>) -> Joints<T, N> {
    let mut c = *a;
    for i in 0..N {
        c[i] += b[i];
    }
    c
}

#[inline(always)]
pub(crate) fn difference<T: Scalar, const N: usize>(
    a: &Joints<T, N>,
    b: &Joints<T, N>,
) -> Joints<T, N> {
    let mut c = *a;
    for i in 0..N {
        c[i] -= b[i];
    }
    c
}
