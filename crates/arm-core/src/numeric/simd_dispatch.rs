//! Choice of the widest vectors of the processor at run time.
//!
//! What goes through [`dispatch`] is compiled again for AVX2 and for AVX-512. Its operations and their order stay what they are and none are
//! fused, so the bits are the same; only more numbers go through one instruction.

pub use pulp::NullaryFnOnce as Computation;

/// Computes, with the vectors that this processor has.
///
/// Only what is inlined is compiled for them: `call`, and all that it calls and that counts, is `#[inline(always)]`.
#[inline(always)]
pub fn dispatch<C: Computation>(computation: C) -> C::Output {
    pulp::Arch::new().dispatch(computation)
}
