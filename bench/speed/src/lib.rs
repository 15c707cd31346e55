//! Problems that benchmarks share; the benchmarks themselves are in `benches/`.

pub mod identification;
