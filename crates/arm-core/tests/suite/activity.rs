//! Effects that depend on muscle activity.

use arm_core::effect::{Effect, Kind, Local};

#[test]
fn torques_in_the_head() {
    let at = |activity: f64, q: f64, qd: f64| Local {
        activity,
        ..Local::moving(q, qd)
    };
    for (kind, values, local, expected) in [
        (Kind::ActiveViscosity, &[2.0][..], at(0.5, 1.0, 3.0), 3.0),
        (Kind::ActiveViscosity, &[2.0], at(0.5, 1.0, -3.0), -3.0),
        (Kind::ActiveViscosity, &[2.0], at(0.0, 1.0, 3.0), 0.0),
        (Kind::ActiveStiffness, &[5.0, 4.0], at(0.5, 2.0, 3.0), 3.0),
        (Kind::ActiveStiffness, &[5.0, 4.0], at(0.5, 0.0, 3.0), -2.0),
        (Kind::ActiveStiffness, &[5.0, 4.0], at(0.0, 2.0, 3.0), 0.0),
    ] {
        assert!(kind.feels_activity());
        let torque = Effect::new(kind, 0).with(values).torque(&local);
        assert_eq!(torque, expected, "{} {values:?}", kind.info().kind);
    }
    assert!(!Kind::Viscous.feels_activity());
}
