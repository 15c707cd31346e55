//! The thesis' verification experiment, repeated many times: the mechanical arm of table 4.3 is led by a robot through
//! 11.4° and 11.5°, ten trials with 0.1° and 0.2 N of white noise, and identified from a model that is 10 % wrong.
//!
//! `cargo run --release -p arm-ident --example coverage -- [repetitions] [brakes|free] [exact|calibrated]`
//!
//! Prints for every identifiable quantity the truth, the mean and scatter of the estimates, the mean standard deviation
//! stated, the largest error, and the share of 95 % intervals that cover the truth. Torques are in N m, first moments in
//! kg m. Synthetic data, seeds 1 … repetitions.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Joints, Limits, Segment, Setup, Shape, models};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Role, Tolerance, Trial};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Movement, Start, simulate};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const TRIALS: usize = 10;
const RATE: f64 = 50.0;
/// Appendix C of the thesis moves at no more than this \[rad/s\].
const SPEED: f64 = 0.03;
const ANGLE_NOISE: f64 = 0.1;
const FORCE_NOISE: f64 = 0.2;
const BRAKES: [f64; 2] = [0.139, 0.161];
/// The robot's encoders are far better than the cameras \[m\].
const HANDLE_NOISE: f64 = 1e-5;

/// A standard normal number (Box, Muller 1958).
fn gaussian(random: &mut ChaCha8Rng) -> f64 {
    let unit = |r: &mut ChaCha8Rng| ((r.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let (a, b) = (unit(random), unit(random));
    libm::sqrt(-2.0 * libm::log(a)) * libm::cos(2.0 * core::f64::consts::PI * b)
}

fn brakes(torque: [f64; 2]) -> Vec<Effect<f64>> {
    let coulomb = Kind::named("coulomb").expect("the catalogue has dry friction");
    (0..2)
        .map(|j| Effect::new(coulomb, j).with(&[torque[j]]))
        .collect()
}

/// Calibration errors of one session.
struct Session {
    offset: [f64; 2],
    bias: [f64; 2],
    gain: [f64; 2],
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let repetitions: u64 = arguments.get(1).and_then(|a| a.parse().ok()).unwrap_or(20);
    let braked = arguments.get(2).is_none_or(|a| a == "brakes");
    let exact = arguments.get(3).is_none_or(|a| a == "exact");

    let truth = models::mechanical_arm();
    let torque = if braked { BRAKES } else { [0.0; 2] };
    let contact = Contact::new([1e4; 2], [25.0; 2]);
    let waypoints: Vec<Joints<f64, 2>> = [[-40.0_f64, 60.0], [-28.6, 71.5], [-40.0, 60.0]]
        .map(|w| Joints::from(w.map(f64::to_radians)))
        .to_vec();
    let limits = [Limits {
        speed: SPEED,
        acceleration: 0.6,
    }; 2];
    let movement =
        Movement::within(Shape::Trapezoid, &waypoints, &limits, 1.0).expect("a valid movement");
    let duration = (movement.duration() * RATE).ceil() / RATE + 1.0;
    let path = HandlePath::of_arm(truth, movement.clone());
    let drive = Drive::Handle {
        path,
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(Setup::new(&truth, contact), drive, duration);
    experiment.effects = brakes(torque);
    experiment.start = Start::Equilibrium { near: waypoints[0] };
    experiment.output_interval = Some(1.0 / RATE);
    let run = simulate(&experiment).expect("the experiment runs");

    let scale = [1.1, 0.9];
    let segments = core::array::from_fn(|j| {
        let s: Segment<f64> = truth.segments()[j];
        Segment {
            mass: s.mass * scale[j],
            com: [s.com[0] * scale[1 - j], 0.0],
            ..s
        }
    });
    let model = Model {
        chain: Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("a valid arm"),
        segment_uncertainty: 0.3,
        fitted: brakes([0.0; 2]),
        held: Vec::new(),
        contact,
    };
    let none = Tolerance {
        angle_offset: 0.0,
        force_bias: 0.0,
        force_gain: 0.0,
        time_delay: 0.0,
        handle_placement: 0.0,
    };
    let tolerance = if exact {
        none
    } else {
        Tolerance {
            time_delay: 0.0,
            handle_placement: 0.0,
            ..Tolerance::default()
        }
    };
    let options = Options {
        tolerance,
        motion: MotionSource::Simulated,
        ..Options::default()
    };

    let true_values = [
        truth.first_moments()[0],
        truth.first_moments()[1],
        torque[0],
        torque[1],
    ];
    let names = [
        "m1*l1 + a1*m2",
        "m2*l2",
        "coulomb1 torque",
        "coulomb2 torque",
    ];
    let mut found: [Vec<(f64, f64, bool)>; 4] = Default::default();
    for seed in 1..=repetitions {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let t = options.tolerance;
        let mut draw = |sd: f64| [(); 2].map(|()| sd * gaussian(&mut random));
        let session = Session {
            offset: draw(t.angle_offset),
            bias: draw(t.force_bias),
            gain: draw(t.force_gain),
        };
        let trials: Vec<Trial<2>> = (0..TRIALS)
            .map(|_| measured(&run, &session, &mut random))
            .collect();
        let result = identify(&model, &trials, &options).expect("identification succeeds");
        assert_eq!(result.rank, 6, "masses cannot be told apart");
        let estimates = result.combinations[..2].iter().chain(
            result
                .parameters
                .iter()
                .filter(|p| p.name.contains("coulomb")),
        );
        for (k, e) in estimates.enumerate() {
            assert!(k > 1 || e.name == names[k]);
            let covers = e.interval[0] <= true_values[k] && true_values[k] <= e.interval[1];
            found[k].push((e.value, e.std, covers));
        }
    }
    println!(
        "{repetitions} repetitions, {TRIALS} trials, {}, calibration {}",
        if braked { "brakes" } else { "no brakes" },
        if exact { "exact" } else { "within tolerance" }
    );
    println!(
        "{:<16} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8}",
        "quantity", "truth", "mean", "scatter", "stated", "worst", "cover %"
    );
    for k in 0..4 {
        let n = repetitions as f64;
        let mean = found[k].iter().map(|f| f.0).sum::<f64>() / n;
        let scatter = (found[k]
            .iter()
            .map(|f| (f.0 - mean) * (f.0 - mean))
            .sum::<f64>()
            / (n - 1.0))
            .sqrt();
        let stated = found[k].iter().map(|f| f.1).sum::<f64>() / n;
        let worst = found[k]
            .iter()
            .map(|f| (f.0 - true_values[k]).abs())
            .fold(0.0, f64::max);
        let cover = found[k].iter().filter(|f| f.2).count() as f64 / n * 100.0;
        println!(
            "{:<16} {:>9.5} {:>9.5} {:>9.5} {:>9.5} {:>9.5} {:>8.1}",
            names[k], true_values[k], mean, scatter, stated, worst, cover
        );
    }
}

/// One trial as the sensors see it.
fn measured(run: &arm_sim::Recording<2>, session: &Session, random: &mut ChaCha8Rng) -> Trial<2> {
    let n = run.time.len();
    let mut trial = Trial {
        speed: None,
        role: Role::Fit,
        configuration: 0,
        rate: RATE,
        q: Vec::with_capacity(n),
        force_on_arm: Some(Vec::with_capacity(n)),
        moment_on_arm: None,
        torque: None,
        handle: Some(Vec::with_capacity(n)),
        valid: vec![true; n],
    };
    for i in 0..n {
        let q = Joints::from_fn(|j, _| {
            run.q[2 * i + j] + session.offset[j] + ANGLE_NOISE.to_radians() * gaussian(random)
        });
        let force = [0, 1].map(|c| {
            run.force_on_arm[2 * i + c] * (1.0 + session.gain[c])
                + session.bias[c]
                + FORCE_NOISE * gaussian(random)
        });
        let handle = [0, 1].map(|c| run.handle[2 * i + c] + HANDLE_NOISE * gaussian(random));
        trial.q.push(q);
        trial.force_on_arm.iter_mut().for_each(|f| f.push(force));
        trial.handle.iter_mut().for_each(|h| h.push(handle));
    }
    trial
}
