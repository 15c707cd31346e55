//! Dry friction that sticks holds; friction that creeps lets go.

use hidden_world::effect::{Dry, Hidden, Law};
use hidden_world::run::RECORDS;

use crate::common::{lead, movement, rubbing, setting, world};

/// Torque about the first joint with which the handle still pulls after the movement, because of dry friction \[N m\]: at
/// the beginning and at the end of the last half second.
fn held(grip: f64) -> [f64; 2] {
    const TORQUE: f64 = 0.3;
    let mut setting = setting(2);
    // A handle that wanders by micrometres loads and unloads what sticks.
    setting.servo.wander = 0.0;
    let movement = movement(&setting, 0.5);
    let lead = lead(&setting, &movement);
    let friction = Hidden {
        kind: "coulomb",
        joint: Some(0),
        channel: None,
        trial: None,
        law: Law::Dry(Dry::Coulomb(TORQUE)),
        scored: Vec::new(),
    };
    let bare = world(&setting, &movement, &lead, &[]);
    let with = rubbing(&setting, &movement, &lead, &[friction], grip);
    let last = bare.q.len() - 1;
    [last - 25 * RECORDS, last].map(|k| {
        let [y, z] = setting.truth.tip(&bare.q[k]);
        let [fy, fz] = [0, 1].map(|c| with.force_on_arm[k][c] - bare.force_on_arm[k][c]);
        (y * fz - z * fy) / TORQUE
    })
}

#[test]
fn what_sticks_holds() {
    let [first, last] = held(1e6);
    println!("sticking: {first:.3} of the friction, half a second later {last:.3}");
    assert!(first.abs() > 0.1 && first.abs() <= 1.01, "{first}");
    assert!((first - last).abs() < 0.01, "{first} {last}");
}

#[test]
fn what_creeps_lets_go() {
    let [_, last] = held(20.0);
    assert!(last.abs() < 0.01, "{last}");
}
