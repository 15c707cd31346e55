//! The thesis' verification experiment, repeated many times: the mechanical arm of table 4.3 is led by a robot through
//! 11.4° and 11.5°, ten trials with 0.1° and 0.2 N of white noise, and identified from a model that is 10 % wrong.
//!
//! `cargo run --release -p arm-ident --example coverage -- [repetitions] [brakes|free] [exact|calibrated]`
//!
//! Prints for every identifiable quantity the truth, the mean and scatter of the estimates, the mean standard deviation
//! stated, the largest error, and the share of 95 % intervals that cover the truth. Torques are in N m, first moments in
//! kg m. Synthetic data, seeds 1 … repetitions.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Joints, Limits, Segment, Setup, Shape, sample_arms};
use arm_ident::inference::joint_method::{MotionSource, Options, identify};
use arm_ident::regression::trial::{Model, Tolerance, Trial};
use arm_sim::{Coupling, Drive, Experiment, HandlePath, Movement, Recording, Start, simulate};
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

const NAMES: [&str; 4] = [
    "m1*l1 + a1*m2",
    "m2*l2",
    "coulomb1 torque",
    "coulomb2 torque",
];

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

fn contact() -> Contact<f64> {
    Contact::new([1e4; 2], [25.0; 2])
}

/// The experiment without noise.
fn led(torque: [f64; 2]) -> Recording<2> {
    let truth = sample_arms::mechanical_arm();
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
    let drive = Drive::Handle {
        path: HandlePath::of_arm(truth, movement),
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(Setup::new(&truth, contact()), drive, duration);
    experiment.effects = brakes(torque);
    experiment.start = Start::Equilibrium { near: waypoints[0] };
    experiment.output_interval = Some(1.0 / RATE);
    simulate(&experiment).expect("the experiment runs")
}

/// What is known beforehand: 10 % wrong.
fn assumed() -> Model<2> {
    let scale = [1.1, 0.9];
    let segments = core::array::from_fn(|j| {
        let s: Segment<f64> = sample_arms::mechanical_arm().segments()[j];
        Segment {
            mass: s.mass * scale[j],
            com: [s.com[0] * scale[1 - j], 0.0],
            ..s
        }
    });
    Model {
        chain: Chain::new(segments, [0.0; 2], [0.0, -9.81]).expect("a valid arm"),
        segment_uncertainty: 0.3,
        fitted: brakes([0.0; 2]),
        held: Vec::new(),
        contact: contact(),
    }
}

fn tolerance(exact: bool) -> Tolerance {
    let share = if exact { 0.0 } else { 1.0 };
    let usual = Tolerance::default();
    Tolerance {
        angle_offset_deg: share * usual.angle_offset_deg,
        force_bias: share * usual.force_bias,
        force_gain: share * usual.force_gain,
        time_delay: 0.0,
        handle_placement: 0.0,
    }
}

/// One estimate: its value, the standard deviation stated, and whether the interval covers the truth.
type Found = (f64, f64, bool);

/// One session, identified.
fn repetition(seed: u64, run: &Recording<2>, options: &Options, truth: [f64; 4]) -> [Found; 4] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let t = options.tolerance;
    let mut draw = |sd: f64| [(); 2].map(|()| sd * gaussian(&mut random));
    let session = Session {
        offset: draw(t.angle_offset()),
        bias: draw(t.force_bias),
        gain: draw(t.force_gain),
    };
    let trials: Vec<Trial<2>> = (0..TRIALS)
        .map(|_| measured(run, &session, &mut random))
        .collect();
    let result = identify(&assumed(), &trials, options).expect("identification succeeds");
    assert_eq!(result.rank, 6, "masses cannot be told apart");
    let friction = result.parameters.iter();
    let friction = friction.filter(|p| p.kind == "coulomb");
    let estimates: Vec<_> = result.combinations[..2].iter().chain(friction).collect();
    core::array::from_fn(|k| {
        let e = estimates[k];
        assert!(k > 1 || e.name == NAMES[k]);
        let covers = e.interval.0 <= truth[k] && truth[k] <= e.interval.1;
        (e.value, e.std, covers)
    })
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let repetitions: u64 = arguments.get(1).and_then(|a| a.parse().ok()).unwrap_or(20);
    let braked = arguments.get(2).is_none_or(|a| a == "brakes");
    let exact = arguments.get(3).is_none_or(|a| a == "exact");

    let torque = if braked { BRAKES } else { [0.0; 2] };
    let [first, second] = *sample_arms::mechanical_arm().first_moments();
    let truth = [first, second, torque[0], torque[1]];
    let options = Options {
        tolerance: tolerance(exact),
        motion: MotionSource::Simulated,
        ..Options::default()
    };
    let run = led(torque);
    let found: Vec<[Found; 4]> = (1..=repetitions)
        .map(|seed| repetition(seed, &run, &options, truth))
        .collect();
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
        let of_one: Vec<Found> = found.iter().map(|all| all[k]).collect();
        print_row(NAMES[k], truth[k], &of_one);
    }
}

fn print_row(name: &str, truth: f64, found: &[Found]) {
    let n = found.len() as f64;
    let mean = found.iter().map(|f| f.0).sum::<f64>() / n;
    let squares = found.iter().map(|f| (f.0 - mean) * (f.0 - mean));
    let scatter = (squares.sum::<f64>() / (n - 1.0)).sqrt();
    let stated = found.iter().map(|f| f.1).sum::<f64>() / n;
    let worst = found.iter().map(|f| (f.0 - truth).abs());
    let worst = worst.fold(0.0, f64::max);
    let cover = found.iter().filter(|f| f.2).count() as f64 / n * 100.0;
    println!(
        "{name:<16} {truth:>9.5} {mean:>9.5} {scatter:>9.5} {stated:>9.5} {worst:>9.5} {cover:>8.1}"
    );
}

/// One trial as measured by the sensors.
fn measured(run: &Recording<2>, session: &Session, random: &mut ChaCha8Rng) -> Trial<2> {
    let n = run.time.len();
    let mut trial = Trial {
        force_on_arm: Some(Vec::with_capacity(n)),
        handle: Some(Vec::with_capacity(n)),
        valid: vec![true; n],
        ..Trial::new(RATE, Vec::with_capacity(n))
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
