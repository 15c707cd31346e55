//! Before an experiment: what a movement will show, and one that shows it well.

pub mod design;
pub mod forecast;
pub mod results;
