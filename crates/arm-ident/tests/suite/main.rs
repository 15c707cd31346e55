//! One module per source file; `noise` is the seeded source of random numbers that they share.

mod bits;
mod coloured;
mod condense;
mod covariance;
mod derivative;
mod design;
mod factor;
mod filter;
mod joint;
mod long_run;
mod noise;
mod online;
mod program;
mod quasi_static;
mod rank;
mod student;
mod svd;
mod synthetic;
