//! Dependencies of each unknown of a description, from which an importer reads direct feedthrough.

use arm_sim::Port;

use crate::quantity::Quantity;
use crate::spec::ArmSpec;
use crate::variables::{Causality, Initial, Variable};

/// When a dependency holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum When {
    /// While the arm moves.
    Moving,
    /// In the initialization, where parameters and start values count as well.
    Starting,
}

/// A group of variables that something depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    Angles,
    Speeds,
    Port,
    Torques,
}

/// Value references that an unknown depends on; those that it does not depend on are left out.
pub(crate) fn dependencies(
    spec: &ArmSpec,
    table: &[Variable],
    quantity: Quantity,
    when: When,
) -> Vec<usize> {
    use Known::{Angles, Port as Inputs, Speeds, Torques};
    // Springs of a contact on this side hang on the handle.
    let stored: &[Known] = match spec.port {
        Port::Force => &[Angles, Speeds],
        Port::Motion => &[Angles, Speeds, Inputs],
    };
    let groups: &[Known] = match quantity {
        Quantity::AngleRate(joint) => {
            return places(table, |v| v.quantity == Quantity::Speed(joint));
        }
        // No work is done before the start.
        Quantity::Work(_) if when == When::Starting => return Vec::new(),
        state if state.is_state() => return places(table, |v| v.quantity == state),
        Quantity::TipPosition(_) => &[Angles],
        Quantity::TipVelocity(_) => &[Angles, Speeds],
        Quantity::ForceOnRobot(_) => &[Angles, Speeds, Inputs],
        Quantity::Energy => stored,
        _ => &[Angles, Speeds, Inputs, Torques],
    };
    let starting = when == When::Starting;
    places(table, |v| match v.quantity {
        Quantity::Angle(_) => groups.contains(&Angles),
        Quantity::Speed(_) => groups.contains(&Speeds),
        Quantity::ForceOnArm(_) | Quantity::RobotPosition(_) | Quantity::RobotVelocity(_) => {
            groups.contains(&Inputs)
        }
        Quantity::Torque(_) => groups.contains(&Torques),
        // Motions of the shoulder, rhythms and ripples go by the clock.
        Quantity::Time => !spec.effects.is_empty(),
        _ => starting && v.causality == Causality::Parameter && v.initial == Some(Initial::Exact),
    })
}

fn places(table: &[Variable], wanted: impl Fn(&Variable) -> bool) -> Vec<usize> {
    let rows = table.iter().enumerate();
    rows.filter(|(_, v)| wanted(v)).map(|(k, _)| k).collect()
}
