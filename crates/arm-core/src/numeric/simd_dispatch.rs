//! Choice of the widest vectors of the processor at run time.
//!
//! What goes through [`dispatch`] is compiled again for AVX2 and for AVX-512. Its operations and their order stay what they are and none are
//! fused, so the bits are the same; only more numbers go through one instruction.

pub use pulp::NullaryFnOnce as Computation;
pub use pulp::{Simd, WithSimd};

/// Computes, with the vectors that this processor has: a [`Computation`], whose loops the compiler makes wide, or a [`WithSimd`], which
/// names its vectors.
///
/// Only what is inlined is compiled for them: `call`, and all that it calls and that counts, is `#[inline(always)]`.
#[inline(always)]
pub fn dispatch<C: WithSimd>(computation: C) -> C::Output {
    pulp::Arch::new().dispatch(computation)
}

/// Whether a vector register holds eight numbers (AVX-512). With narrower ones, eight lanes take two or more registers for each quantity,
/// and too few are left for the rest.
pub fn has_registers_of_eight() -> bool {
    struct Width;
    impl WithSimd for Width {
        type Output = usize;
        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }
    dispatch(Width) == 8
}
