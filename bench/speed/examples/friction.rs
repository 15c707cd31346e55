//! One run of 2 s with dry friction in both joints of the mechanical arm, to count instructions of:
//! `valgrind --tool=callgrind target/release/examples/friction coulomb 0`. The second argument is the smoothing \[rad/s\]; a third one
//! asks for the digest.

use arm_core::effect::{Effect, Kind};
use arm_sim::{digest, sample_experiments, simulate};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let kind = arguments.next();
    let (kind, values) = match kind.as_deref() {
        Some("coulomb") => (Kind::Coulomb, vec![0.5]),
        Some("stribeck") => (Kind::Stribeck, vec![0.5, 0.06]),
        Some("load_friction") => (Kind::LoadFriction, vec![0.01]),
        Some("thixotropy") => (Kind::Thixotropy, vec![0.5, 0.0, 0.0, 0.1, 3.0]),
        other => panic!("found {other:?}, allowed coulomb, stribeck, load_friction, thixotropy"),
    };
    let smoothing = arguments
        .next()
        .and_then(|text| text.parse::<f64>().ok())
        .expect("a smoothing [rad/s], 0 for friction that is set-valued");
    let mut experiment =
        sample_experiments::mechanical_experiment(2.0, [0.0; 2]).expect("a sample");
    let values = [&values[..], &[smoothing]].concat();
    experiment.effects = (0..2)
        .map(|joint| Effect::new(kind, joint).with(&values))
        .collect();
    experiment.output_interval = Some(0.02);
    let found = simulate(&experiment).expect("a run");
    if arguments.next().is_some() {
        println!("{:016x}", digest(&found).expect("a digest"));
    }
}
