//! Unrolled loops over joints.

/// `for i in first..N`, or backwards, with the indices below four written out as constants.
///
/// Left to itself the compiler may compute one lane of several joints at once instead of all lanes of one joint, which
/// gathers from memory and takes five times as long.
macro_rules! each {
    ($i:ident in $first:expr, $end:expr => $body:block) => {
        each!(@ $i $first, $end, $body, 0 1 2 3);
        for $i in Ord::max(4, $first)..$end $body
    };
    ($i:ident in rev $first:expr, $end:expr => $body:block) => {
        for $i in (Ord::max(4, $first)..$end).rev() $body
        each!(@ $i $first, $end, $body, 3 2 1 0);
    };
    (@ $i:ident $first:expr, $end:expr, $body:block, $($value:literal)*) => {
        $(if ($first..$end).contains(&$value) {
            let $i: usize = $value;
            $body
        })*
    };
}
pub(crate) use each;
