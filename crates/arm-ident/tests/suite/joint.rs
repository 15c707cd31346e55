//! The joint method on trials whose truth is known: what it recovers, and what it leaves open.

use super::joint_method::{close, exactly, human, named, rms, two_factors};
use super::noise::Noise;
use super::synthetic::{Recipe, State, at_every_joint, effect, sines, wrong};
use arm_core::{Chain, Joints, sample_arms};
use arm_ident::inference::estimate::Decision;
use arm_ident::inference::joint_method::{Options, identify};
use arm_ident::regression::trial::Trial;

/// Half a period of the fastest sine is some 700 samples: the filter and the differences are exact to about 1e-6.
const BY_SAMPLING: f64 = 2e-5;

/// Every first and second moment of the links.
fn moments<const N: usize>(chain: &Chain<f64, N>) -> Vec<f64> {
    let (x, j) = (chain.first_moments(), chain.second_moments());
    x.iter().chain(j).copied().collect()
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
            assert_eq!((e.decided_by, e.joint), (Decision::Data, Some(j + 1)));
        }
        for (found, value) in moments(&result.chain).iter().zip(&moments(&truth)) {
            close(*found, *value, 50.0 * BY_SAMPLING);
        }
    }
}

#[test]
fn the_rest_angle_of_a_spring_is_an_unknown() {
    let truth = human();
    let path = sines([-0.6, 0.9, 0.2], 0.35, 1.0);
    let springs = [[1.2, -0.5], [-0.4, 0.7], [0.5, 0.1]];
    let effects: Vec<_> = (0..3).map(|j| effect("elastic", j, &springs[j])).collect();
    let trial = Recipe::new(truth).torque_trial(&path, &effects);
    let mut model = wrong(
        &truth,
        [[1.1, 0.92, 0.8], [0.9, 1.08, 1.3], [1.2, 0.9, 0.7]],
        0.3,
    );
    model.fitted = at_every_joint::<3>(&["elastic"]);
    let result = identify(&model, std::slice::from_ref(&trial), &exactly()).expect("a solution");
    for (j, [stiffness, rest]) in springs.into_iter().enumerate() {
        let of = |name: &str| named(&result, &format!("elastic{} {name}", j + 1));
        close(of("stiffness").value, stiffness, 50.0 * BY_SAMPLING);
        close(of("rest").value, rest, 100.0 * BY_SAMPLING);
        assert_eq!(
            (of("rest").joint, of("rest").unit.as_str()),
            (Some(j + 1), "rad")
        );
        assert_eq!(result.fitted[j].parameters[1], of("rest").value);
        let torque = of("stiffness*rest");
        assert_eq!(
            (torque.kind.as_str(), torque.joint),
            ("elastic", Some(j + 1))
        );
    }
    // By what they are, not by a `+` in the name.
    assert_eq!(named(&result, "I1 + m1*l1^2").kind, "segment");
    assert!(result.combinations.iter().all(|e| e.kind == "combination"));
    // A constant moment in the same joint is the same column.
    model.fitted = at_every_joint::<3>(&["elastic", "constant_moment"]);
    let result = identify(&model, &[trial], &exactly()).expect("a solution");
    assert!(result.parameters.iter().all(|e| !e.name.contains("rest")));
    for (j, [stiffness, rest]) in springs.into_iter().enumerate() {
        let moment = named(&result, &format!("constant_moment{} moment", j + 1));
        close(moment.value, -stiffness * rest, 100.0 * BY_SAMPLING);
    }
}

#[test]
fn forces_at_the_tip_tell_as_much_as_torques() {
    let truth = sample_arms::mechanical_arm();
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

/// Slow and noisy, so that the moments of inertia are determined by chance only.
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
    let truth = sample_arms::mechanical_arm();
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
            assert!(e.value >= 0.0 && e.interval.0 >= 0.0, "{}: {e:?}", e.name);
            assert!(e.std > 0.0, "a bound leaves no doubt: {e:?}");
            bounds += usize::from(e.decided_by == Decision::Bound);
            assert!(e.decided_by != Decision::Bound || e.value == 0.0);
            covered += usize::from(e.interval.0 == 0.0);
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
    // The speed of the measured angles is real although the torques do not depend on it: a slow movement makes it negligible.
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
    let truth = sample_arms::mechanical_arm();
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
    // One direction of the rank is the scale itself, which no data determine.
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
