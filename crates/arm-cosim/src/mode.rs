//! Modes in the life cycle of a slave.

/// Where a slave is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// Made, or reset.
    Instantiated = 0,
    /// Start values are set, outputs can be read.
    Initialization = 1,
    /// Between communication steps.
    Step = 2,
    /// At the end.
    Terminated = 3,
    /// After an error: it can be read, reset, brought back to a state and freed.
    Failed = 4,
    /// Model Exchange: between two stretches of integration.
    Event = 5,
    /// Model Exchange: integrated by the importer.
    Continuous = 6,
}

impl Mode {
    /// The mode as the standard calls it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated",
            Self::Initialization => "in initialization mode",
            Self::Step => "in step mode",
            Self::Terminated => "terminated",
            Self::Failed => "in error",
            Self::Event => "in event mode",
            Self::Continuous => "in continuous-time mode",
        }
    }

    pub(crate) fn numbered(number: u64) -> Option<Self> {
        let all = [
            Self::Instantiated,
            Self::Initialization,
            Self::Step,
            Self::Terminated,
            Self::Failed,
            Self::Event,
            Self::Continuous,
        ];
        usize::try_from(number)
            .ok()
            .and_then(|n| all.get(n).copied())
    }
}
