//! Who is led, by what, and what the model knows of it.

use arm_core::anthropometry::{Grip, PARTS, Sex, Subject};

use crate::motion::Servo;
use crate::random::Random;
use crate::rig::{BasePath, Contact, Link, Passive, Rig, Robot};

/// A person, where it is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Person {
    /// \[kg\]
    pub body_mass: f64,
    /// \[m\]
    pub height: f64,
    /// "male" or "female".
    pub sex: &'static str,
}

/// The rig of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// None for the mechanical arm.
    pub person: Option<Person>,
    /// What is there, without the hidden effects.
    pub truth: Rig,
    /// What the model says.
    pub model: Rig,
    /// Relative standard deviation that the model states for its segments.
    pub uncertainty: f64,
    /// How well the robot follows.
    pub servo: Servo,
    /// Posture about which the movements go \[rad\].
    pub posture: Vec<f64>,
}

/// Gravity \[m/s²\].
const GRAVITY: f64 = 9.81;

impl Setting {
    /// Draws a rig.
    ///
    /// * `off` - how far the model's segments are off, in units of the uncertainty that it states
    ///
    /// # Errors
    /// In words, when there is no such person.
    pub fn draw(random: &mut Random, off: f64) -> Result<Self, String> {
        let human = random.chance(0.5);
        Self::of(human, off, random)
    }

    /// Draws the rig of a person or of the mechanical arm.
    ///
    /// # Errors
    /// As for [`Self::draw`].
    pub(crate) fn of(human: bool, off: f64, random: &mut Random) -> Result<Self, String> {
        let (person, links) = if human {
            let (person, links) = person(random)?;
            (Some(person), links)
        } else {
            (None, mechanical())
        };
        let uncertainty = if human {
            0.05
        } else {
            random.pick(&[0.01, 0.02])
        };
        let degrees: &[(f64, f64)] = if human {
            &[(-70.0, -58.0), (45.0, 65.0), (2.0, 12.0)]
        } else {
            &[(-65.0, -50.0), (50.0, 75.0)]
        };
        let posture: Vec<f64> = degrees
            .iter()
            .map(|(low, high)| random.within(*low, *high).to_radians())
            .collect();
        let joints = (0..links.len())
            .map(|j| passive(human, j, posture[j], random))
            .collect();
        let robot = Robot {
            lengths: random.pick(&[[0.45, 0.45], [0.48, 0.44], [0.46, 0.50]]),
            base: [random.within(1.0, 1.08), random.within(-0.15, 0.05)],
        };
        let damping = random.pick(&[15.0, 25.0, 40.0]);
        let model = Rig {
            rotors: vec![0.0; links.len()],
            links,
            joints,
            hand_mass: 0.0,
            gravity: [0.0, -GRAVITY],
            base: [0.0, 0.0],
            base_path: BasePath::Fixed,
            contact: Contact {
                stiffness: [10_000.0; 2],
                damping: [damping; 2],
                play: [0.0; 2],
            },
            robot,
        };
        let mut truth = model.clone();
        for link in &mut truth.links {
            let mut factor = || 1.0 + off * uncertainty * random.limited_normal(2.0);
            link.mass *= factor();
            link.com *= factor();
            link.inertia *= factor();
        }
        let servo = Servo {
            bandwidth: random.within(6.0, 10.0),
            wander: 1e-4,
        };
        Ok(Self {
            person,
            truth,
            model,
            uncertainty,
            servo,
            posture,
        })
    }
}

/// The mechanical arm of table 4.3 of the thesis; moments of inertia of uniform rods.
fn mechanical() -> Vec<Link> {
    [(0.376, 0.184, 1.440), (0.239, 0.115, 1.160)]
        .map(|(length, com, mass)| Link {
            length,
            mass,
            com,
            inertia: mass * length * length / 12.0,
        })
        .to_vec()
}

/// An upper extremity by the tables of de Leva.
fn person(random: &mut Random) -> Result<(Person, Vec<Link>), String> {
    let (sex, name) = random.pick(&[(Sex::Male, "male"), (Sex::Female, "female")]);
    let mean_height = if name == "male" { 1.78 } else { 1.66 };
    let height = libm::round(100.0 * (mean_height + 0.07 * random.limited_normal(2.0))) / 100.0;
    let index = random.within(20.0, 28.0);
    let body_mass = libm::round(index * height * height);
    let subject = Subject::new(body_mass, height, sex).map_err(|e| e.to_string())?;
    let mut links = Vec::new();
    for part in PARTS {
        let prior = subject
            .prior(part, None, Grip::Neutral)
            .map_err(|e| e.to_string())?;
        links.push(Link {
            length: prior.length,
            mass: prior.mass.value,
            com: prior.com.value,
            inertia: prior.inertia.value,
        });
    }
    let person = Person {
        body_mass,
        height,
        sex: name,
    };
    Ok((person, links))
}

fn passive(human: bool, joint: usize, posture: f64, random: &mut Random) -> Passive {
    let (stiffness, viscosity) = match (human, joint) {
        (true, 0) => ((0.5, 1.5), (0.15, 0.30)),
        (true, 1) => ((0.4, 1.0), (0.10, 0.25)),
        (true, _) => ((0.8, 1.6), (0.05, 0.12)),
        (false, _) => ((0.0, 0.5), (0.05, 0.20)),
    };
    Passive {
        stiffness: random.within(stiffness.0, stiffness.1),
        rest: posture + random.within(-0.2, 0.2),
        viscosity: random.within(viscosity.0, viscosity.1),
    }
}
