//! The contact between hand and handle, and the rig that effects alter.

use arm_core::effect::{Effect, Kind};
use arm_core::{Contact, Invalid, Scalar, Setup, sample_arms};

use crate::common::Random;
use crate::dual::Dual;

fn loose() -> Contact<f64> {
    Contact {
        stiffness: [100.0, 200.0],
        damping: [1.0, 2.0],
        play: [0.5, 0.0],
    }
}

#[test]
fn forces_in_the_head() {
    let contact = loose();
    // Within the play nothing acts, not even the damper; beyond it the spring counts from its edge.
    assert_eq!(contact.force_on_arm([0.5, 0.0], [3.0, 0.0]), [0.0, 0.0]);
    assert_eq!(contact.force_on_arm([1.5, 0.0], [3.0, 0.0]), [103.0, 0.0]);
    assert_eq!(contact.force_on_arm([-1.5, 0.0], [0.0, 0.0]), [-100.0, 0.0]);
    // Without play spring and damper always act, and pull the arm towards the handle.
    assert_eq!(contact.force_on_arm([0.0, 0.25], [0.0, 2.0]), [0.0, 54.0]);
    assert_eq!(contact.force_on_arm([0.0, 0.0], [0.0, 2.0]), [0.0, 4.0]);
    assert_eq!(contact.energy([1.5, 0.25]), 50.0 + 6.25);
}

#[test]
fn spring_force_is_the_slope_of_its_energy() {
    let mut random = Random(111);
    let wide = |pair: [f64; 2]| pair.map(Dual::of);
    let c = loose();
    let dual = Contact {
        stiffness: wide(c.stiffness),
        damping: wide(c.damping),
        play: wide(c.play),
    };
    for _ in 0..1000 {
        let gap = [random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)];
        let force = c.force_on_arm(gap, [0.0, 0.0]);
        for axis in 0..2 {
            let moved =
                core::array::from_fn(|i| Dual::new(gap[i], if i == axis { 1.0 } else { 0.0 }));
            assert!((dual.energy(moved).slope - force[axis]).abs() < 1e-12);
        }
    }
}

#[test]
fn damping_takes_energy() {
    let mut random = Random(112);
    for _ in 0..1000 {
        let mut pair = || [random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)];
        let (gap, rate) = (pair(), pair());
        let [still, moving] = [[0.0, 0.0], rate].map(|rate| loose().force_on_arm(gap, rate));
        // The force on the arm is opposite to that on the handle, whose motion opens the gap.
        let power: f64 = (0..2).map(|i| (moving[i] - still[i]) * rate[i]).sum();
        assert!(power >= 0.0);
    }
}

#[test]
fn an_impossible_rig_is_named() {
    let arm = sample_arms::human_arm();
    let mut rig = Setup::new(&arm, loose());
    assert_eq!(rig.chain(), Ok(arm));
    Effect::new(Kind::SegmentLength, 2)
        .with(&[-0.2])
        .alter(&mut rig);
    let refused = rig.chain();
    assert!(
        matches!(refused, Err(Invalid::OutOfRange { name: "length of segment", index: 2, found, .. }) if (found + 0.107).abs() < 1e-15)
    );
}
