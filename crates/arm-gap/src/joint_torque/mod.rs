//! Rigs without a robot: free or motor-driven runs, and losses fitted by their decay.

pub mod free_decay_fit;
pub mod free_run;
