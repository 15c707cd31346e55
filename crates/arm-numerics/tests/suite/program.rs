use crate::noise::{Noise, gap};
use arm_numerics::least_squares::program::{Cone, Outcome, Program, Route, Status};
use arm_numerics::{Factor, Matrix, NumericsError};
use nalgebra::{DMatrix, DVector};

const FREE: f64 = f64::INFINITY;
/// Least squares on a well-conditioned active set.
const EXACT: f64 = 1e-10;

fn identity(z: &[f64]) -> Program {
    Program::new(Matrix::identity(z.len()), z.to_vec()).expect("finite")
}

fn solve(program: Result<Program, NumericsError>) -> Outcome {
    program.and_then(|p| p.solve()).expect("accepted input")
}

/// `‖x‖ ≤ radius`
fn ball(p: usize, radius: f64) -> Cone {
    Cone {
        a: Matrix::identity(p),
        b: vec![0.0; p],
        c: vec![0.0; p],
        d: radius,
    }
}

#[test]
fn without_constraints_it_is_least_squares() {
    let mut noise = Noise::new(41);
    let (y, b) = (noise.matrix(60, 5), noise.vector(60));
    let factor = Factor::of(&y, &b).expect("finite");
    let outcome = solve(Program::of(&factor));
    assert_eq!(
        (outcome.status, outcome.route),
        (Status::Solved, Route::Direct)
    );
    assert!(gap(&outcome.x, &factor.solve().expect("full rank")) < EXACT);
    assert_eq!((outcome.rank, outcome.iterations), (5, 0));
    assert!(
        (outcome.objective + factor.rho2 - factor.residual2(&outcome.x).expect("five")).abs()
            < EXACT
    );
}

#[test]
fn bounds_hold_exactly_and_say_which() {
    let lower = [0.0, -1.0, -FREE, 0.1];
    let outcome = solve(identity(&[-2.0, 3.0, 7.0, 0.5]).bounds(&lower, &[FREE, 2.5, FREE, 0.3]));
    assert_eq!(
        (outcome.status, outcome.route),
        (Status::Solved, Route::Polished)
    );
    assert_eq!(outcome.x, [0.0, 2.5, 7.0, 0.3]);
    assert_eq!(outcome.active, [-1, 1, 0, 1]);
    // Gradient x − z: the price of each bound.
    assert!(gap(&outcome.gradient, &[2.0, -0.5, 0.0, -0.2]) < EXACT);
    assert!((outcome.objective - (4.0 + 0.25 + 0.04)).abs() < EXACT);
}

#[test]
fn equalities_and_inequalities_have_known_solutions() {
    // Foot of the perpendicular from (3, 1) on x + y = 2.
    let foot = solve(identity(&[3.0, 1.0]).equal(&[1.0, 1.0], 2.0));
    assert_eq!(foot.route, Route::Direct);
    assert!(gap(&foot.x, &[2.0, 0.0]) < EXACT);
    // The same as an inequality, binding and not.
    let binding = solve(identity(&[3.0, 1.0]).at_most(&[10.0, 10.0], 20.0));
    assert!(gap(&binding.x, &[2.0, 0.0]) < EXACT);
    assert_eq!(binding.binding_inequalities, [true]);
    let loose = solve(identity(&[3.0, 1.0]).at_most(&[1.0, 1.0], 20.0));
    assert!(gap(&loose.x, &[3.0, 1.0]) < EXACT);
    assert_eq!(
        (loose.binding_inequalities, loose.route),
        (vec![false], Route::Direct)
    );
    // An equality, a fixed parameter and a bound together: x + y + w = 1, w = 2, y ≥ 0 → x = −1, y = 0.
    let program = identity(&[0.0, -5.0, 9.0]).equal(&[1.0; 3], 1.0);
    let mixed = solve(program.and_then(|p| p.bounds(&[-FREE, 0.0, 2.0], &[FREE, FREE, 2.0])));
    assert!(gap(&mixed.x, &[-1.0, 0.0, 2.0]) < EXACT);
    assert_eq!((mixed.x[1], mixed.x[2]), (0.0, 2.0));
    assert_eq!(mixed.active, [0, -1, 1]);
}

/// Tries every pattern of {free, at lower, at upper} and keeps the best feasible one: slow, and independent of the solver.
fn enumerated(r: &Matrix, z: &[f64], lower: &[f64], upper: &[f64]) -> (Vec<f64>, f64) {
    let p = lower.len();
    let a = DMatrix::from_column_slice(r.rows(), p, r.as_slice());
    let mut best = (vec![f64::NAN; p], f64::INFINITY);
    for pattern in 0..3_usize.pow(p as u32) {
        let state = |i: usize| pattern / 3_usize.pow(i as u32) % 3;
        let free: Vec<usize> = (0..p).filter(|&i| state(i) == 0).collect();
        let mut x: Vec<f64> = (0..p)
            .map(|i| [0.0, lower[i], upper[i]][state(i)])
            .collect();
        if x.iter().any(|v| v.is_infinite()) {
            continue;
        }
        let rest = DVector::from_column_slice(z) - &a * DVector::from_column_slice(&x);
        if !free.is_empty() {
            let columns = a.select_columns(&free);
            let qr = columns.qr();
            let solution = qr.r().solve_upper_triangular(&(qr.q().transpose() * &rest));
            let Some(solution) = solution else { continue };
            free.iter()
                .zip(solution.iter())
                .for_each(|(&i, v)| x[i] = *v);
        }
        let slack = 1e-12;
        if (0..p).any(|i| x[i] < lower[i] - slack || x[i] > upper[i] + slack) {
            continue;
        }
        let objective =
            (DVector::from_column_slice(z) - &a * DVector::from_column_slice(&x)).norm_squared();
        if objective < best.1 {
            best = (x, objective);
        }
    }
    best
}

fn random_bounds(noise: &mut Noise, p: usize) -> (Vec<f64>, Vec<f64>) {
    let mut side = |sign: f64| -> Vec<f64> {
        (0..p)
            .map(|_| {
                let absent = noise.uniform() < -0.4;
                let value = noise.uniform().abs();
                sign * if absent { FREE } else { value }
            })
            .collect()
    };
    (side(-1.0), side(1.0))
}

#[test]
fn equals_enumeration_on_200_random_bounded_problems() {
    let mut noise = Noise::new(42);
    let (mut bounded, mut unpolished) = (0, 0);
    for case in 0..200 {
        let p = 1 + case % 5;
        let r = noise.matrix(p + case % 3, p);
        let z: Vec<f64> = noise.vector(r.rows()).iter().map(|v| 2.0 * v).collect();
        let (lower, upper) = random_bounds(&mut noise, p);
        let (x, objective) = enumerated(&r, &z, &lower, &upper);
        let outcome = solve(Program::new(r, z).and_then(|q| q.bounds(&lower, &upper)));
        assert_eq!(outcome.status, Status::Solved, "case {case}");
        assert!(
            gap(&outcome.x, &x) < 1e-8 * outcome.condition.max(1.0),
            "case {case}: {:?} {x:?}",
            outcome.x
        );
        assert!(outcome.objective <= objective + 1e-10, "case {case}");
        bounded += usize::from(outcome.route != Route::Direct);
        unpolished += usize::from(outcome.route == Route::Interior);
        for i in 0..p {
            let expected = if outcome.x[i] == lower[i] {
                -1
            } else {
                i8::from(outcome.x[i] == upper[i])
            };
            assert_eq!(outcome.active[i], expected, "case {case}");
        }
    }
    assert!(bounded > 100, "only {bounded} cases were constrained");
    assert_eq!(unpolished, 0);
}

#[test]
fn a_ball_is_touched_where_it_should_be() {
    let outcome = solve(identity(&[3.0, 4.0]).cone(ball(2, 1.0)));
    assert_eq!(
        (outcome.status, outcome.route),
        (Status::Solved, Route::Polished)
    );
    assert!(gap(&outcome.x, &[0.6, 0.8]) < EXACT);
    assert_eq!(outcome.binding_cones, [true]);
    let inside = solve(identity(&[0.3, 0.4]).cone(ball(2, 1.0)));
    assert_eq!(
        (inside.route, inside.binding_cones),
        (Route::Direct, vec![false])
    );
}

/// `min Σ (w_i x_i − z_i)²` in the unit ball: x_i = w_i z_i / (w_i² + λ) with λ from `‖x‖ = 1`, found here by bisection.
#[test]
fn an_ellipse_meets_the_ball_where_the_secular_equation_says() {
    let (w, z) = ([5.0, 1.0, 0.2], [4.0, -3.0, 2.0]);
    let at = |lambda: f64| -> Vec<f64> {
        (0..3)
            .map(|i| w[i] * z[i] / (w[i] * w[i] + lambda))
            .collect()
    };
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let x = at(middle);
        if x.iter().map(|v| v * v).sum::<f64>() > 1.0 {
            low = middle
        } else {
            high = middle
        }
    }
    let program = Program::new(Matrix::diagonal(&w), z.to_vec());
    let outcome = solve(program.and_then(|p| p.cone(ball(3, 1.0))));
    assert_eq!(outcome.route, Route::Polished);
    assert!(
        gap(&outcome.x, &at(low)) < 1e-9,
        "{:?} {:?}",
        outcome.x,
        at(low)
    );
}

/// Planar pseudo-inertia: `I m ≥ h²` as a cone. Data with I = 0.1, m = 1, h = 1 are projected onto its surface, a bound on m included.
#[test]
fn physical_consistency_binds_together_with_a_bound() {
    let l = 0.3;
    // Parameters (m, h, I): ‖(2 L h, I − L² m)‖ ≤ I + L² m.
    let cone = Cone {
        a: Matrix::from_row_major(2, 3, &[0.0, 2.0 * l, 0.0, -l * l, 0.0, 1.0]).expect("six"),
        b: vec![0.0; 2],
        c: vec![l * l, 0.0, 1.0],
        d: 0.0,
    };
    let program = identity(&[2.0, 1.0, 0.1])
        .scale(&[1.0, 0.3, 0.1])
        .and_then(|p| p.cone(cone))
        .and_then(|p| p.bounds(&[0.0, 0.0, 0.0], &[1.5, FREE, FREE]));
    let outcome = solve(program);
    assert_eq!(
        (outcome.status, outcome.route),
        (Status::Solved, Route::Polished)
    );
    let [m, h, inertia] = outcome.x[..] else {
        panic!("three parameters")
    };
    assert_eq!((m, outcome.active[0]), (1.5, 1));
    assert_eq!(outcome.binding_cones, [true]);
    assert!((inertia * m - h * h).abs() < 1e-10);
    // Along the surface I = h²/m the derivative of (h−1)² + (I−0.1)² vanishes.
    assert!(((h - 1.0) + (inertia - 0.1) * 2.0 * h / m).abs() < 1e-9);
}

#[test]
fn contradictions_are_infeasible_and_nothing_else() {
    let bound = identity(&[0.0, 0.0]).bounds(&[2.0, -FREE], &[FREE, FREE]);
    let outcome = solve(bound.and_then(|p| p.at_most(&[1.0, 0.0], 1.0)));
    assert_eq!(outcome.status, Status::Infeasible);
    assert!(outcome.x.iter().all(|v| v.is_nan()) && outcome.objective.is_nan());
    let twice = identity(&[0.0])
        .equal(&[1.0], 1.0)
        .and_then(|p| p.equal(&[2.0], 3.0));
    assert_eq!(solve(twice).status, Status::Infeasible);
    let repeated = identity(&[0.0])
        .equal(&[1.0], 1.0)
        .and_then(|p| p.equal(&[2.0], 2.0));
    assert!(gap(&solve(repeated).x, &[1.0]) < EXACT);
    let far = identity(&[0.0, 0.0])
        .cone(ball(2, 1.0))
        .and_then(|p| p.equal(&[1.0, 1.0], 3.0));
    assert_eq!(solve(far).status, Status::Infeasible);
}

#[test]
fn ill_conditioned_problems_take_the_epigraph_form() {
    let mut noise = Noise::new(43);
    for decade in [1e-7, 1e-8] {
        let mut r = noise.matrix(4, 4);
        for i in 0..4 {
            r[(i, 3)] = r[(i, 2)] + decade * r[(i, 3)];
        }
        let z = r.times(&[1.0, -1.0, 2.0, 3.0]);
        let (lower, upper) = ([-FREE, 0.0, -FREE, -2.0], [FREE, FREE, FREE, 2.0]);
        let (x, objective) = enumerated(&r, &z, &lower, &upper);
        let outcome = solve(Program::new(r, z).and_then(|p| p.bounds(&lower, &upper)));
        assert!(outcome.condition > 1e6);
        assert_eq!(
            (outcome.status, outcome.route),
            (Status::Solved, Route::Polished)
        );
        assert!((outcome.objective - objective).abs() < 1e-10 * (1.0 + objective));
        assert!(gap(&outcome.x, &x) < EXACT, "{:?} {x:?}", outcome.x);
        assert_eq!((outcome.x[1], outcome.x[3].abs()), (0.0, 2.0));
    }
}

#[test]
fn a_missing_direction_is_reported_and_bounds_still_hold() {
    // Only x + y is seen.
    let r = Matrix::from_row_major(1, 2, &[1.0, 1.0]).expect("two");
    let free = solve(Program::new(r.clone(), vec![4.0]));
    assert_eq!((free.rank, free.condition > 1e15), (1, true));
    assert!(gap(&free.x, &[2.0, 2.0]) < EXACT);
    let bounded =
        solve(Program::new(r.clone(), vec![4.0]).and_then(|p| p.bounds(&[-FREE; 2], &[1.0, FREE])));
    assert_eq!(bounded.status, Status::Solved);
    assert!(bounded.x[0] <= 1.0 && bounded.objective < 1e-12);
    let both = solve(Program::new(r, vec![4.0]).and_then(|p| p.bounds(&[-FREE; 2], &[1.0, 1.0])));
    assert_eq!((both.x, both.active), (vec![1.0, 1.0], vec![1, 1]));
}

#[test]
fn units_do_not_matter_when_the_scale_is_given() {
    let mut noise = Noise::new(44);
    let r = noise.matrix(6, 6);
    let z = noise.vector(6);
    let (lower, upper) = ([-0.2; 6], [0.3; 6]);
    let plain = solve(Program::new(r.clone(), z.clone()).and_then(|p| p.bounds(&lower, &upper)));
    let unit = [1e-6, 1e5, 1.0, 1e-3, 1e8, 10.0];
    let inverse: Vec<f64> = unit.iter().map(|u| 1.0 / u).collect();
    let times = |v: &[f64]| -> Vec<f64> { v.iter().zip(&unit).map(|(v, u)| v * u).collect() };
    for scale in [Some(unit.to_vec()), None] {
        let mut program = Program::new(r.scaled_columns(&inverse), z.clone())
            .and_then(|p| p.bounds(&times(&lower), &times(&upper)));
        if let Some(scale) = scale {
            program = program.and_then(|p| p.scale(&scale));
        }
        let outcome = solve(program);
        assert_eq!(outcome.route, Route::Polished);
        let back: Vec<f64> = outcome.x.iter().zip(&unit).map(|(x, u)| x / u).collect();
        assert!(gap(&back, &plain.x) < EXACT);
        assert_eq!(outcome.active, plain.active);
    }
}

#[test]
fn repeated_solves_have_equal_bits() {
    let mut noise = Noise::new(45);
    for _ in 0..20 {
        let r = noise.matrix(8, 8);
        let z = noise.vector(8);
        let program = Program::new(r, z)
            .and_then(|p| p.bounds(&[-0.1; 8], &[0.2; 8]))
            .and_then(|p| p.cone(ball(8, 0.25)))
            .expect("finite");
        let (first, second) = (
            program.solve().expect("finite"),
            program.clone().solve().expect("finite"),
        );
        let bits = |outcome: &Outcome| outcome.x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&first), bits(&second));
        assert_eq!(first, second);
        assert_eq!(first.status, Status::Solved);
    }
}

#[test]
fn nothing_to_estimate_is_no_problem() {
    let outcome = solve(Program::new(Matrix::zeros(0, 0), Vec::new()));
    assert_eq!((outcome.status, outcome.rank), (Status::Solved, 0));
    let only_noise = solve(Program::new(Matrix::zeros(2, 0), vec![3.0, 4.0]));
    assert!((only_noise.objective - 25.0).abs() < EXACT);
    // A column of zeros stays at zero, or at the bound nearest to it.
    let dead = Program::new(Matrix::diagonal(&[1.0, 0.0]), vec![1.0, 0.0]);
    let held = solve(dead.and_then(|p| p.bounds(&[-FREE, 2.0], &[FREE; 2])));
    assert_eq!((held.status, held.rank), (Status::Solved, 1));
    assert!((held.x[0] - 1.0).abs() < EXACT && held.x[1] >= 2.0);
}

#[test]
fn refuses_bad_input_by_name() {
    let good = identity(&[1.0, 2.0]);
    let name = |result: Result<Program, NumericsError>| match result {
        Err(
            NumericsError::Length { name, .. }
            | NumericsError::NotFinite { name, .. }
            | NumericsError::OutOfRange { name, .. },
        ) => name,
        Err(NumericsError::Bounds { .. }) => "bounds",
        other => panic!("not refused: {other:?}"),
    };
    let nan = f64::NAN;
    assert_eq!(name(Program::new(Matrix::identity(2), vec![1.0])), "z");
    assert_eq!(name(Program::new(Matrix::identity(2), vec![1.0, nan])), "z");
    assert_eq!(
        name(Program::new(Matrix::diagonal(&[1.0, nan]), vec![1.0; 2])),
        "r"
    );
    assert_eq!(name(good.clone().scale(&[1.0])), "scale");
    assert_eq!(name(good.clone().scale(&[1.0, 0.0])), "scale");
    assert_eq!(name(good.clone().scale(&[1.0, nan])), "scale");
    assert_eq!(name(good.clone().bounds(&[0.0], &[1.0, 1.0])), "lower");
    assert_eq!(name(good.clone().bounds(&[0.0, 0.0], &[1.0])), "upper");
    assert_eq!(
        name(good.clone().bounds(&[0.0, 2.0], &[1.0, 1.0])),
        "bounds"
    );
    assert_eq!(
        name(good.clone().bounds(&[0.0, nan], &[1.0, 1.0])),
        "bounds"
    );
    assert_eq!(
        name(good.clone().bounds(&[FREE, 0.0], &[FREE, 1.0])),
        "bounds"
    );
    assert_eq!(name(good.clone().equal(&[1.0], 0.0)), "row");
    assert_eq!(name(good.clone().equal(&[1.0, 1.0], nan)), "value");
    assert_eq!(name(good.clone().at_most(&[1.0, nan], 0.0)), "row");
    assert_eq!(name(good.clone().cone(ball(3, 1.0))), "cone.a (columns)");
    assert_eq!(name(good.clone().cone(ball(2, nan))), "cone.d");
    let short = Cone {
        b: vec![0.0],
        ..ball(2, 1.0)
    };
    assert_eq!(name(good.clone().cone(short)), "cone.b");
    let text = good
        .bounds(&[0.0, 2.0], &[1.0, 1.0])
        .expect_err("crossed")
        .to_string();
    assert_eq!(
        text,
        "bounds of parameter 1: lower 2 is not below or equal to upper 1"
    );
}
