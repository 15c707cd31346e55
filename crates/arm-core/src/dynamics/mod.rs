//! Kinematics and dynamics of a chain in link form: inertia, Coriolis, gravity, energy, inverse and forward dynamics, regressor.

pub(crate) mod contributions;
pub(crate) mod coriolis;
pub(crate) mod energy;
pub(crate) mod gravity;
pub(crate) mod inertia;
pub(crate) mod inverse_and_forward;
pub(crate) mod kinematics;
pub(crate) mod products;
pub(crate) mod regressor;
pub(crate) mod torque_by_angle;
