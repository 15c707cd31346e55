//! Effects that are switched off, digests, allocations.

use arm_core::effect::Effect;
use arm_sim::{Integrator, digest, simulate};

use crate::common::{run, several_effects, smooth};

#[test]
fn a_run_with_effects_switched_off_has_the_bits_of_a_run_without() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut without = smooth(0.5);
        without.integrator = integrator;
        let mut with = without.clone();
        let off = |e| Effect { on: false, ..e };
        with.effects.extend(several_effects().into_iter().map(off));
        let digests = [&with, &without].map(|e| digest(&run(e)).expect("numbers"));
        assert_eq!(digests[0], digests[1], "{integrator:?}");
    }
}

#[test]
fn a_digest_changes_with_one_bit() {
    let mut recording = run(&smooth(0.1));
    let before = digest(&recording).expect("numbers");
    recording.work.damped[3] = f64::from_bits(recording.work.damped[3].to_bits() ^ 1);
    assert_ne!(before, digest(&recording).expect("numbers"));
    recording.q[4] = f64::NAN;
    let refused = digest(&recording).expect_err("not a number").to_string();
    assert!(refused.contains("q, sample 2"), "{refused}");
}

/// The number of allocations is that of the columns and tables, whatever the number of steps and samples.
#[test]
fn the_step_loop_does_not_allocate() {
    let count = |duration: f64| {
        let mut experiment = smooth(2.0);
        experiment.effects = several_effects();
        experiment.duration = duration;
        let mut recording = None;
        let info = allocation_counter::measure(|| recording = Some(simulate(&experiment)));
        assert!(recording.is_some_and(|r| r.is_ok()));
        info.count_total
    };
    assert_eq!(count(0.1), count(2.0));
}
