//! Where nothing is hidden, the world and the simulator that it judges show the same.

use hidden_world::cast::Strength;
use hidden_world::run::RECORDS;
use hidden_world::session::{Case, Session};

use crate::common::{lead, movement, native, setting, world};

/// Largest differences of angles \[rad\] and forces \[N\].
fn differences<const N: usize>(speed: f64) -> (f64, f64) {
    let setting = setting(N);
    let movement = movement(&setting, speed);
    let lead = lead(&setting, &movement);
    let truth = world(&setting, &movement, &lead, &[]);
    let readings = native::<N>(&setting.truth, &movement, &truth.robot, &[]);
    let (mut angle, mut force) = (0.0_f64, 0.0_f64);
    for k in 0..readings.time.len() {
        for j in 0..N {
            angle = angle.max((readings.q[N * k + j] - truth.q[RECORDS * k][j]).abs());
        }
        for c in 0..2 {
            let there = readings.force_on_arm[2 * k + c];
            force = force.max((there - truth.force_on_arm[RECORDS * k][c]).abs());
        }
    }
    println!("{N} joints at {speed} rad/s: {angle:.1e} rad, {force:.1e} N");
    (angle, force)
}

#[test]
fn nothing_hidden_nothing_seen() {
    // A tenth of the finest sensors: 0.02° and 0.05 N. What is left at speed is the spline through 50 samples a second.
    for (angle, force) in [
        differences::<2>(0.3),
        differences::<2>(1.3),
        differences::<3>(0.3),
        differences::<3>(1.3),
    ] {
        assert!(angle < 3e-5, "{angle} rad");
        assert!(force < 0.01, "{force} N");
    }
}

#[test]
fn a_seed_is_a_session() {
    let make = || {
        let case = Case::Single("coulomb", Strength::Strong);
        let session = Session::new(3, case).expect("a session");
        hidden_world::output::truth(&session).to_string()
            + &format!("{:?}", session.trials[0].readings)
    };
    assert_eq!(make(), make());
}
