//! The contact between the hand and the robot's handle.

use crate::{Plane, Scalar};

/// A spring and damper in y and z, with play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<T> {
    /// Stiffness \[N/m\].
    pub stiffness: Plane<T>,
    /// Damping \[N s/m\].
    pub damping: Plane<T>,
    /// Half the free play: the spring acts beyond it \[m\].
    pub play: Plane<T>,
}

impl<T: Scalar> Contact<T> {
    /// A contact without play.
    pub fn new(stiffness: Plane<T>, damping: Plane<T>) -> Self {
        Self {
            stiffness,
            damping,
            play: [T::ZERO; 2],
        }
    }

    /// Force on the arm when the robot's handle is displaced from the arm's tip by `gap` and moves relative to it \[N\].
    ///
    /// * `gap` - handle minus tip \[m\]
    /// * `gap_rate` - its time derivative \[m/s\]
    ///
    /// The force pulls the arm towards the handle (thesis 3.33 with the sign that makes the contact stable).
    #[inline]
    pub fn force_on_arm(&self, gap: Plane<T>, gap_rate: Plane<T>) -> Plane<T> {
        let [spring, damper] = self.spring_and_damper(gap, gap_rate);
        [spring[0] + damper[0], spring[1] + damper[1]]
    }

    /// The parts of [`Contact::force_on_arm`]: of the springs, and of the dampers \[N\].
    #[inline(always)]
    pub fn spring_and_damper(&self, gap: Plane<T>, gap_rate: Plane<T>) -> [Plane<T>; 2] {
        let (mut stretch, mut rate) = (gap, gap_rate);
        // Without play what follows would change nothing, to the last bit.
        if !self.has_no_play() {
            for i in 0..2 {
                let beyond = (gap[i].abs() - self.play[i]).max(T::ZERO);
                stretch[i] = T::if_less(gap[i], T::ZERO, -beyond, beyond);
                let touching = T::if_less(self.play[i], gap[i].abs(), T::ONE, T::ZERO);
                rate[i] = T::if_less(T::ZERO, self.play[i], touching, T::ONE) * gap_rate[i];
            }
        }
        self.linear(stretch, rate)
    }

    /// [`Contact::spring_and_damper`] of a contact without play.
    #[inline(always)]
    pub fn linear(&self, gap: Plane<T>, gap_rate: Plane<T>) -> [Plane<T>; 2] {
        [
            [self.stiffness[0] * gap[0], self.stiffness[1] * gap[1]],
            [self.damping[0] * gap_rate[0], self.damping[1] * gap_rate[1]],
        ]
    }

    /// Whether there is none in any lane.
    #[inline(always)]
    pub fn has_no_play(&self) -> bool {
        self.play.iter().all(|play| play.every(|play| play == 0.0))
    }

    /// Time derivative of [`Contact::force_on_arm`] \[N/s\], where the contact neither closes nor opens.
    ///
    /// * `gap_change` - second time derivative of the gap \[m/s²\]
    pub fn force_rate(&self, gap: Plane<T>, gap_rate: Plane<T>, gap_change: Plane<T>) -> Plane<T> {
        core::array::from_fn(|i| {
            let touching = T::if_less(self.play[i], gap[i].abs(), T::ONE, T::ZERO);
            let touching = T::if_less(T::ZERO, self.play[i], touching, T::ONE);
            touching * (self.stiffness[i] * gap_rate[i] + self.damping[i] * gap_change[i])
        })
    }

    /// Energy held by the springs \[J\].
    pub fn energy(&self, gap: Plane<T>) -> T {
        let mut energy = T::ZERO;
        for i in 0..2 {
            let beyond = (gap[i].abs() - self.play[i]).max(T::ZERO);
            energy += T::of(0.5) * self.stiffness[i] * beyond.squared();
        }
        energy
    }
}
