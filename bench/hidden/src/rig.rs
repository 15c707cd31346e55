//! The mechanical side of a session: segments, passive joints, contact, robot.

/// A point or vector of the plane, y forward and z up.
pub type Plane = [f64; 2];

/// A rigid segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Joint to joint, or joint to handle \[m\].
    pub length: f64,
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass from the proximal joint \[m\].
    pub com: f64,
    /// About the centre of mass \[kg m²\].
    pub inertia: f64,
}

/// What a joint does by itself, known to the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passive {
    /// \[N m/rad\]
    pub stiffness: f64,
    /// \[rad\]
    pub rest: f64,
    /// \[N m s/rad\]
    pub viscosity: f64,
}

impl Passive {
    /// A joint without any law.
    pub const NONE: Self = Self {
        stiffness: 0.0,
        rest: 0.0,
        viscosity: 0.0,
    };
}

/// Spring and damper between hand and handle, in y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// \[N/m\]
    pub stiffness: Plane,
    /// \[N s/m\]
    pub damping: Plane,
    /// Half the clearance of the slot in which the handle sits \[m\].
    pub play: Plane,
}

impl Contact {
    /// Force on the arm of a handle that is displaced by `gap` and moves with `rate` relative to the hand \[N\].
    ///
    /// The walls of the slot push only; where there is clearance their damping fades in over a tenth of a millimetre.
    pub fn force_on_arm(&self, gap: Plane, rate: Plane) -> Plane {
        core::array::from_fn(|k| {
            let play = self.play[k];
            if play <= 0.0 {
                return self.stiffness[k] * gap[k] + self.damping[k] * rate[k];
            }
            let depth = (gap[k].abs() - play).max(0.0);
            let wet = (depth / WALL).min(1.0);
            let push = self.stiffness[k] * depth
                + wet * self.damping[k] * rate[k] * libm::copysign(1.0, gap[k]);
            libm::copysign(push.max(0.0), gap[k])
        })
    }
}

/// Depth at which the damping of a wall is complete \[m\].
const WALL: f64 = 1e-4;

/// How the first joint moves with its own angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BasePath {
    /// Not at all.
    Fixed,
    /// Along a straight line \[m/rad\], from `rest` \[rad\].
    Line {
        /// Displacement for each radian.
        per_angle: Plane,
        /// Angle without displacement.
        rest: f64,
    },
    /// Round a circle that is run through faster than the arm turns.
    Circle {
        /// \[m\]
        radius: f64,
        /// Turns of the circle for one of the arm.
        turns: f64,
        /// \[rad\]
        rest: f64,
    },
}

impl BasePath {
    /// Displacement \[m\] and its derivative to the angle \[m/rad\].
    pub fn at(&self, q: f64) -> (Plane, Plane) {
        match *self {
            Self::Fixed => ([0.0; 2], [0.0; 2]),
            Self::Line { per_angle, rest } => (per_angle.map(|u| u * (q - rest)), per_angle),
            Self::Circle {
                radius,
                turns,
                rest,
            } => {
                let (sin, cos) = libm::sincos(turns * (q - rest));
                (
                    [radius * (cos - 1.0), radius * sin],
                    [-radius * turns * sin, radius * turns * cos],
                )
            }
        }
    }
}

/// A rig: the true one, or the one that the model describes.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Proximal first.
    pub links: Vec<Link>,
    /// One a segment.
    pub joints: Vec<Passive>,
    /// Inertia of a rotor that turns with each joint \[kg m²\].
    pub rotors: Vec<f64>,
    /// Point mass at the hand \[kg\].
    pub hand_mass: f64,
    /// \[m/s²\]
    pub gravity: Plane,
    /// First joint \[m\].
    pub base: Plane,
    /// How it moves.
    pub base_path: BasePath,
    /// Between hand and handle.
    pub contact: Contact,
    /// Leads the handle.
    pub robot: Robot,
}

impl Rig {
    /// Number of joints.
    pub fn size(&self) -> usize {
        self.links.len()
    }

    /// Joints and tip at joint angles: `size() + 1` points, and the directions of the links.
    pub fn points(&self, q: &[f64]) -> (Vec<Plane>, Vec<f64>) {
        let (shift, _) = self.base_path.at(q[0]);
        let mut at = [self.base[0] + shift[0], self.base[1] + shift[1]];
        let (mut points, mut angles, mut angle) = (vec![at], Vec::new(), 0.0);
        for (link, q) in self.links.iter().zip(q) {
            angle += q;
            let (sin, cos) = libm::sincos(angle);
            at = [at[0] + link.length * cos, at[1] + link.length * sin];
            points.push(at);
            angles.push(angle);
        }
        (points, angles)
    }

    /// Where the hand ends \[m\].
    pub fn tip(&self, q: &[f64]) -> Plane {
        self.points(q).0[self.size()]
    }
}

/// Two links that lead the handle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot {
    /// \[m\]
    pub lengths: Plane,
    /// First axis \[m\].
    pub base: Plane,
}

impl Robot {
    /// Angles with the handle at a point and the elbow above the line to it; the handle is at smaller y than the base.
    ///
    /// `None` within 5 cm of full stretch or full fold.
    pub fn angles(&self, handle: Plane) -> Option<Plane> {
        let [y, z] = [handle[0] - self.base[0], handle[1] - self.base[1]];
        let [a, b] = self.lengths;
        let distance = (y * y + z * z).sqrt();
        if y >= 0.0 || distance > a + b - 0.05 || distance < (a - b).abs() + 0.05 {
            return None;
        }
        // Law of cosines, at the base and at the elbow.
        let at_base = (a * a + distance * distance - b * b) / (2.0 * a * distance);
        let at_elbow = (a * a + b * b - distance * distance) / (2.0 * a * b);
        let to_handle = libm::atan2(-z, -y) + core::f64::consts::PI;
        let first = to_handle - libm::acos(at_base);
        Some([first, core::f64::consts::PI - libm::acos(at_elbow)])
    }

    /// Where the handle is \[m\].
    pub fn handle(&self, q: Plane) -> Plane {
        let ((s1, c1), (s2, c2)) = (libm::sincos(q[0]), libm::sincos(q[0] + q[1]));
        let [a, b] = self.lengths;
        [
            self.base[0] + a * c1 + b * c2,
            self.base[1] + a * s1 + b * s2,
        ]
    }
}
