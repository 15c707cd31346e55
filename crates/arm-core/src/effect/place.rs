//! Places at which effects act.

/// Where an effect acts, and so what its index means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In a joint.
    Joint,
    /// On a segment.
    Segment,
    /// On the whole arm.
    Frame,
    /// On the base, the place of the first joint.
    Base,
    /// Between hand and robot.
    Contact,
    /// In a sensor of joint angles.
    AngleSensor,
    /// In one channel of the force sensor; the index is 0 = `Fy`, 1 = `Fz`, 2 = `Mx`.
    ForceSensor,
    /// At the hand, the tip of the last segment.
    Hand,
    /// In all channels of the sensors together.
    Sensors,
}

impl Place {
    /// The word for it in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Segment => "segment",
            Self::Frame => "frame",
            Self::Base => "base",
            Self::Contact => "contact",
            Self::AngleSensor => "angle sensor",
            Self::ForceSensor => "force sensor",
            Self::Hand => "hand",
            Self::Sensors => "sensors",
        }
    }

    /// The key that an effect here needs besides its values: `"joint"` (for a segment its number), `"channel"` or nothing.
    pub const fn address(self) -> Option<&'static str> {
        match self {
            Self::Joint | Self::Segment | Self::AngleSensor => Some("joint"),
            Self::ForceSensor => Some("channel"),
            Self::Frame | Self::Base | Self::Contact | Self::Hand | Self::Sensors => None,
        }
    }
}
