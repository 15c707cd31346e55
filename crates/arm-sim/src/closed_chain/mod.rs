//! Dynamics of the closed chain of arm, contact and handle at one instant, and its linearisation.

pub(crate) mod branch_free;
pub(crate) mod joint_space;
pub(crate) mod linearized;
pub(crate) mod model;
pub(crate) mod stability;
pub(crate) mod state;
