use crate::noise::{Noise, gap};
use arm_numerics::statistics::sandwich_covariance::{
    SandwichCovariance, blocks, information_ratio, intervals, standard_error,
};
use arm_numerics::{Condenser, Factor, Matrix, NumericsError};

const REPETITIONS: usize = 500;
/// Three standard deviations of a coverage of 95 % counted in 500 repetitions.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.92..=0.98;

/// 10 trials of 200 samples, columns 1, t and a square wave, noise AR(0.9) of standard deviation 0.2.
struct Session {
    trials: Vec<Factor>,
    all: Factor,
}

const TRUTH: [f64; 3] = [1.0, -0.5, 0.3];

fn session(noise: &mut Noise, trials: usize) -> Session {
    let mut all = Condenser::new(3);
    let one = |noise: &mut Noise| {
        let mut condenser = Condenser::new(3);
        for (i, e) in noise.slow(0.9, 200).into_iter().enumerate() {
            let square = if (i / 25) % 2 == 0 { 1.0 } else { -1.0 };
            let row = [1.0, 0.01 * i as f64 - 1.0, square];
            let b: f64 = row.iter().zip(TRUTH).map(|(y, x)| y * x).sum();
            condenser.push(&row, b + 0.2 * e).expect("finite");
        }
        condenser.finish()
    };
    let trials: Vec<Factor> = (0..trials).map(|_| one(noise)).collect();
    trials
        .iter()
        .for_each(|t| all.merge_factor(t).expect("three"));
    Session {
        trials,
        all: all.finish(),
    }
}

#[test]
fn clustered_intervals_cover_and_white_ones_do_not() {
    let mut noise = Noise::new(71);
    let (mut clustered, mut white) = ([0; 3], [0; 3]);
    for _ in 0..REPETITIONS {
        let Session { trials, all } = session(&mut noise, 10);
        let x = all.solve().expect("full rank");
        let bread = SandwichCovariance::new(&all.r, &[]).expect("full rank");
        let scores: Vec<Vec<f64>> = trials.iter().map(|t| t.score(&x).expect("three")).collect();
        let robust = bread.clustered(&scores).expect("ten");
        let naive = bread.white(all.rho2 / (all.rows as f64 - 3.0));
        for (covariance, dof, hits) in [(robust, 9.0, &mut clustered), (naive, 1997.0, &mut white)]
        {
            let found = intervals(&x, &covariance, dof, 0.95).expect("valid");
            for (hit, (i, truth)) in hits.iter_mut().zip(found.iter().zip(TRUTH)) {
                *hit += usize::from(i.low <= truth && truth <= i.high);
            }
        }
    }
    let share = |hits: [usize; 3]| hits.map(|h| h as f64 / REPETITIONS as f64);
    assert!(
        share(clustered).iter().all(|c| COVERAGE.contains(c)),
        "{:?}",
        share(clustered)
    );
    assert!(
        share(white)[..2].iter().all(|c| *c < 0.6),
        "{:?}",
        share(white)
    );
}

#[test]
fn a_prior_pulls_all_clusters_alike_and_adds_no_spread() {
    let mut noise = Noise::new(72);
    let Session { trials, all } = session(&mut noise, 10);
    let prior = all
        .with_prior(&[3.0, 0.0, 0.0], &[0.01, 10.0, 10.0])
        .expect("valid");
    let x = prior.solve().expect("full rank");
    let scores: Vec<Vec<f64>> = trials.iter().map(|t| t.score(&x).expect("three")).collect();
    let tight = SandwichCovariance::new(&prior.r, &[])
        .expect("full rank")
        .clustered(&scores)
        .expect("ten");
    let loose = SandwichCovariance::new(&all.r, &[])
        .expect("full rank")
        .clustered(&scores)
        .expect("ten");
    assert!(tight[(0, 0)] < loose[(0, 0)]);
}

/// Three clusters, one parameter, H = 3: x̂ = mean of (1, 2, 6) = 3, variance of the mean = 7/3.
#[test]
fn the_mean_of_three_numbers() {
    let values = [1.0, 2.0, 6.0];
    let y = Matrix::from_fn(3, 1, |_, _| 1.0);
    let all = Factor::of(&y, &values).expect("finite");
    let x = all.solve().expect("one");
    let scores: Vec<Vec<f64>> = values.iter().map(|v| vec![v - x[0]]).collect();
    let bread = SandwichCovariance::new(&all.r, &[]).expect("one");
    let covariance = bread.clustered(&scores).expect("three");
    assert!((x[0] - 3.0).abs() < 1e-14 && (covariance[(0, 0)] - 7.0 / 3.0).abs() < 1e-14);
    assert!((bread.white(7.0)[(0, 0)] - 7.0 / 3.0).abs() < 1e-14);
    let found = intervals(&x, &covariance, 2.0, 0.95).expect("valid")[0];
    assert!((found.high - 3.0 - 4.302652729749462 * (7.0_f64 / 3.0).sqrt()).abs() < 1e-10);
}

#[test]
fn binding_constraints_take_their_direction_out() {
    let mut noise = Noise::new(73);
    let r = Factor::of(&noise.matrix(40, 3), &[0.0; 40])
        .expect("finite")
        .r;
    let full = SandwichCovariance::new(&r, &[])
        .expect("full rank")
        .white(1.0);
    let inverse = full.product(&r.transpose().product(&r));
    assert!(gap(inverse.as_slice(), Matrix::identity(3).as_slice()) < 1e-12);

    let fixed = SandwichCovariance::with_fixed(&r, &[false, true, false]).expect("full rank");
    assert_eq!(fixed.free(), 2);
    let covariance = fixed.white(1.0);
    assert!((0..3).all(|i| covariance[(1, i)].abs() < 1e-15));
    // The same as the problem without that column.
    let smaller = SandwichCovariance::new(&r.select_columns(&[0, 2]), &[])
        .expect("full rank")
        .white(1.0);
    assert!((covariance[(0, 0)] - smaller[(0, 0)]).abs() < 1e-13);
    assert!((covariance[(0, 2)] - smaller[(0, 1)]).abs() < 1e-13);

    // On x₀ + 2 x₁ = const. that combination is certain; scale and repetition of the constraint do not matter.
    let sum = [1.0, 2.0, 0.0];
    let held = SandwichCovariance::new(&r, &[sum.to_vec(), sum.map(|v| 1e6 * v).to_vec()])
        .expect("full rank");
    assert_eq!(held.free(), 2);
    assert!(standard_error(&held.white(1.0), &sum).expect("three") < 1e-7);
    let meat = r.transpose().product(&r);
    assert!(
        gap(
            held.sandwich(&meat).expect("three").as_slice(),
            held.white(1.0).as_slice()
        ) < 1e-12
    );
}

#[test]
fn a_held_parameter_makes_an_undetermined_problem_determined() {
    let r = Matrix::from_row_major(1, 2, &[1.0, 1.0]).expect("two");
    assert!(matches!(
        SandwichCovariance::new(&r, &[]),
        Err(NumericsError::Rank {
            found: 1,
            expected: 2,
            ..
        })
    ));
    let held = SandwichCovariance::with_fixed(&r, &[true, false]).expect("one left");
    assert!((held.white(4.0)[(1, 1)] - 4.0).abs() < 1e-14);
}

#[test]
fn blocks_cover_everything_once() {
    for (n, shortest) in [(10, 3), (10, 11), (1, 1), (1000, 7)] {
        let cut = blocks(n, shortest).expect("positive");
        assert_eq!((cut[0].start, cut[cut.len() - 1].end), (0, n));
        assert!(cut.windows(2).all(|w| w[0].end == w[1].start));
        assert!(cut.iter().all(|b| b.len() >= shortest.min(n)));
    }
    assert!(blocks(0, 3).is_err() && blocks(3, 0).is_err());
}

#[test]
fn information_ratio_and_refusals() {
    assert_eq!(information_ratio(0.5, 1.0), Ok(0.75));
    assert_eq!(information_ratio(2.0, 1.0), Ok(0.0));
    assert!(information_ratio(0.5, 0.0).is_err());
    let bread = SandwichCovariance::new(&Matrix::identity(2), &[]).expect("full rank");
    assert!(matches!(
        bread.clustered(&[vec![1.0, 1.0]]),
        Err(NumericsError::TooFew {
            found: 1,
            expected: 2,
            ..
        })
    ));
    assert!(bread.clustered(&[vec![1.0], vec![1.0]]).is_err());
    assert!(
        bread
            .clustered(&[vec![1.0, f64::NAN], vec![1.0, 1.0]])
            .is_err()
    );
    assert!(bread.apply(&[1.0]).is_err());
    assert!(bread.sandwich(&Matrix::identity(3)).is_err());
    assert!(SandwichCovariance::with_fixed(&Matrix::identity(2), &[true]).is_err());
    assert!(SandwichCovariance::new(&Matrix::identity(2), &[vec![1.0, f64::NAN]]).is_err());
    let cov = Matrix::identity(2);
    assert!(intervals(&[1.0], &cov, 9.0, 0.95).is_err());
    assert!(intervals(&[1.0, f64::NAN], &cov, 9.0, 0.95).is_err());
    assert!(intervals(&[1.0, 1.0], &cov, 9.0, 1.0).is_err());
    assert!(intervals(&[1.0, 1.0], &Matrix::diagonal(&[1.0, -1.0]), 9.0, 0.95).is_err());
}
