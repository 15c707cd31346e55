//! State in storage that the caller owns.

use crate::armrs_status::{self, ARMRS_NOT_INITIALISED};

/// Opaque storage of a fixed size for a state of type `Inner`.
///
/// # Safety
/// `storage` points to memory of the struct itself that is large enough and aligned for an `Inner`.
pub unsafe trait Held: Sized {
    /// What is kept.
    type Inner: Copy;
    /// A number that says that it is there; different for each type.
    const TAG: u64;
    fn tag(&self) -> u64;
    fn set_tag(&mut self, tag: u64);
    fn storage(&self) -> *const Self::Inner;
    fn storage_mut(&mut self) -> *mut Self::Inner;

    /// What is kept.
    fn inner(&self) -> Result<&Self::Inner, armrs_status> {
        if self.tag() != Self::TAG {
            return Err(ARMRS_NOT_INITIALISED);
        }
        // SAFETY: the tag is written after an `Inner` only.
        Ok(unsafe { &*self.storage() })
    }
    fn inner_mut(&mut self) -> Result<&mut Self::Inner, armrs_status> {
        if self.tag() != Self::TAG {
            return Err(ARMRS_NOT_INITIALISED);
        }
        // SAFETY: the tag is written after an `Inner` only.
        Ok(unsafe { &mut *self.storage_mut() })
    }
    /// Keeps a state.
    fn keep(&mut self, inner: &Self::Inner) {
        // SAFETY: the storage is large enough and aligned.
        unsafe { self.storage_mut().write(*inner) };
        self.set_tag(Self::TAG);
    }
}

/// Implements [`Held`] for a struct with the fields `tag` and `words`.
macro_rules! held {
    ($name:ident holds $inner:ty, $tag:literal) => {
        const _: () = assert!(
            core::mem::size_of::<$inner>() <= core::mem::size_of::<$name>() - 8,
            "more words are needed"
        );
        const _: () = assert!(core::mem::align_of::<$inner>() <= core::mem::align_of::<u64>());
        // SAFETY: size and alignment are checked above; `words` is behind `tag` in a struct of C.
        unsafe impl crate::held::Held for $name {
            type Inner = $inner;
            const TAG: u64 = u64::from_le_bytes(*$tag);
            fn tag(&self) -> u64 {
                self.tag
            }
            fn set_tag(&mut self, tag: u64) {
                self.tag = tag;
            }
            fn storage(&self) -> *const $inner {
                self.words.as_ptr().cast()
            }
            fn storage_mut(&mut self) -> *mut $inner {
                self.words.as_mut_ptr().cast()
            }
        }
    };
}
pub(crate) use held;
