//! Tests of arm-fmu: the C interfaces as a hostile importer meets them.

mod hostile;
mod importer;
mod memory;
