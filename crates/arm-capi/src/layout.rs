//! Sizes of structs, which the header asserts as well.

use crate::{
    ARMRS_JOINTS, armrs_decision, armrs_effect, armrs_load, armrs_motion, armrs_real, armrs_reason,
    armrs_sample_status, armrs_segment, armrs_status,
};

const _: () = {
    use core::mem::size_of;
    const REAL: usize = size_of::<armrs_real>();
    assert!(size_of::<armrs_segment>() == 5 * REAL);
    assert!(size_of::<armrs_effect>() == 8 + 6 * REAL);
    assert!(size_of::<armrs_motion>() == (1 + 3 * ARMRS_JOINTS) * REAL);
    assert!(size_of::<armrs_load>() == (3 + ARMRS_JOINTS) * REAL);
    assert!(size_of::<armrs_status>() == 4 && size_of::<armrs_sample_status>() == 4);
    assert!(size_of::<armrs_decision>() == 4 && size_of::<armrs_reason>() == 4);
};
