//! How the channels change with small changes of a hypothesis, from the equation of motion linearised along a simulated run.

pub mod linearization_point;
pub mod linearized_run;
pub mod normal_equations;
pub(crate) mod rows;
