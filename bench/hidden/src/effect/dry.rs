//! Dry friction: what it can hold at most. The solver finds what it does hold.

use super::acting::{Acts, Instant, Loads};

/// A law of dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dry {
    /// The same at any speed \[N m\].
    Coulomb(f64),
    /// An excess \[N m\] that falls with the square of the speed, to half at a speed \[rad/s\].
    Stribeck([f64; 2]),
    /// In proportion to the force through the joint \[m\].
    Load(f64),
    /// An excess \[N m\] that wears off with the way \[rad\] and returns at rest in a time \[s\].
    Thixotropy([f64; 3]),
    /// In one direction only (1 rising, −1 falling), growing with the angle from one at which it vanishes \[N m/rad, rad\].
    Pawl([f64; 3]),
}

impl Dry {
    /// The law at work.
    pub fn acting(&self, joint: usize) -> Box<dyn Acts> {
        Box::new(Friction {
            joint,
            law: *self,
            intact: 1.0,
        })
    }
}

struct Friction {
    joint: usize,
    law: Dry,
    /// Part of the structure that is not worn off.
    intact: f64,
}

/// Speed below which a joint rests \[rad/s\].
const REST: f64 = 0.01;

impl Acts for Friction {
    fn act(&self, now: &Instant, loads: &mut Loads) {
        let speed = now.qd[self.joint].abs();
        let both = match self.law {
            Dry::Coulomb(torque) => torque,
            Dry::Stribeck([torque, half]) => torque / (1.0 + (speed / half) * (speed / half)),
            Dry::Load(radius) => radius * now.through[self.joint],
            Dry::Thixotropy([torque, ..]) => torque * self.intact,
            Dry::Pawl([direction, slope, from]) => {
                let torque = (slope * (now.q[self.joint] - from)).max(0.0);
                let side = usize::from(direction < 0.0);
                loads.dry[self.joint][side] += torque;
                return;
            }
        };
        for side in &mut loads.dry[self.joint] {
            *side += both;
        }
    }

    fn advance(&mut self, now: &Instant, step: f64) {
        if let Dry::Thixotropy([_, way, time]) = self.law {
            let speed = now.qd[self.joint].abs();
            // Either it wears or it heals, never both.
            if speed > REST {
                self.intact *= libm::exp(-speed * step / way);
            } else {
                self.intact += (1.0 - self.intact) * (1.0 - libm::exp(-step / time));
            }
        }
    }
}
