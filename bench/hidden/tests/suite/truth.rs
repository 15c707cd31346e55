//! What `truth.json` says is what acts: the catalogue with these values shows what the world shows.

use arm_core::effect::{Effect, Kind};
use hidden_world::cast::{Scene, Strength, cast, kinds};
use hidden_world::effect::Hidden;
use hidden_world::model::Setting;
use hidden_world::motion::{Lead, Movement, RATE};
use hidden_world::random::Random;
use hidden_world::rig::Plane;
use hidden_world::run::Truth;
use hidden_world::sensor::{Calibration, Noise, read};

use crate::common::{lead, movement, native, setting, world};

/// The effect of the catalogue with the values of a hidden one; what it does not say takes its default.
fn in_catalogue(hidden: &Hidden) -> Effect<f64> {
    let kind = Kind::named(hidden.kind).expect("a kind of the catalogue");
    let known = kind.info().parameters.iter();
    let values: Vec<f64> = known
        .map(|p| {
            let stated = hidden.scored.iter().find(|s| s.name == p.name);
            stated.map_or(p.default, |s| s.value)
        })
        .collect();
    for scored in &hidden.scored {
        let listed = kind.info().parameters.iter().any(|p| p.name == scored.name);
        assert!(listed, "{} has no {}", hidden.kind, scored.name);
    }
    Effect::new(kind, hidden.joint.or(hidden.channel).unwrap_or(0)).with(&values)
}

/// Angles and forces of all samples in units of a usual noise: 0.085° and 0.175 N.
fn scaled<'a>(
    q: impl Iterator<Item = &'a [f64]>,
    force: impl Iterator<Item = &'a Plane>,
) -> Vec<f64> {
    let angles = q.flatten().map(|q| q / 0.085_f64.to_radians());
    angles.chain(force.flatten().map(|f| f / 0.175)).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let sum = a
        .iter()
        .zip(b)
        .fold(0.0, |sum, (a, b)| sum + (a - b) * (a - b));
    (sum / a.len() as f64).sqrt()
}

/// One rig and one movement, in the world and in the simulator.
struct Stage<const N: usize> {
    setting: Setting,
    movement: Movement,
    lead: Lead,
    bare: Truth,
}

impl<const N: usize> Stage<N> {
    fn new() -> Self {
        let setting = setting(N);
        let movement = movement(&setting, 0.8);
        let lead = lead(&setting, &movement);
        let bare = world(&setting, &movement, &lead, &[]);
        Self {
            setting,
            movement,
            lead,
            bare,
        }
    }

    fn hide(&self, kind: &str) -> Hidden {
        let angle = |j: usize| self.bare.q.iter().map(move |q| q[j]);
        let scene = Scene {
            rig: &self.setting.truth,
            range: (0..N)
                .map(|j| [angle(j).fold(9.0, f64::min), angle(j).fold(-9.0, f64::max)])
                .collect(),
            speed: vec![0.8; N],
            trials: vec![(0, self.movement.duration)],
        };
        cast(kind, Strength::Strong, &scene, &mut Random::new(5, 0)).expect("a kind")
    }

    fn shown_by_world(&self, hidden: &[Hidden]) -> Vec<f64> {
        let truth = world(&self.setting, &self.movement, &self.lead, hidden);
        let silent = Noise {
            angle: 0.0,
            force: 0.0,
            memory: 0.0,
            rate: RATE,
            quantum: [0.0; 2],
            encoder: 0.0,
        };
        let calibration = Calibration::perfect(N);
        let mut random = Random::new(1, 0);
        let readings = read(
            &truth,
            hidden,
            &calibration,
            &silent,
            ([0.0, 1.0], None),
            &mut random,
        );
        scaled(
            readings.q.iter().map(Vec::as_slice),
            readings.force_on_arm.iter(),
        )
    }

    fn shown_by_catalogue(&self, effects: &[Effect<f64>]) -> Vec<f64> {
        let (rig, robot) = (&self.setting.truth, &self.bare.robot);
        let readings = native::<N>(rig, &self.movement, robot, effects);
        let (forces, _) = readings.force_on_arm.as_chunks::<2>();
        scaled(readings.q.chunks(N), forces.iter())
    }

    /// Part of what a strong effect shows that the catalogue with its values does not.
    fn left(&self, kind: &str) -> (f64, bool) {
        let hidden = self.hide(kind);
        let effect = in_catalogue(&hidden);
        let there = self.shown_by_world(std::slice::from_ref(&hidden));
        let shown = distance(&there, &self.shown_by_catalogue(&[]));
        let left = distance(&there, &self.shown_by_catalogue(&[effect]));
        let exact = hidden.scored.iter().any(|s| s.exact);
        println!(
            "{kind}: shows {shown:.1} noises, {:.2} % of it left",
            100.0 * left / shown
        );
        assert!(shown > 0.01, "{kind} does not show: {shown}");
        (left / shown, exact)
    }
}

/// Dry friction is smoothed by the catalogue and not here; a tremor starts with another phase; with least jerk the damping
/// of the contact does little.
fn allowed(kind: &str, exact: bool) -> f64 {
    match kind {
        "coulomb" | "load_friction" => 0.2,
        "contact_damping" => 0.05,
        "tremor" => f64::INFINITY,
        // An exact delay here, its approximant there.
        "stretch_reflex" => 0.02,
        _ if exact => 0.02,
        _ => 0.5,
    }
}

#[test]
fn truth_of_two_joints() {
    let stage = Stage::<2>::new();
    for kind in kinds() {
        let (left, exact) = stage.left(kind);
        assert!(left < allowed(kind, exact), "{kind}: {left}");
    }
}

#[test]
fn truth_of_three_joints() {
    let stage = Stage::<3>::new();
    for kind in kinds() {
        let (left, exact) = stage.left(kind);
        assert!(left < allowed(kind, exact), "{kind}: {left}");
    }
}
