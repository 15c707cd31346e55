//! The cascade on simulated slow movements in which one joint rests while the other moves.

use super::joint_method::named;
use super::noise::Noise;
use super::synthetic::{EXACT, Recipe, State, at_every_joint, wrong};
use arm_core::{Joints, sample_arms};
use arm_ident::cascade::{Options, identify};
use arm_ident::inference::estimate::{Decision, Identified};
use arm_ident::regression::trial::Trial;

const BRAKES: [f64; 2] = [0.139, 0.161];
const SPEED: f64 = 0.04;
/// Seconds of a swing one way.
const SWING: f64 = 5.0;
/// Noise of angles [rad] and of torques [N m].
const NOISE: [f64; 2] = [1.7e-3, 0.05];
const OPTIONS: Options = Options {
    cutoff: None,
    bound_width: 3.0,
    tolerance: EXACT,
    level: 0.95,
};

/// Which way a joint moves: up, down, and rests as long, shoulder first; or both at once.
fn way(t: f64, joint: usize, both: bool) -> f64 {
    match ((t / SWING) as usize + if both { 0 } else { 4 - 2 * joint }) % 4 {
        0 => 1.0,
        1 => -1.0,
        _ if both => way(t - 2.0 * SWING, joint, both),
        _ => 0.0,
    }
}

fn path(both: bool) -> impl Fn(f64) -> State<2> {
    move |t| {
        let part = t % SWING;
        let angle = |j: usize| {
            let share = match way(t, j, both) {
                w if w > 0.0 => part,
                w if w < 0.0 => SWING - part,
                _ => 0.0,
            };
            [-0.9, 1.1][j] + SPEED * share
        };
        let qd = Joints::from([0, 1].map(|j| SPEED * way(t, j, both)));
        [Joints::from([0, 1].map(angle)), qd, Joints::zeros()]
    }
}

/// One trial of a slow arm with brakes that `path` leads; a joint at rest is held by a share of its friction.
fn trial(seed: u64, path: impl Fn(f64) -> State<2>) -> Trial<2> {
    let recipe = Recipe {
        rate: 50.0,
        duration: 8.0 * SWING,
        quasi_static: true,
        ..Recipe::new(sample_arms::mechanical_arm())
    };
    let mut trial = recipe.torque_trial(&path, &[]);
    let mut noise = Noise::new(seed);
    let held: [f64; 2] = core::array::from_fn(|_| 0.5 * noise.uniform());
    for (i, torque) in trial.torque.iter_mut().flatten().enumerate() {
        let speed = path(i as f64 / recipe.rate)[1];
        for j in 0..2 {
            let share = if speed[j] == 0.0 {
                held[j]
            } else {
                speed[j].signum()
            };
            torque[j] += BRAKES[j] * share + NOISE[1] * noise.normal();
            trial.q[i][j] += NOISE[0] * noise.normal();
        }
    }
    trial
}

fn identified(trial: Trial<2>) -> Identified<2> {
    let truth = sample_arms::mechanical_arm();
    let mut model = wrong(&truth, [[1.1, 1.0, 1.1], [1.1, 1.0, 1.1]], 0.1);
    model.fitted = at_every_joint::<2>(&["coulomb"]);
    identify(&model, &[trial], &OPTIONS).expect("identification succeeds")
}

/// Rows of a resting joint made it 0.119 N m in place of 0.139 N m in the shoulder.
#[test]
fn friction_is_right_where_one_joint_rests_while_the_other_moves() {
    const TRIALS: u64 = 40;
    for both in [false, true] {
        let found: Vec<Identified<2>> = (0..TRIALS)
            .map(|seed| identified(trial(seed, path(both))))
            .collect();
        for (j, truth) in BRAKES.iter().enumerate() {
            let name = format!("coulomb{} torque", j + 1);
            let all = || found.iter().map(|r| named(r, &name));
            let mean = all().map(|e| e.value).sum::<f64>() / TRIALS as f64;
            assert!((mean - truth).abs() < 0.015 * truth, "{mean}, not {truth}");
            let covered = all()
                .filter(|e| e.interval.0 <= *truth && *truth <= e.interval.1)
                .count();
            // 95 % of 40, less three standard deviations of the count.
            assert!(covered >= 34, "{name}: {covered} of {TRIALS}, both {both}");
        }
    }
}

#[test]
fn friction_of_a_joint_that_never_moves_is_not_identified() {
    let only_shoulder = |t: f64| {
        let [mut q, mut qd, qdd] = path(true)(t);
        (q[1], qd[1]) = (1.1, 0.0);
        [q, qd, qdd]
    };
    let result = identified(trial(1, only_shoulder));
    let (moved, rested) = (
        named(&result, "coulomb1 torque"),
        named(&result, "coulomb2 torque"),
    );
    assert_eq!(moved.decided_by, Decision::Data);
    assert!((moved.value - BRAKES[0]).abs() < 0.05 * BRAKES[0]);
    assert_eq!(rested.decided_by, Decision::Prior);
    assert_eq!((rested.value, rested.interval), (0.0, (0.0, 100.0)));
    assert!(rested.std > 10.0);
    let said = "coulomb2 torque does not act on the data".to_owned();
    assert!(result.trades.contains(&said), "{:?}", result.trades);
    // Its own rows do not determine what it carries either.
    assert_eq!(named(&result, "m2*l2").decided_by, Decision::Prior);
}

/// A swing of both joints with the largest speed [rad/s] and acceleration [rad/s²] of the shoulder, with noise.
fn swinging(seed: u64, speed: f64, acceleration: f64) -> Trial<2> {
    let path = |t: f64| {
        let mut state = [Joints::<f64, 2>::zeros(); 3];
        for j in 0..2 {
            let w = acceleration / speed * [1.0, 1.31][j];
            let a = speed * speed / acceleration;
            state[0][j] = [-0.6, 1.1][j] + a * libm::sin(w * t);
            state[1][j] = a * w * libm::cos(w * t);
            state[2][j] = -a * w * w * libm::sin(w * t);
        }
        state
    };
    let recipe = Recipe {
        rate: 50.0,
        duration: 16.0 * speed / acceleration * core::f64::consts::TAU,
        ..Recipe::new(sample_arms::mechanical_arm())
    };
    let mut trial = recipe.torque_trial(&path, &[]);
    let mut noise = Noise::new(seed);
    for torque in trial.torque.iter_mut().flatten() {
        for value in torque.iter_mut() {
            *value += 0.2 * NOISE[1] * noise.normal();
        }
    }
    trial
}

/// Intervals that took inertia for nothing missed the truth by ten of their widths and said "by data".
#[test]
fn inertia_widens_the_intervals_of_a_movement_that_is_not_quasi_static() {
    let truth = sample_arms::mechanical_arm();
    let mut model = wrong(&truth, [[1.1, 1.0, 1.1], [1.1, 1.0, 1.1]], 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "constant_moment"]);
    let run = |speed, acceleration| {
        identify(&model, &[swinging(3, speed, acceleration)], &OPTIONS).expect("a solution")
    };
    let (fast, slow) = (run(0.37, 0.28), run(0.037, 0.0028));
    for j in 0..2 {
        let x = truth.first_moments()[j];
        let (fast, slow) = (&fast.combinations[j], &slow.combinations[j]);
        assert!(
            fast.interval.0 <= x && x <= fast.interval.1,
            "{fast:?}, not {x}"
        );
        assert!(
            slow.interval.0 <= x && x <= slow.interval.1,
            "{slow:?}, not {x}"
        );
        assert!(slow.std < 0.3 * fast.std, "{slow:?} {fast:?}");
    }
    assert!(
        fast.neglected_inertia[0] > 3.0,
        "{:?}",
        fast.neglected_inertia
    );
    let (quick, still) = (&fast.neglected_inertia, &slow.neglected_inertia);
    assert!(still[0] < 0.5 * quick[0], "{still:?} {quick:?}");
}
