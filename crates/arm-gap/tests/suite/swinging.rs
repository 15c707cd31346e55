//! Rigs without a robot: an arm that swings freely is simulated from where it starts.

use arm_core::effect::{Effect, Kind};
use arm_core::{Contact, Joints, Setup};
use arm_gap::data::session::{ComparisonMode, Session};
use arm_ident::regression::trial::{Tolerance, Trial};
use arm_sim::{Drive, Experiment, Start, simulate};

use crate::sessions::arm;

const RATE: f64 = 100.0;

/// An arm with viscous joints that falls from an angle and swings, without noise.
fn swinging(seconds: f64) -> Session<2> {
    let chain = arm();
    let contact = Contact::new([1e4; 2], [25.0; 2]);
    let viscous = Kind::named("viscous").expect("known");
    let effects: Vec<_> = (0..2)
        .map(|j| Effect::new(viscous, j).with(&[0.1]))
        .collect();
    let mut experiment = Experiment::new(Setup::new(&chain, contact), Drive::Torque(None), seconds);
    experiment.effects.clone_from(&effects);
    experiment.start = Start::Given {
        q: Joints::from([-1.0, 0.3]),
        qd: Joints::zeros(),
    };
    experiment.output_interval = Some(1.0 / RATE);
    let recording = simulate(&experiment).expect("a stable run");
    let q: Vec<_> = recording
        .q
        .chunks_exact(2)
        .map(Joints::from_column_slice)
        .collect();
    let trial = Trial {
        torque: Some(vec![Joints::zeros(); q.len()]),
        ..Trial::new(RATE, q)
    };
    Session {
        chain,
        contact,
        effects,
        segment_uncertainty: 0.02,
        tolerance: Tolerance::default(),
        trials: vec![trial],
        comparison: ComparisonMode::Torque,
        weights: Vec::new(),
        own: Vec::new(),
        base: Vec::new(),
        start: [[0.0; 3]; 2],
    }
}

#[test]
fn a_free_swing_of_the_true_model_is_the_measured_one() {
    let session = swinging(4.0);
    assert!(session.swings_freely());
    let course = session.course(0).expect("a course");
    let shown = session
        .free_run(&session.given(), (0, &course))
        .expect("a run");
    let off = |j: usize| {
        let pairs = std::iter::zip(&shown[j], &session.trials[0].q);
        pairs.map(|(a, q)| (a - q[j]).abs()).fold(0.0, f64::max)
    };
    // The start is fitted to angles in the common band, which costs a tenth of a degree.
    assert!(off(0) < 2e-3 && off(1) < 2e-3, "{} {}", off(0), off(1));
}

#[test]
fn a_run_ends_at_a_gap_and_short_pieces_are_not_simulated() {
    let mut session = swinging(4.0);
    // Pieces of 2 s, of 0.2 s (shorter than a quarter of a second) and of the rest.
    for i in [200, 221] {
        session.trials[0].valid[i] = false;
    }
    let course = session.course(0).expect("a course");
    let shown = session
        .free_run(&session.given(), (0, &course))
        .expect("a run");
    let there = |i: usize| shown[0][i].is_finite();
    assert!((0..200).all(there) && !(200..222).any(there) && (222..400).all(there));
}

#[test]
fn a_free_arm_tells_no_mass_by_itself_and_a_led_one_has_no_free_run() {
    use arm_gap::hypothesis::Target;
    let mut session = swinging(1.0);
    let targets: Vec<_> = session.nuisances().iter().map(|c| c.target).collect();
    assert!(!targets.contains(&Target::Segment(0, 0)) && targets.contains(&Target::Segment(1, 0)));
    let course = session.course(0).expect("a course");
    session.comparison = ComparisonMode::Led;
    let none = session
        .free_run(&session.given(), (0, &course))
        .expect("nothing to run");
    assert!(none.is_empty());
}

/// A viscosity that is known to 5 % is found by the amplitude of simulated runs of 2 s, from 15 % too much.
#[test]
fn a_free_swing_is_fitted_by_its_simulated_amplitude() {
    use arm_gap::prepared_session::PreparedSession;
    let mut session = swinging(6.0);
    for effect in &mut session.effects {
        effect.parameters[0] *= 1.15;
    }
    let prepared = PreparedSession::new(&session, 2).expect("a sound session");
    let (fitted, _) = prepared.calibrate().expect("a calibration");
    let (found, precision) = prepared.refined(&fitted).expect("a free swing");
    for (j, effect) in found.known.iter().enumerate() {
        let viscosity = effect.parameters[0];
        assert!((viscosity - 0.1).abs() < 0.002, "joint {j}: {viscosity}");
    }
    assert_eq!(precision.sd.len(), session.nuisances().len());
}
