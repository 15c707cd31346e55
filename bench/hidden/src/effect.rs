//! What can be hidden: the effects, written anew.
//!
//! Where the law of the catalogue is the only sensible one (a linear spring is a linear spring) the difference lies in how it
//! is computed; dry friction, its excess at low speed, thixotropy, end range, reflex, tremor and burst follow laws of their
//! own. `exact` of a [`Scored`] value says whether the catalogue's parameter has that value strictly.

mod acting;
mod body;
mod dry;
mod elastic;
mod muscle;
mod sensing;

pub use acting::{Acts, Instant, Loads};
pub use body::Wobble;
pub use dry::Dry;
pub use elastic::Elastic;
pub use muscle::Muscle;
pub use sensing::Sensing;

use crate::random::Random;
use crate::rig::{BasePath, Plane, Rig};

/// A hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Hidden {
    /// Name in the catalogue, or of what lies outside it.
    pub kind: &'static str,
    /// Joint or segment, from 0.
    pub joint: Option<usize>,
    /// Force channel, 0 for `Fy`, 1 for `Fz`.
    pub channel: Option<usize>,
    /// The only trial in which it acts.
    pub trial: Option<usize>,
    /// What it does.
    pub law: Law,
    /// Its values in the parameters of the catalogue.
    pub scored: Vec<Scored>,
}

/// The value of a parameter of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// Name of the parameter.
    pub name: &'static str,
    /// In SI units.
    pub value: f64,
    /// Whether the law of the catalogue with this value is what acts. Otherwise it is of this size.
    pub exact: bool,
}

/// What a hidden effect does.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// Dry friction at a joint.
    Dry(Dry),
    /// `c q̇` \[N m s/rad\].
    Viscous(f64),
    /// `c q̇ |q̇|` \[N m s²/rad²\].
    Drag(f64),
    /// Damping that grows with the square of the distance from an angle: coefficient there \[N m s/rad\], angle, distance
    /// at which it doubles \[rad\].
    PlacedDamping([f64; 3]),
    /// Something that stores energy.
    Elastic(Elastic),
    /// Something that muscles do.
    Muscle(Muscle),
    /// A change of a segment: mass moment \[kg m\], inertia \[kg m²\], length \[m\].
    Segment([f64; 3]),
    /// A rotor \[kg m²\].
    Rotor(f64),
    /// Point mass at the hand \[kg\].
    HandMass(f64),
    /// A soft mass on a segment.
    Wobble(Wobble),
    /// Gravity turned counter-clockwise \[rad\].
    Tilt(f64),
    /// A first joint that moves.
    Base(BasePath),
    /// Clearance on both sides \[m\].
    Play(Plane),
    /// In series with the contact \[m/N\].
    Compliance(Plane),
    /// Beside that of the contact \[N s/m\].
    Damping(Plane),
    /// The handle beside where the robot's angles say: amplitude y and z \[m\], frequency \[Hz\], phase \[rad\].
    Ripple([f64; 4]),
    /// What sensors read.
    Sensing(Sensing),
}

impl Hidden {
    /// Changes the true rig.
    pub fn alter(&self, rig: &mut Rig) {
        let joint = self.joint.unwrap_or(0);
        match &self.law {
            Law::Segment([moment, inertia, length]) => {
                let link = &mut rig.links[joint];
                link.com += moment / link.mass;
                link.inertia += inertia;
                link.length += length;
            }
            Law::Rotor(inertia) => rig.rotors[joint] += inertia,
            Law::HandMass(mass) => rig.hand_mass += mass,
            Law::Wobble(wobble) => wobble.lighten(&mut rig.links[joint]),
            Law::Tilt(angle) => {
                let (sin, cos) = libm::sincos(*angle);
                let [y, z] = rig.gravity;
                rig.gravity = [y * cos - z * sin, y * sin + z * cos];
            }
            Law::Base(path) => rig.base_path = *path,
            Law::Play(play) => rig.contact.play = *play,
            Law::Compliance(softer) => {
                for k in 0..2 {
                    rig.contact.stiffness[k] = 1.0 / (1.0 / rig.contact.stiffness[k] + softer[k]);
                }
            }
            Law::Damping(more) => {
                for k in 0..2 {
                    rig.contact.damping[k] += more[k];
                }
            }
            _ => {}
        }
    }

    /// What acts in a trial, with whatever differs from trial to trial.
    pub fn acting(&self, rig: &Rig, trial: usize, random: &mut Random) -> Option<Box<dyn Acts>> {
        if self.trial.is_some_and(|only| only != trial) {
            return None;
        }
        let joint = self.joint.unwrap_or(0);
        match &self.law {
            Law::Dry(law) => Some(law.acting(joint)),
            Law::Viscous(c) => Some(damping(joint, [*c, 0.0, 0.0], [0.0, 1.0])),
            Law::Drag(c) => Some(damping(joint, [0.0, *c, 0.0], [0.0, 1.0])),
            Law::PlacedDamping([c, at, width]) => {
                Some(damping(joint, [0.0, 0.0, *c], [*at, *width]))
            }
            Law::Elastic(law) => Some(law.acting(joint)),
            Law::Muscle(law) => Some(law.acting(joint, random)),
            Law::Wobble(law) => Some(law.acting(joint, rig)),
            _ => None,
        }
    }

    /// Displacement of the handle beside where the robot's angles say \[m\].
    pub fn ripple(&self, time: f64) -> Plane {
        match self.law {
            Law::Ripple([y, z, frequency, phase]) => {
                let sin = libm::sin(core::f64::consts::TAU * frequency * time + phase);
                [y * sin, z * sin]
            }
            _ => [0.0; 2],
        }
    }
}

/// Losses that depend on speed and place.
struct Damping {
    joint: usize,
    linear: f64,
    square: f64,
    placed: f64,
    at: f64,
    width: f64,
}

fn damping(
    joint: usize,
    [linear, square, placed]: [f64; 3],
    [at, width]: [f64; 2],
) -> Box<dyn Acts> {
    Box::new(Damping {
        joint,
        linear,
        square,
        placed,
        at,
        width,
    })
}

impl Acts for Damping {
    fn act(&self, now: &Instant, loads: &mut Loads) {
        let (q, v) = (now.q[self.joint], now.qd[self.joint]);
        let away = (q - self.at) / self.width;
        let coefficient = self.linear + self.square * v.abs() + self.placed * away * away;
        loads.resist[self.joint] += coefficient * v;
    }
}
