//! Nothing is left behind: by instances, by states.

use std::ptr::null_mut;

use arm_fmu::fmi3;

use crate::importer::{Resources, do_step, ready};

#[test]
fn instances_and_states_are_given_back() {
    let resources = Resources::new("memory");
    let cycle = || unsafe {
        let instance = resources.three();
        ready(instance);
        let mut state = null_mut();
        assert_eq!(fmi3::fmi3GetFMUState(instance, &mut state), 0);
        assert_eq!(do_step(instance, 0.0, 0.00025), 0);
        assert_eq!(fmi3::fmi3SetFMUState(instance, state), 0);
        // Into the same state again.
        assert_eq!(fmi3::fmi3GetFMUState(instance, &mut state), 0);
        assert_eq!(fmi3::fmi3FreeFMUState(instance, &mut state), 0);
        assert!(state.is_null());
        fmi3::fmi3FreeInstance(instance);
    };
    cycle();
    let counted = allocation_counter::measure(|| (0..1000).for_each(|_| cycle()));
    assert!(counted.count_total > 1000);
    assert_eq!((counted.count_current, counted.bytes_current), (0, 0));
}
