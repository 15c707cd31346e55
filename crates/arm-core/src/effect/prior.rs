//! Prior knowledge of each kind of effect: its parts, sizes, family, and the error of its law.

use super::place::Place;

/// What is known of a kind before any data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// What of it may be there without the rest of it. None where nothing is known from which a search could start: such a kind is
    /// simulated, and identified where a model has it.
    pub parts: &'static [Part],
    /// How it comes and goes.
    pub nature: Nature,
    /// What of it is within the tolerance of a rig's calibration.
    pub promise: Option<Promise>,
    /// Square of the possible relative error of its law, the share of its sum of squares that it may leave unexplained: large for laws that
    /// represent a family of shapes.
    pub squared_law_error: f64,
    /// Its family, where its place does not decide it.
    pub family: Option<Family>,
    /// Typical size of its first parameter, for one N m of the arm's weight moment; zero where nothing is known.
    pub typical: f64,
    /// Whether every passive joint has it.
    pub passive: bool,
    /// Lowest and highest frequency that it has where it swings \[Hz\].
    pub frequencies: [f64; 2],
}

/// Effects of one mechanism, whose members may be indistinguishable by movements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Dry friction.
    Dry,
    /// Torques that grow with the speed.
    Rate,
    /// Springs of one joint.
    Elastic,
    /// Springs over two joints.
    TwoJoints,
    /// Masses and lengths.
    Segment,
    /// What the arm is fixed to.
    Frame,
    /// Between hand and robot.
    Contact,
    /// Sensors.
    Sensor,
    /// Muscles.
    Muscle,
}

impl Family {
    /// The word for it in results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dry => "dry",
            Self::Rate => "rate",
            Self::Elastic => "elastic",
            Self::TwoJoints => "two_joints",
            Self::Segment => "segment",
            Self::Frame => "frame",
            Self::Contact => "contact",
            Self::Sensor => "sensor",
            Self::Muscle => "muscle",
        }
    }

    /// The family of what acts at a place and has no other.
    pub(crate) const fn of_place(place: Place) -> Self {
        match place {
            Place::Joint => Self::Elastic,
            Place::Segment | Place::Hand => Self::Segment,
            Place::Frame | Place::Base => Self::Frame,
            Place::Contact => Self::Contact,
            Place::AngleSensor | Place::ForceSensor | Place::Sensors => Self::Sensor,
        }
    }
}

/// How an effect comes and goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// Always there, in every trial alike.
    Lasting,
    /// Periodic and locked to the start of the trial.
    Periodic,
    /// A rhythm with another phase in every trial.
    Rhythm,
    /// Once, in one trial.
    Burst,
    /// Once, in one trial, and it stays.
    Slip,
}

impl Nature {
    /// Whether it has a frequency and a phase.
    pub const fn swings(self) -> bool {
        matches!(self, Self::Periodic | Self::Rhythm)
    }
}

/// A tolerance of the calibration, see the table `[tolerance]` of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Promise {
    /// Offsets of joint angles.
    AngleOffset,
    /// Biases of force channels.
    ForceBias,
    /// Errors of their gains.
    ForceGain,
    /// Delay between forces and angles.
    TimeDelay,
}

/// A part of an effect that may be there without the others, as the stop at one end of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Positions of its sizes: with all of them zero it does nothing.
    pub sizes: &'static [usize],
    /// Shapes that occur, in every combination; other parameters have their defaults.
    pub shapes: &'static [(usize, Values)],
    /// Position of a rest angle: the torque is linear in size and size · rest together.
    pub rest: Option<usize>,
    /// Shapes that differ from one body or rig to the next by more than movements can hide.
    pub varying: &'static [usize],
    /// What is known of a shape, where something is: its position, expected value and standard deviation.
    pub expected: &'static [(usize, [f64; 2])],
    /// Small change of a size that is still visible; zero where it follows from the size of the torque.
    pub small: f64,
}

/// Values of a shape that occur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values {
    /// These.
    Each(&'static [f64]),
    /// The largest angle that the joint reached.
    Highest,
    /// The smallest.
    Lowest,
    /// The middle between them.
    Middle,
    /// All three.
    Across,
}

impl Part {
    /// The part with these sizes.
    pub const fn of(sizes: &'static [usize]) -> Self {
        Self {
            sizes,
            shapes: &[],
            rest: None,
            varying: &[],
            expected: &[],
            small: 0.0,
        }
    }

    /// With shapes that occur.
    pub const fn shaped(self, shapes: &'static [(usize, Values)]) -> Self {
        Self { shapes, ..self }
    }

    /// With a rest angle.
    pub const fn resting(self, parameter: usize) -> Self {
        Self {
            rest: Some(parameter),
            ..self
        }
    }

    /// With shapes that vary.
    pub const fn varying(self, varying: &'static [usize]) -> Self {
        Self { varying, ..self }
    }

    /// With something known of shapes.
    pub const fn expecting(self, expected: &'static [(usize, [f64; 2])]) -> Self {
        Self { expected, ..self }
    }

    /// With a small change of a size.
    pub const fn small(self, small: f64) -> Self {
        Self { small, ..self }
    }
}

impl Prior {
    /// A lasting effect of these parts.
    pub const fn lasting(parts: &'static [Part]) -> Self {
        Self {
            parts,
            nature: Nature::Lasting,
            promise: None,
            squared_law_error: 2e-5,
            family: None,
            typical: 0.0,
            passive: false,
            frequencies: [0.0, f64::INFINITY],
        }
    }

    /// Nothing from which a search could start.
    pub const NONE: Self = Self::lasting(&[]);

    /// A part whose size is the first parameter.
    pub const FIRST: Self = Self::lasting(&[Part::of(&[0])]);

    /// With the square of the possible relative error of its law.
    pub const fn with_law_error(self, squared_law_error: f64) -> Self {
        Self {
            squared_law_error,
            ..self
        }
    }

    /// What is within the tolerance of the calibration.
    pub const fn promised(self, promise: Promise) -> Self {
        Self {
            promise: Some(promise),
            ..self
        }
    }

    /// In a family that its place does not decide.
    pub const fn in_family(self, family: Family) -> Self {
        Self {
            family: Some(family),
            ..self
        }
    }

    /// With a typical size of its first parameter, for one N m of the arm's weight moment.
    pub const fn typically(self, typical: f64) -> Self {
        Self { typical, ..self }
    }

    /// Of every passive joint.
    pub const fn passive(self) -> Self {
        Self {
            passive: true,
            ..self
        }
    }

    /// With another nature.
    pub const fn of_nature(self, nature: Nature) -> Self {
        Self { nature, ..self }
    }

    /// With a lowest and a highest frequency \[Hz\].
    pub const fn between(self, low: f64, high: f64) -> Self {
        Self {
            frequencies: [low, high],
            ..self
        }
    }

    /// Whether it occurs with a frequency \[Hz\].
    pub fn has_frequency(&self, frequency: f64) -> bool {
        let [low, high] = self.frequencies;
        (low..=high).contains(&frequency)
    }
}
