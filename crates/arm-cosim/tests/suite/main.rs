//! Tests of arm-cosim: the table of variables, the arm as it travels, units. The life cycle is tested with FMUs and Python.

mod spec;
mod state;
mod time;
mod variables;
