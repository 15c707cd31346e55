//! A segment that is not rigid.

use super::acting::{Acts, Instant, Loads};
use crate::rig::{Link, Plane, Rig};

/// Soft tissue: part of a segment's mass hangs on springs at its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wobble {
    /// \[kg\]
    pub mass: f64,
    /// Of the mass on its springs \[Hz\].
    pub frequency: f64,
    /// Part of the critical damping.
    pub damping: f64,
}

impl Wobble {
    /// Takes the soft part off the bone: where nothing moves, the segment weighs what it did.
    pub fn lighten(&self, link: &mut Link) {
        link.mass -= self.mass;
    }

    /// The soft mass at work, at rest where it hangs at the start.
    pub fn acting(&self, link: usize, rig: &Rig) -> Box<dyn Acts> {
        let omega = core::f64::consts::TAU * self.frequency;
        Box::new(Soft {
            link,
            com: rig.links[link].com,
            mass: self.mass,
            gravity: rig.gravity,
            stiffness: self.mass * omega * omega,
            damping: 2.0 * self.damping * self.mass * omega,
            state: None,
        })
    }
}

struct Soft {
    link: usize,
    com: f64,
    mass: f64,
    gravity: Plane,
    stiffness: f64,
    damping: f64,
    /// Place and velocity of the mass.
    state: Option<[Plane; 2]>,
}

impl Soft {
    /// Where the springs are fixed, and how fast that moves.
    fn anchor(&self, now: &Instant) -> [Plane; 2] {
        let place = |point: Plane, angle: f64, reach: f64| {
            let (sin, cos) = libm::sincos(angle);
            [point[0] + reach * cos, point[1] + reach * sin]
        };
        let at = place(now.points[self.link], now.angles[self.link], self.com);
        let (mut velocity, mut speed) = ([0.0; 2], 0.0);
        for i in 0..=self.link {
            speed += now.qd[i];
            let from = now.points[i];
            let to = if i == self.link {
                at
            } else {
                now.points[i + 1]
            };
            velocity[0] -= speed * (to[1] - from[1]);
            velocity[1] += speed * (to[0] - from[0]);
        }
        [at, velocity]
    }

    /// Force of the springs on the segment \[N\], and where.
    fn force(&self, now: &Instant) -> (Plane, Plane) {
        let [at, velocity] = self.anchor(now);
        let weight = self.gravity.map(|g| self.mass * g);
        let force = match &self.state {
            None => weight,
            Some([place, speed]) => core::array::from_fn(|k| {
                self.stiffness * (place[k] - at[k]) + self.damping * (speed[k] - velocity[k])
            }),
        };
        (at, force)
    }
}

impl Acts for Soft {
    fn act(&self, now: &Instant, loads: &mut Loads) {
        let (at, force) = self.force(now);
        loads.pushes.push((self.link, at, force));
    }

    fn advance(&mut self, now: &Instant, step: f64) {
        let (at, force) = self.force(now);
        let sag: Plane = self.gravity.map(|g| self.mass * g / self.stiffness);
        let [place, speed] = self
            .state
            .get_or_insert([[at[0] + sag[0], at[1] + sag[1]], [0.0; 2]]);
        for k in 0..2 {
            speed[k] += step * (self.gravity[k] - force[k] / self.mass);
            place[k] += step * speed[k];
        }
    }
}
