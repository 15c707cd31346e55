//! The arm as JSON, and its token.

use arm_cosim::{ArmSpec, Slave, token};
use arm_sim::Port;

#[test]
fn every_value_comes_back_to_the_last_bit() {
    let mut spec = ArmSpec::sample();
    spec.segments[0].mass = 0.1 + 0.2;
    spec.start.q[1] = f64::MIN_POSITIVE;
    let text = spec.to_json().unwrap();
    assert_eq!(ArmSpec::from_json(&text).unwrap(), spec);
    assert_eq!(ArmSpec::from_json(&text).unwrap().to_json().unwrap(), text);
}

#[test]
fn what_cannot_be_an_arm_is_refused() {
    let good = ArmSpec::sample().to_json().unwrap();
    for (old, new, message) in [
        ("\"force\"", "\"pull\"", "unknown variant `pull`"),
        ("\"coulomb\"", "\"coulom\"", "effect 1: unknown kind"),
        ("\"gravity\"", "\"grafity\"", "unknown field"),
        ("9.81", "null", "invalid type"),
        ("9.81", "1e999", "out of range"),
        (
            "\"segments\": [",
            "\"segments\": [], \"x\": [",
            "unknown field",
        ),
    ] {
        assert!(good.contains(old), "{old}");
        let refused = ArmSpec::from_json(&good.replacen(old, new, 1)).unwrap_err();
        assert!(refused.message.contains(message), "{}", refused.message);
    }
    let mut spec = ArmSpec::sample();
    spec.start.q.pop();
    assert!(
        spec.to_json()
            .unwrap_err()
            .message
            .contains("1 start values q")
    );
    spec = ArmSpec::sample();
    spec.step = f64::NAN;
    assert!(Slave::new(spec).is_err());
}

#[test]
fn the_token_changes_with_every_value() {
    let spec = ArmSpec::sample();
    let mut seen = vec![token(&spec).unwrap()];
    let mut changed = |change: fn(&mut ArmSpec)| {
        let mut other = spec.clone();
        change(&mut other);
        let token = token(&other).unwrap();
        assert!(!seen.contains(&token));
        seen.push(token);
    };
    changed(|s| s.gravity = f64::from_bits(s.gravity.to_bits() + 1));
    changed(|s| s.segments[1].com[1] = 1e-300);
    changed(|s| s.effects[0].values[0] += 1e-15);
    changed(|s| s.contact_damping[1] = 0.0);
    changed(|s| s.name.push('x'));
    changed(|s| s.port = Port::Motion);
    changed(|s| s.step *= 2.0);
}
