//! Surroundings of the arm: contact at the handle, robot, and the quantities that imperfections of a rig alter.

pub(crate) mod contact;
pub(crate) mod placement;
pub(crate) mod robot;
pub(crate) mod setup;
