//! One run, to the last bit.

use arm_sim::{digest, sample_experiments};

use crate::common::run;

/// Digest of [`sample_experiments::reference`]; the same on every platform, in debug and release, whatever the target's features.
const GOLDEN: u64 = 0xe8cf6740fbb033a9;

#[test]
fn the_reference_run_has_the_same_bits_everywhere() {
    let found = digest(&run(&sample_experiments::reference().expect("a sample"))).expect("numbers");
    assert_eq!(
        found, GOLDEN,
        "\nthe reference run has digest {found:#018x}, expected {GOLDEN:#018x}.\n\
         On one platform only: some arithmetic there is not that of IEEE 754 or came from its own mathematics library; find it.\n\
         On all platforms: a formula, an order of operations or what is recorded has changed. If that was meant, put the new\n\
         number here in a commit of its own that says why.\n"
    );
}
