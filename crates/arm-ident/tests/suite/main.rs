//! One module per source file.

mod condense;
