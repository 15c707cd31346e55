//! The quantity of a variable.

/// The quantity of a variable; joints, segments and axes count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Time.
    Time,
    /// Force of the environment on the arm at its handle.
    ForceOnArm(usize),
    /// Position of the robot's handle.
    RobotPosition(usize),
    /// Velocity of the robot's handle.
    RobotVelocity(usize),
    /// Torque of a motor in a joint.
    Torque(usize),
    /// Time derivative of the force on the arm.
    ForceRate(usize),
    /// Acceleration of the robot's handle.
    RobotAcceleration(usize),
    /// Time derivative of the torque of a motor.
    TorqueRate(usize),
    /// Angle of a joint.
    Angle(usize),
    /// Speed of a joint.
    Speed(usize),
    /// Position of the arm's tip.
    TipPosition(usize),
    /// Velocity of the arm's tip.
    TipVelocity(usize),
    /// Force of the contact on the robot.
    ForceOnRobot(usize),
    /// Kinetic, potential and contact energy together.
    Energy,
    /// Work since the start: by the port, by motors, against resistance, lost in the contact.
    Work(usize),
    /// Time derivative of the angle of a joint.
    AngleRate(usize),
    /// Time derivative of the speed of a joint.
    SpeedRate(usize),
    /// Time derivative of a work.
    WorkRate(usize),
    /// Length of a segment.
    Length(usize),
    /// Mass of a segment.
    Mass(usize),
    /// Centre of mass along a segment.
    Com(usize),
    /// Centre of mass normal to a segment.
    ComNormal(usize),
    /// Moment of inertia of a segment.
    Inertia(usize),
    /// Gravity.
    Gravity,
    /// First joint.
    Base(usize),
    /// Stiffness of the contact.
    ContactStiffness(usize),
    /// Damping of the contact.
    ContactDamping(usize),
    /// A value of an effect: which effect, which parameter.
    Effect(usize, usize),
    /// Inner step.
    InnerStep,
}

impl Quantity {
    /// The continuous state whose time derivative this is.
    pub const fn state(self) -> Option<Self> {
        match self {
            Self::AngleRate(joint) => Some(Self::Angle(joint)),
            Self::SpeedRate(joint) => Some(Self::Speed(joint)),
            Self::WorkRate(which) => Some(Self::Work(which)),
            _ => None,
        }
    }

    /// The input whose time derivative this is.
    pub const fn input(self) -> Option<Self> {
        match self {
            Self::ForceRate(axis) => Some(Self::ForceOnArm(axis)),
            Self::RobotVelocity(axis) => Some(Self::RobotPosition(axis)),
            Self::RobotAcceleration(axis) => Some(Self::RobotVelocity(axis)),
            Self::TorqueRate(joint) => Some(Self::Torque(joint)),
            _ => None,
        }
    }

    /// Whether it is a continuous state.
    pub const fn is_state(self) -> bool {
        matches!(self, Self::Angle(_) | Self::Speed(_) | Self::Work(_))
    }
}
