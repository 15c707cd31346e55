//! The start of a simulated arm: the handle at its tip, or the arm at rest in an equilibrium.

use arm_sim::SimulationError;

use crate::plant::plant;
use crate::quantity::Quantity;
use crate::spec::ArmSpec;
use crate::status::Refused;

impl ArmSpec {
    /// The same arm with the robot's handle where its tip is at the start.
    ///
    /// # Errors
    /// [`Refused`] for an arm that the core refuses.
    pub fn with_handle_at_tip(mut self) -> Result<Self, Refused> {
        self.check()?;
        let mut plant = plant(&self)?;
        plant.start(&self, 0.0)?;
        self.start.handle = [0, 1].map(|axis| plant.output(Quantity::TipPosition(axis)));
        Ok(self)
    }

    /// The same arm at rest, in the stable equilibrium to which it comes from its start with what its port gives there: on
    /// the spring of the contact, or without a force on it.
    ///
    /// # Errors
    /// [`SimulationError::NoEquilibrium`] where there is none near; others for an arm that the core refuses.
    pub fn at_rest(mut self) -> Result<Self, SimulationError> {
        let mut plant = plant(&self)?;
        for axis in 0..2 {
            plant.set_input(Quantity::RobotPosition(axis), self.start.handle[axis]);
        }
        self.start.q = plant.rest(&self)?;
        self.start.qd.fill(0.0);
        Ok(self)
    }
}
