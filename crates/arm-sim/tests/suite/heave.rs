//! A base that heaves, as an effect and along a measured path.

use arm_core::effect::{Effect, Kind};
use arm_sim::{Interpolation, Series};

use crate::common::{largest, most, run, several_effects, swinging};
use crate::placement::placed;

const WAVE: [f64; 4] = [0.03, -0.05, 0.7, 0.4];

/// How far the base is at a time, and its acceleration.
fn heave(time: f64) -> [[f64; 2]; 2] {
    let [y, z, frequency, phase] = WAVE;
    let omega = core::f64::consts::TAU * frequency;
    let sin = libm::sin(omega * time + phase);
    [
        [y * sin, z * sin],
        [-omega * omega * y * sin, -omega * omega * z * sin],
    ]
}

#[test]
fn a_pendulum_on_a_heaving_pivot_follows_its_own_equation() {
    let ([mass, com, inertia, gravity], mut experiment) = swinging();
    experiment.effects = vec![Effect::new(Kind::ShoulderHeave, 0).with(&WAVE)];
    let recording = run(&experiment);
    // (J + m c²) q̈ = −m c ((g + z̈) cos q − ÿ sin q)
    let acceleration = |time: f64, q: f64| {
        let [_, [y, z]] = heave(time);
        let turned = (gravity + z) * libm::cos(q) - y * libm::sin(q);
        -mass * com * turned / (inertia + mass * com * com)
    };
    let h = experiment.dt;
    let (mut q, mut v) = (-1.2, 0.0);
    for step in 0..8000 {
        let time = h * f64::from(step);
        let k1 = (v, acceleration(time, q));
        let k2 = (
            v + 0.5 * h * k1.1,
            acceleration(time + 0.5 * h, q + 0.5 * h * k1.0),
        );
        let k3 = (
            v + 0.5 * h * k2.1,
            acceleration(time + 0.5 * h, q + 0.5 * h * k2.0),
        );
        let k4 = (v + h * k3.1, acceleration(time + h, q + h * k3.0));
        q += h / 6.0 * (k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0);
        v += h / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
    }
    let last = *recording.q.last().expect("samples");
    assert!((last - q).abs() < 1e-10, "{last} {q}");
    let still = {
        experiment.effects.clear();
        *run(&experiment).q.last().expect("samples")
    };
    assert!(
        (last - still).abs() > 0.01,
        "the heave is seen: {last} {still}"
    );
    let [at, _] = heave(2.0);
    let tip = &recording.tip[recording.tip.len() - 2..];
    assert!(
        (tip[0] - at[0] - 0.4 * libm::cos(last)).abs() < 1e-12,
        "the tip is in the room"
    );
    let energy = most(recording.energy_error());
    assert!(energy < 1e-8, "{energy} J");
}

#[test]
fn a_measured_path_moves_the_base_as_the_effect_does() {
    let mut effects = several_effects();
    effects.retain(|effect| effect.kind != Kind::ShoulderHeave);
    let mut measured = placed(&effects);
    effects.push(Effect::new(Kind::ShoulderHeave, 0).with(&WAVE));
    let heaving = run(&placed(&effects));
    let times: Vec<f64> = (0..=1000)
        .map(|i| f64::from(i) * measured.duration / 1000.0)
        .collect();
    let path: Vec<[f64; 2]> = times.iter().map(|&t| heave(t)[0]).collect();
    let series = Series::new("path", &times, &path, Interpolation::Cubic).expect("a path");
    measured.base = Some(series);
    let along = run(&measured);
    let (angles, forces) = (
        largest(&along.q, &heaving.q),
        largest(&along.force_on_arm, &heaving.force_on_arm),
    );
    assert!(angles < 1e-5 && forces < 1e-3, "{angles} rad, {forces} N");
    measured.base = None;
    let still = run(&measured);
    assert!(largest(&still.q, &heaving.q) > 0.05, "the heave is seen");
    // A path that ends before the run does.
    let short = Series::new("path", &times[..500], &path[..500], Interpolation::Cubic);
    measured.base = Some(short.expect("a path"));
    let refused = arm_sim::simulate(&measured)
        .expect_err("too short")
        .to_string();
    assert!(refused.contains("the path of the base"), "{refused}");
}
