//! One module per source file, or more where one is not enough; `noise`, `synthetic` and `joint_method` are what they share.

mod bits;
mod by_simulation;
mod cascade;
mod coloured;
mod condense;
mod covariance;
mod derivative;
mod design;
mod factor;
mod filter;
mod imperfections;
mod joint;
mod joint_input;
mod joint_method;
mod long_run;
mod noise;
mod online;
mod program;
mod quasi_static;
mod rank;
mod streamed;
mod student;
mod svd;
mod synthetic;
