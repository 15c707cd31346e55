//! What stores energy in joints.

use super::acting::{Acts, Instant, Loads};

/// A law of elasticity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Elastic {
    /// Stiffness \[N m/rad\] and rest angle \[rad\].
    Spring([f64; 2]),
    /// Stiffness \[N m/rad³\] and rest angle \[rad\].
    Cubic([f64; 2]),
    /// The same moment everywhere \[N m\].
    Moment(f64),
    /// A spring \[N m/rad\] that creeps with a time constant \[s\].
    Creeping([f64; 2]),
    /// A cord over this joint and the one before: stiffness \[N m/rad\], share of the joint before, rest.
    Cord([f64; 3]),
    /// Ligaments that are slack up to an angle: moment \[N m\] for each unit of `exp − 1`, steepness \[1/rad\], angle
    /// \[rad\], and side (1 at the upper end, −1 at the lower).
    Ligament([f64; 4]),
    /// A detent: amplitude \[N m\], teeth in a turn, phase \[rad\].
    Detent([f64; 3]),
}

impl Elastic {
    /// The law at work.
    pub fn acting(&self, joint: usize) -> Box<dyn Acts> {
        Box::new(Stored {
            joint,
            law: *self,
            stretch: 0.0,
        })
    }
}

struct Stored {
    joint: usize,
    law: Elastic,
    /// Of a creeping spring \[rad\].
    stretch: f64,
}

impl Acts for Stored {
    fn act(&self, now: &Instant, loads: &mut Loads) {
        let (j, q) = (self.joint, now.q[self.joint]);
        loads.resist[j] += match self.law {
            Elastic::Spring([stiffness, rest]) => stiffness * (q - rest),
            Elastic::Cubic([stiffness, rest]) => {
                let x = q - rest;
                stiffness * x * x * x
            }
            Elastic::Moment(moment) => moment,
            Elastic::Creeping([stiffness, _]) => stiffness * self.stretch,
            Elastic::Cord([stiffness, share, rest]) => {
                let pull = stiffness * (q + share * now.q[j - 1] - rest);
                loads.resist[j - 1] += share * pull;
                pull
            }
            Elastic::Ligament([moment, steepness, from, side]) => {
                let beyond = (side * (q - from)).max(0.0);
                side * moment * (libm::exp(steepness * beyond) - 1.0)
            }
            Elastic::Detent([amplitude, teeth, phase]) => amplitude * libm::sin(teeth * q + phase),
        };
    }

    fn advance(&mut self, now: &Instant, step: f64) {
        if let Elastic::Creeping([_, time]) = self.law {
            // Exact for a constant speed over the step.
            let left = libm::exp(-step / time);
            self.stretch = self.stretch * left + now.qd[self.joint] * time * (1.0 - left);
        }
    }
}
