//! How a search asks whether a kind is there.

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
        }
    }

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

    /// With another nature.
    pub const fn of_nature(self, nature: Nature) -> Self {
        Self { nature, ..self }
    }
}
