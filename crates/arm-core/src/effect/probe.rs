//! How a search asks whether a kind is there.

use super::place::Place;

/// What a kind tells those who look for it in data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Separate questions, each about parameters that are free together.
    pub questions: &'static [Question],
    /// How it comes and goes.
    pub nature: Nature,
    /// What of it the calibration of a rig promises to be small.
    pub promise: Option<Promise>,
    /// Share of what it shows (as a sum of squares) that its law may miss: much for laws that stand for a family of shapes.
    pub missed: f64,
    /// Its family, where its place does not decide it.
    pub family: Option<Family>,
    /// Typical size of its first parameter, for one N m of the arm's weight moment; zero where nothing is known.
    pub typical: f64,
    /// Whether it belongs to every passive joint, so that a joint without any law is asked for it first.
    pub passive: bool,
}

/// Effects that answer one question, of which movements may not tell the members apart.
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
            Place::Frame => Self::Frame,
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
    /// Periodic and locked to the start of the trial: its frequency is read off the data first.
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

/// A promise of the calibration, see the table `[tolerance]` of a data set.
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

/// One question about a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// Positions of the parameters that are free; with all of them zero the effect does nothing.
    pub free: &'static [usize],
    /// Shapes that are tried, in every combination; other parameters stay at their defaults.
    pub shapes: &'static [(usize, Values)],
    /// Position of a rest angle: the torque is linear in amplitude and amplitude · rest together.
    pub rest: Option<usize>,
    /// Shapes that are refined once the effect is found.
    pub refined: &'static [usize],
    /// What is known of a shape before the data, where something is: its position, expected value and standard deviation.
    pub expected: &'static [(usize, [f64; 2])],
    /// Change of a free parameter that is small and yet seen; zero where the size of the torque tells it.
    pub step: f64,
}

/// Values of a shape that are tried.
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
}

impl Question {
    /// About one parameter in which a joint torque is linear.
    pub const fn of(parameter: &'static [usize]) -> Self {
        Self {
            free: parameter,
            shapes: &[],
            rest: None,
            refined: &[],
            expected: &[],
            step: 0.0,
        }
    }

    /// With shapes that are tried.
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

    /// With shapes that are refined once the effect is found.
    pub const fn refining(self, refined: &'static [usize]) -> Self {
        Self { refined, ..self }
    }

    /// With something known of shapes before the data.
    pub const fn expecting(self, expected: &'static [(usize, [f64; 2])]) -> Self {
        Self { expected, ..self }
    }

    /// With a step of its own.
    pub const fn stepping(self, step: f64) -> Self {
        Self { step, ..self }
    }
}

impl Probe {
    /// One question about a lasting effect.
    pub const fn lasting(questions: &'static [Question]) -> Self {
        Self {
            questions,
            nature: Nature::Lasting,
            promise: None,
            missed: 2e-5,
            family: None,
            typical: 0.0,
            passive: false,
        }
    }

    /// No question: the kind can be simulated and identified where a model has it, and no search asks for it.
    pub const UNASKED: Self = Self::lasting(&[]);

    /// Whether its first parameter is there.
    pub const FIRST: Self = Self::lasting(&[Question::of(&[0])]);

    /// With a law that may miss a share of what it shows.
    pub const fn missing(self, missed: f64) -> Self {
        Self { missed, ..self }
    }

    /// What the calibration promises to be small.
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
}
