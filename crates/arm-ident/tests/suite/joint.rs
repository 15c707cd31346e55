//! The joint method on trials whose truth is known.

use super::noise::{Noise, most};
use super::synthetic::{EXACT, Recipe, State, at_every_joint, effect, sines, wrong};
use arm_core::{Chain, Joints, Segment, models};
use arm_ident::IdentError;
use arm_ident::estimate::{Decision, Estimate, Identified};
use arm_ident::joint::{MotionSource, Options, identify};
use arm_ident::trial::{Model, Role, Tolerance, Trial};

/// Half a period of the fastest sine is some 700 samples: the filter and the differences are exact to about 1e-6.
const BY_SAMPLING: f64 = 2e-5;

fn exactly() -> Options {
    Options {
        cutoff: Some(20.0),
        motion: MotionSource::Measured,
        tolerance: EXACT,
        level: 0.95,
    }
}

fn human() -> Chain<f64, 3> {
    let arm = models::human_arm();
    let segments: [Segment<f64>; 3] = core::array::from_fn(|k| Segment {
        inertia: [0.0155, 0.0055, 0.0012][k],
        ..arm.segments()[k]
    });
    Chain::new(segments, arm.base(), arm.gravity()).expect("a valid arm")
}

fn named<'a, const N: usize>(result: &'a Identified<N>, name: &str) -> &'a Estimate {
    result
        .parameters
        .iter()
        .chain(&result.combinations)
        .chain(&result.calibration)
        .find(|e| e.name == name)
        .unwrap_or_else(|| panic!("nothing is called {name}"))
}

fn close(found: f64, truth: f64, relative: f64) {
    assert!(
        (found - truth).abs() <= relative * truth.abs().max(1e-3),
        "{found} instead of {truth}"
    );
}

/// Every first and second moment of the links.
fn moments<const N: usize>(chain: &Chain<f64, N>) -> Vec<f64> {
    let (x, j) = (chain.first_moments(), chain.second_moments());
    x.iter().chain(j).copied().collect()
}

fn two_factors() -> [[f64; 3]; 2] {
    [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3]]
}

#[test]
fn base_parameters_and_joint_parameters_are_recovered_from_a_wrong_start() {
    let truth = human();
    let path = sines([-0.6, 0.9, 0.2], 0.35, 1.0);
    // (kind, fitted parameter, its place among the values, values of the three joints)
    type Case = (&'static str, &'static str, [Vec<f64>; 3]);
    let cases: [Case; 4] = [
        ("viscous", "viscosity", [vec![0.3], vec![0.2], vec![0.05]]),
        // Wide smoothing, so that the sampling resolves the reversals.
        (
            "coulomb",
            "torque",
            [vec![0.15, 0.2], vec![0.1, 0.2], vec![0.04, 0.2]],
        ),
        (
            "elastic",
            "stiffness",
            [vec![1.2, -0.5], vec![-0.4, 0.7], vec![0.5, 0.1]],
        ),
        (
            "constant_moment",
            "moment",
            [vec![0.3], vec![-0.2], vec![0.1]],
        ),
    ];
    for (kind, parameter, values) in cases {
        let effects: Vec<_> = (0..3).map(|j| effect(kind, j, &values[j])).collect();
        let trial = Recipe::new(truth).torque_trial(&path, &effects);
        let mut model = wrong(
            &truth,
            [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3], [1.2, 0.9, 0.7]],
            0.3,
        );
        model.fitted = (0..3)
            .map(|j| {
                let mut start = values[j].clone();
                start[0] = 0.0;
                effect(kind, j, &start)
            })
            .collect();
        let result = identify(&model, &[trial], &exactly()).expect("a solution");
        for (e, &value) in result.combinations.iter().zip(&moments(&truth)) {
            close(e.value, value, 50.0 * BY_SAMPLING);
            assert_eq!(e.decided_by, Decision::Data, "{}", e.name);
        }
        for j in 0..3 {
            let e = named(&result, &format!("{kind}{} {parameter}", j + 1));
            close(e.value, values[j][0], 50.0 * BY_SAMPLING);
            assert_eq!((e.decided_by, e.joint), (Decision::Data, Some(j)));
        }
        for (found, value) in moments(&result.chain).iter().zip(&moments(&truth)) {
            close(*found, *value, 50.0 * BY_SAMPLING);
        }
    }
}

#[test]
fn forces_at_the_tip_tell_as_much_as_torques() {
    let truth = models::mechanical_arm();
    let path = sines([-0.6, 1.2], 0.3, 1.0);
    let effects = [effect("viscous", 0, &[0.25]), effect("viscous", 1, &[0.1])];
    let trial = Recipe::new(truth).force_trial(&path, &effects);
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["viscous"]);
    let result = identify(&model, &[trial], &exactly()).expect("a solution");
    for (e, &value) in result.combinations.iter().zip(&moments(&truth)) {
        close(e.value, value, 50.0 * BY_SAMPLING);
    }
    close(
        named(&result, "viscous1 viscosity").value,
        0.25,
        50.0 * BY_SAMPLING,
    );
    close(
        named(&result, "viscous2 viscosity").value,
        0.1,
        50.0 * BY_SAMPLING,
    );

    // The force on the robot instead of on the arm is another arm: none that exists explains it.
    let mut turned = Recipe::new(truth).force_trial(&path, &effects);
    for force in turned.force_on_arm.iter_mut().flatten() {
        *force = force.map(|f| -f);
    }
    let wrong_sign = identify(&model, &[turned], &exactly()).expect("a solution");
    assert!(rms(&wrong_sign, 0) > 1.0, "{}", rms(&wrong_sign, 0));
    assert!(rms(&result, 0) < 1e-3);
}

fn rms<const N: usize>(result: &Identified<N>, trial: usize) -> f64 {
    let (sum, n) = result.explained[trial].square_sum();
    (sum.iter().sum::<f64>() / (n * N) as f64).sqrt()
}

/// Slow and noisy, so that nothing is said of the moments of inertia but by chance.
fn slow_and_noisy(truth: &Chain<f64, 3>, sd: f64, seed: u64) -> Trial<3> {
    let mut recipe = Recipe::new(*truth);
    recipe.rate = 100.0;
    recipe.duration = 40.0;
    let mut trial = recipe.torque_trial(&sines([-0.6, 0.9, 0.2], 0.35, 0.15), &[]);
    let mut noise = Noise::new(seed);
    for torque in trial.torque.iter_mut().flatten() {
        torque.apply(|v| *v += sd * noise.normal());
    }
    trial
}

#[test]
fn every_estimate_is_an_arm_that_can_exist() {
    let truth = human();
    let mut model = wrong(
        &truth,
        [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3], [1.2, 0.9, 0.7]],
        0.3,
    );
    // A prior so wide that only the cones are left to hold the inertias.
    model.segment_uncertainty = 1.0;
    let mut negative = 0;
    for seed in 1..=6 {
        let trial = slow_and_noisy(&truth, 0.3, seed);
        let result = identify(&model, &[trial], &exactly()).expect("a solution");
        for (k, s) in result.chain.segments().iter().enumerate() {
            let value = |name: String| named(&result, &name).value;
            let (mass, along) = (
                value(format!("m{}", k + 1)),
                value(format!("m{0}*l{0}", k + 1)),
            );
            let inertia = value(format!("I{0} + m{0}*l{0}^2", k + 1));
            assert!(mass > 0.0 && inertia > 0.0 && s.inertia >= 0.0);
            assert!(
                inertia * mass >= along * along * (1.0 - 1e-6),
                "segment {k} of seed {seed}"
            );
            assert!(along >= 0.0 && along <= s.length * mass * (1.0 + 1e-9));
            // On the edge of its cone a segment is a point mass.
            negative += usize::from(s.inertia < 1e-9);
        }
    }
    assert!(
        negative > 0,
        "no cone was needed: the test does not test them"
    );
}

#[test]
fn friction_that_is_not_there_is_not_found_and_never_negative() {
    let truth = models::mechanical_arm();
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "viscous"]);
    let (mut bounds, mut covered, mut all) = (0, 0, 0);
    for seed in 1..=8 {
        let mut recipe = Recipe::new(truth);
        recipe.rate = 200.0;
        let mut trial = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[]);
        let mut noise = Noise::new(seed);
        for torque in trial.torque.iter_mut().flatten() {
            torque.apply(|v| *v += 0.1 * noise.normal());
        }
        let result = identify(&model, &[trial], &exactly()).expect("a solution");
        for e in result
            .parameters
            .iter()
            .filter(|e| e.name.contains("cosity") || e.name.contains("torque"))
        {
            assert!(e.value >= 0.0 && e.interval[0] >= 0.0, "{}: {e:?}", e.name);
            assert!(e.std > 0.0, "a bound leaves no doubt: {e:?}");
            bounds += usize::from(e.decided_by == Decision::Bound);
            assert!(e.decided_by != Decision::Bound || e.value == 0.0);
            covered += usize::from(e.interval[0] == 0.0);
            all += 1;
        }
    }
    // One or two of 32 intervals may miss zero at 95 %.
    assert!(covered >= all - 4, "{covered} of {all} intervals hold zero");
    assert!(
        bounds > 0,
        "no bound was active: the test does not test them"
    );
}

#[test]
fn a_static_movement_tells_first_moments_and_no_mass() {
    let static_path = |centre| sines(centre, 0.35, 0.15);
    let mut recipe = Recipe::new(human());
    recipe.quasi_static = true;
    recipe.rate = 100.0;
    recipe.duration = 60.0;
    // The speed of the measured angles is real though the torques know nothing of it: turn it off by moving slowly.
    let path = static_path([-0.6, 0.9, 0.2]);
    let slower = move |t: f64| -> State<3> { path(t * 0.05) };
    recipe.duration = 600.0;
    recipe.rate = 20.0;
    let trial = recipe.torque_trial(&slower, &[]);
    let model = wrong(
        &human(),
        [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3], [1.2, 0.9, 0.7]],
        0.1,
    );
    let options = Options {
        cutoff: Some(0.5),
        ..exactly()
    };
    let result = identify(&model, std::slice::from_ref(&trial), &options).expect("a solution");
    for (j, &x) in human().first_moments().iter().enumerate() {
        let e = &result.combinations[j];
        close(e.value, x, 1e-3);
        assert_eq!(e.decided_by, Decision::Data, "{}", e.name);
        assert_eq!(result.combinations[3 + j].decided_by, Decision::Prior);
    }
    for name in ["m1", "m2", "m3", "m1*l1", "m2*l2"] {
        assert_eq!(named(&result, name).decided_by, Decision::Prior, "{name}");
    }
    assert_eq!(named(&result, "m3*l3").decided_by, Decision::Data);
    // The masses do not follow the data: they stay where the model has them on the line X_j = const.
    let heavier = wrong(
        &human(),
        [[1.1, 0.92, 0.8], [1.1, 1.08, 1.3], [1.2, 0.9, 0.7]],
        0.1,
    );
    let other = identify(&heavier, &[trial], &options).expect("a solution");
    let difference = named(&other, "m2").value - named(&result, "m2").value;
    assert!(difference > 0.1, "{difference} kg");
    close(
        other.combinations[0].value,
        result.combinations[0].value,
        1e-3,
    );
}

#[test]
fn without_load_ratios_are_found_and_the_scale_is_the_models() {
    // The swing of a double pendulum with friction, integrated here: only the motion is seen.
    let truth = models::mechanical_arm();
    let trial = swing(&truth, [0.08, 0.03]);
    let mut model = wrong(&truth, [[1.1, 0.96, 0.9], [1.05, 1.02, 1.1]], 0.1);
    model.fitted = at_every_joint::<2>(&["viscous"]);
    let result = identify(&model, &[trial], &exactly()).expect("a solution");
    assert!(result.scale_free);
    let found: Vec<f64> = result.combinations.iter().map(|e| e.value).collect();
    let expected = moments(&truth);
    for i in 1..4 {
        close(found[i] / found[0], expected[i] / expected[0], 1e-3);
    }
    let scale = found[0] / expected[0];
    close(
        named(&result, "viscous1 viscosity").value / scale,
        0.08,
        1e-2,
    );
    close(
        named(&result, "viscous2 viscosity").value / scale,
        0.03,
        1e-2,
    );
    // The common factor is that of the model: the mean of the relative sizes is kept.
    let given = moments(&model.chain);
    let mean: f64 = found.iter().zip(&given).map(|(f, g)| f / g).sum::<f64>() / 4.0;
    assert!((mean - 1.0).abs() < 1e-6, "{mean}");
    // One direction of the rank is the scale itself, which no data tell.
    let loaded = identify(
        &model,
        &[Recipe::new(truth).torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[])],
        &exactly(),
    )
    .expect("a solution");
    assert_eq!(result.rank + 1, loaded.rank);
}

fn swing(truth: &Chain<f64, 2>, viscosity: [f64; 2]) -> Trial<2> {
    let rate = 1000.0;
    let fine = 4;
    let acceleration = |q: &Joints<f64, 2>, qd: &Joints<f64, 2>| {
        let mut load = arm_core::Load::none();
        load.torque = Joints::from_fn(|j, _| -viscosity[j] * qd[j]);
        arm_core::forward_dynamics(truth, &arm_core::Pose::new(q), qd, &load)
    };
    let h = 1.0 / rate / fine as f64;
    let (mut q, mut qd) = (Joints::from([-0.6, 0.5]), Joints::zeros());
    let mut recipe = Recipe::new(*truth);
    recipe.duration = 10.0;
    recipe.rate = rate;
    let mut trial = recipe.empty();
    for _ in 0..recipe.samples() {
        trial.q.push(q);
        for _ in 0..fine {
            // Runge and Kutta's fourth-order method.
            let a1 = acceleration(&q, &qd);
            let (q2, v2) = (q + qd * (h / 2.0), qd + a1 * (h / 2.0));
            let a2 = acceleration(&q2, &v2);
            let (q3, v3) = (q + v2 * (h / 2.0), qd + a2 * (h / 2.0));
            let a3 = acceleration(&q3, &v3);
            let (q4, v4) = (q + v3 * h, qd + a3 * h);
            let a4 = acceleration(&q4, &v4);
            q += (qd + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
            qd += (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0);
        }
    }
    trial.torque = Some(vec![Joints::zeros(); trial.q.len()]);
    trial
}

/// A trial in which one imperfection is put in, and what it is called in the result.
struct Fault {
    name: &'static str,
    size: f64,
    tolerance: Tolerance,
    spoil: fn(&Recipe<2>, &dyn Fn(f64) -> State<2>, &mut Trial<2>, f64),
}

fn faults() -> Vec<Fault> {
    let force = |trial: &mut Trial<2>, change: &dyn Fn(usize, [f64; 2]) -> [f64; 2]| {
        for (i, f) in trial.force_on_arm.iter_mut().flatten().enumerate() {
            *f = change(i, *f);
        }
    };
    let _ = force;
    vec![
        Fault {
            name: "angle offset 1",
            size: 0.01,
            tolerance: Tolerance {
                angle_offset: 0.02,
                ..EXACT
            },
            spoil: |_, _, trial, size| trial.q.iter_mut().for_each(|q| q[0] += size),
        },
        Fault {
            name: "angle offset 2",
            size: -0.01,
            tolerance: Tolerance {
                angle_offset: 0.02,
                ..EXACT
            },
            spoil: |_, _, trial, size| trial.q.iter_mut().for_each(|q| q[1] += size),
        },
        Fault {
            name: "force bias Fy",
            size: 0.4,
            tolerance: Tolerance {
                force_bias: 1.0,
                ..EXACT
            },
            spoil: |_, _, trial, size| {
                trial
                    .force_on_arm
                    .iter_mut()
                    .flatten()
                    .for_each(|f| f[0] += size)
            },
        },
        Fault {
            name: "force bias Fz",
            size: -0.4,
            tolerance: Tolerance {
                force_bias: 1.0,
                ..EXACT
            },
            spoil: |_, _, trial, size| {
                trial
                    .force_on_arm
                    .iter_mut()
                    .flatten()
                    .for_each(|f| f[1] += size)
            },
        },
        Fault {
            name: "force gain Fy",
            size: 0.03,
            tolerance: Tolerance {
                force_gain: 0.1,
                ..EXACT
            },
            spoil: |_, _, trial, size| {
                trial
                    .force_on_arm
                    .iter_mut()
                    .flatten()
                    .for_each(|f| f[0] *= 1.0 + size)
            },
        },
        Fault {
            name: "force gain Fz",
            size: -0.03,
            tolerance: Tolerance {
                force_gain: 0.1,
                ..EXACT
            },
            spoil: |_, _, trial, size| {
                trial
                    .force_on_arm
                    .iter_mut()
                    .flatten()
                    .for_each(|f| f[1] *= 1.0 + size)
            },
        },
        Fault {
            name: "time delay",
            size: 0.004,
            tolerance: Tolerance {
                time_delay: 0.02,
                ..EXACT
            },
            spoil: |recipe, path, trial, size| {
                let rate = trial.rate;
                for (i, f) in trial.force_on_arm.iter_mut().flatten().enumerate() {
                    *f = recipe.force_at(&path, &[], i as f64 / rate - size);
                }
            },
        },
        Fault {
            name: "handle placement along",
            size: 0.003,
            tolerance: Tolerance {
                handle_placement: 0.02,
                ..EXACT
            },
            spoil: |recipe, path, trial, size| displaced(recipe, path, trial, [size, 0.0]),
        },
        Fault {
            name: "handle placement normal",
            size: -0.003,
            tolerance: Tolerance {
                handle_placement: 0.02,
                ..EXACT
            },
            spoil: |recipe, path, trial, size| displaced(recipe, path, trial, [0.0, size]),
        },
    ]
}

/// The force that leads the arm when it acts at a point displaced along and normal to the last segment.
fn displaced(
    recipe: &Recipe<2>,
    path: &dyn Fn(f64) -> State<2>,
    trial: &mut Trial<2>,
    by: [f64; 2],
) {
    let rate = trial.rate;
    let a = [0, 1].map(|k| recipe.truth.segments()[k].length);
    for (i, f) in trial.force_on_arm.iter_mut().flatten().enumerate() {
        let t = i as f64 / rate;
        let q = path(t)[0];
        let (s1, c1, s12, c12) = (
            libm::sin(q[0]),
            libm::cos(q[0]),
            libm::sin(q[0] + q[1]),
            libm::cos(q[0] + q[1]),
        );
        // From the elbow to the point, and from the shoulder to it.
        let fore = [
            (a[1] + by[0]) * c12 - by[1] * s12,
            (a[1] + by[0]) * s12 + by[1] * c12,
        ];
        let whole = [a[0] * c1 + fore[0], a[0] * s1 + fore[1]];
        let torque = recipe.needed(&path, &[], t);
        // τ_j = r_y F_z − r_z F_y, two equations for two components.
        let determinant = whole[0] * fore[1] - whole[1] * fore[0];
        *f = [
            (fore[0] * torque[0] - whole[0] * torque[1]) / determinant,
            (fore[1] * torque[0] - whole[1] * torque[1]) / determinant,
        ];
    }
}

#[test]
fn each_imperfection_of_the_measurement_is_absorbed_with_its_sign_and_size() {
    let truth = models::mechanical_arm();
    let path = sines([-0.6, 1.2], 0.3, 1.0);
    let mut recipe = Recipe::new(truth);
    recipe.rate = 250.0;
    recipe.duration = 16.0;
    // The arm itself is known well: else a gain of both channels is nothing but another arm.
    let model = wrong(&truth, [[1.0; 3]; 2], 0.003);
    for fault in faults() {
        let mut trial = recipe.force_trial(&path, &[]);
        (fault.spoil)(&recipe, &path, &mut trial, fault.size);
        let mut noise = Noise::new(7);
        for force in trial.force_on_arm.iter_mut().flatten() {
            *force = force.map(|f| f + 0.02 * noise.normal());
        }
        let options = Options {
            tolerance: fault.tolerance,
            ..exactly()
        };
        let result = identify(&model, std::slice::from_ref(&trial), &options).expect("a solution");
        let e = named(&result, fault.name);
        assert!(
            (e.value - fault.size).abs() < 0.12 * fault.size.abs(),
            "{}: {} ± {} instead of {}",
            fault.name,
            e.value,
            e.std,
            fault.size
        );
        // Within the standard deviation of m·l before the fit, 0.003 √2: a fault may not spoil the arm.
        for (c, &x) in result.combinations[..2].iter().zip(truth.first_moments()) {
            close(c.value, x, 4.3e-3);
        }
        // Where the calibration promises perfection the same fault stays in the residual, or makes another arm.
        let strict = identify(&model, &[trial], &exactly()).expect("a solution");
        let worse = rms(&strict, 0) / rms(&result, 0);
        let pairs = strict.combinations[..2].iter().zip(truth.first_moments());
        let wrong = most(pairs.map(|(c, x)| c.value / x - 1.0));
        assert!(
            worse > 1.5 || wrong > 6e-3,
            "{}: {worse} {wrong}",
            fault.name
        );
    }
}

#[test]
fn calibration_within_tolerance_does_not_shrink_the_arm() {
    // Noise of the force stands in the gain's column too: a fit that allows for that regresses noise on itself and
    // finds a gain of several tolerances and an arm that is too light by as much.
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 50.0;
    recipe.duration = 60.0;
    let path = sines([-0.6, 1.2], 0.15, 0.3);
    let mut trials = Vec::new();
    let mut noise = Noise::new(3);
    for _ in 0..6 {
        let mut trial = recipe.force_trial(&path, &[]);
        for force in trial.force_on_arm.iter_mut().flatten() {
            *force = force.map(|f| f + 0.5 * noise.normal());
        }
        trials.push(trial);
    }
    let model = wrong(&truth, [[1.05, 0.97, 1.0], [0.95, 1.03, 1.0]], 0.1);
    let options = Options {
        tolerance: Tolerance::default(),
        cutoff: Some(5.0),
        ..exactly()
    };
    let result = identify(&model, &trials, &options).expect("a solution");
    // A bias of 0.2 N at the end of the forearm is 0.2 · 0.239 / 9.81 kg m, 3.7 % of m2*l2: nothing is known better.
    for (e, &x) in result.combinations[..2].iter().zip(truth.first_moments()) {
        assert!(
            (e.value - x).abs() < 1.5 * e.std && e.std < 0.04 * x,
            "{e:?} instead of {x}"
        );
    }
    for e in &result.calibration {
        assert!(e.value.abs() < 2.5 * sd_of(&e.name), "{e:?}");
    }
}

fn sd_of(name: &str) -> f64 {
    let t = Tolerance::default();
    [
        ("angle", t.angle_offset),
        ("bias", t.force_bias),
        ("gain", t.force_gain),
        ("delay", t.time_delay),
        ("placement", t.handle_placement),
    ]
    .iter()
    .find(|(word, _)| name.contains(word))
    .expect("a known imperfection")
    .1
}

#[test]
fn what_stands_in_a_gap_has_no_influence() {
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let mut trial = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[]);
    let gap = 900..1000;
    gap.clone().for_each(|i| trial.valid[i] = false);
    let model = wrong(&truth, two_factors(), 0.3);
    let clean = identify(&model, std::slice::from_ref(&trial), &exactly()).expect("a solution");
    let mut spoilt = trial.clone();
    for torque in &mut spoilt.torque.as_mut().expect("torques")[gap.start + 45..gap.end - 45] {
        torque.apply(|v| *v += 12.0);
    }
    let masked = identify(&model, std::slice::from_ref(&spoilt), &exactly()).expect("a solution");
    for (a, b) in clean.combinations.iter().zip(&masked.combinations) {
        close(a.value, b.value, 2e-4);
    }
    let margin = (200.0 / 20.0 / 2.0) as usize;
    let near = |i: &usize| *i + margin > gap.start && *i < gap.end + margin;
    assert_eq!(
        masked.explained[0]
            .samples
            .iter()
            .filter(|i| near(i))
            .count(),
        0
    );
    spoilt.valid.fill(true);
    let unmasked = identify(&model, &[spoilt], &exactly()).expect("a solution");
    let moved = (unmasked.combinations[0].value / clean.combinations[0].value - 1.0).abs();
    assert!(moved > 1e-3, "the gap would not have mattered: {moved}");
}

#[test]
fn test_trials_change_no_bit_of_the_estimate() {
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    recipe.force = Some(|t| [1.0 + libm::sin(t), 2.0 * libm::cos(0.7 * t)]);
    let effects = [
        effect("coulomb", 0, &[0.1, 0.1]),
        effect("viscous", 1, &[0.1]),
    ];
    let fit = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &effects);
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "viscous"]);
    let options = Options {
        cutoff: None,
        motion: MotionSource::Auto,
        tolerance: Tolerance::default(),
        level: 0.95,
    };
    let alone = identify(&model, std::slice::from_ref(&fit), &options).expect("a solution");
    // Another movement, another arm, noise, no force: nothing of it may be felt.
    let mut test = Recipe {
        force: None,
        ..recipe
    }
    .torque_trial(&sines([0.3, 0.5], 0.6, 2.0), &[]);
    let mut noise = Noise::new(1);
    test.q
        .iter_mut()
        .for_each(|q| q.apply(|v| *v += 0.01 * noise.normal()));
    test.role = Role::Test;
    test.configuration = 1;
    let both = identify(&model, &[test, fit], &options).expect("a solution");
    assert_eq!(alone.parameters, both.parameters);
    assert_eq!(alone.combinations, both.combinations);
    assert_eq!(alone.calibration, both.calibration);
    assert_eq!(alone.explained[0], both.explained[1]);
    assert_eq!(
        (alone.cutoff, alone.rank, &alone.trades),
        (both.cutoff, both.rank, &both.trades)
    );
    assert_eq!(both.explained.len(), 2);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let trial = recipe.force_trial(
        &sines([-0.6, 1.2], 0.3, 1.0),
        &[effect("coulomb", 0, &[0.1, 0.1])],
    );
    let mut model = wrong(&truth, two_factors(), 0.3);
    model.fitted = at_every_joint::<2>(&["coulomb", "elastic"]);
    let options = Options::default();
    let run = || identify(&model, std::slice::from_ref(&trial), &options).expect("a solution");
    let (first, second) = (run(), run());
    assert_eq!(first.parameters, second.parameters);
    assert_eq!(first.explained, second.explained);
}

#[test]
fn the_start_does_not_matter() {
    // Rounds of linearising converge: started from the estimate itself, with the same prior's width, nothing moves.
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let path = sines([-0.6, 1.2], 0.3, 1.0);
    let mut trial = recipe.force_trial(&path, &[]);
    trial.q.iter_mut().for_each(|q| q[0] += 0.005);
    let mut noise = Noise::new(4);
    for force in trial.force_on_arm.iter_mut().flatten() {
        *force = force.map(|f| f + 0.1 * noise.normal());
    }
    let options = Options {
        tolerance: Tolerance::default(),
        ..exactly()
    };
    let from = |factors| {
        let model: Model<2> = wrong(&truth, factors, 0.3);
        identify(&model, std::slice::from_ref(&trial), &options).expect("a solution")
    };
    let (near, far) = (
        from([[1.0; 3]; 2]),
        from([[1.3, 0.8, 0.7], [0.75, 1.25, 1.3]]),
    );
    for (a, b) in near.combinations[..2].iter().zip(&far.combinations) {
        assert!(
            (a.value - b.value).abs() < 0.5 * a.std,
            "{} against {}",
            a.value,
            b.value
        );
    }
}

#[test]
fn what_cannot_be_used_is_refused() {
    let truth = models::mechanical_arm();
    let mut recipe = Recipe::new(truth);
    recipe.rate = 200.0;
    let trial = recipe.torque_trial(&sines([-0.6, 1.2], 0.3, 1.0), &[]);
    let model = wrong(&truth, two_factors(), 0.3);
    let refused = |model: &Model<2>, trials: &[Trial<2>], options: &Options| -> String {
        identify(model, trials, options)
            .err()
            .map(|e: IdentError| e.to_string())
            .unwrap_or_default()
    };
    assert_eq!(
        refused(&model, std::slice::from_ref(&trial), &exactly()),
        ""
    );

    let mut test = trial.clone();
    test.role = Role::Test;
    assert_eq!(
        refused(&model, &[test], &exactly()),
        "trials with role fit: found 0, expected at least 1"
    );
    let mut short = trial.clone();
    short.q.truncate(12);
    short.torque.as_mut().expect("torques").truncate(12);
    short.valid.truncate(12);
    assert!(
        refused(&model, &[short], &exactly())
            .contains("samples of column: found 12, expected at least")
    );
    let mut masked = trial.clone();
    masked.valid.fill(false);
    assert_eq!(
        refused(&model, &[masked], &exactly()),
        "usable stretches of data: found 0, expected at least 2"
    );
    let nothing = wrong(&truth, two_factors(), 0.0);
    assert_eq!(
        refused(&nothing, std::slice::from_ref(&trial), &exactly()),
        "unknowns: found 0, expected at least 1"
    );
    let options = Options {
        cutoff: Some(100.0),
        ..exactly()
    };
    assert!(
        refused(&model, std::slice::from_ref(&trial), &options)
            .starts_with("cutoff_hz / rate_hz is 0.5")
    );
    let options = Options {
        motion: MotionSource::Simulated,
        ..exactly()
    };
    assert!(refused(&model, &[trial], &options).contains("robot angles in every trial"));
}
