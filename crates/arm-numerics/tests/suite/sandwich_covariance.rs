use crate::noise::{Noise, gap};
use arm_numerics::statistics::sandwich_covariance::{
    SandwichCovariance, blocks, information_ratio, standard_error,
};
use arm_numerics::{Factor, Matrix, NumericsError};

/// Three equations for one parameter, H = 3: the variance of a mean of three.
#[test]
fn the_mean_of_three_numbers() {
    let y = Matrix::from_fn(3, 1, |_, _| 1.0);
    let r = Factor::of(&y, &[1.0, 2.0, 6.0]).expect("finite").r;
    let bread = SandwichCovariance::new(&r, &[]).expect("one");
    assert!((bread.white(7.0)[(0, 0)] - 7.0 / 3.0).abs() < 1e-14);
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
    assert!(bread.apply(&[1.0]).is_err());
    assert!(bread.sandwich(&Matrix::identity(3)).is_err());
    assert!(SandwichCovariance::with_fixed(&Matrix::identity(2), &[true]).is_err());
    assert!(SandwichCovariance::new(&Matrix::identity(2), &[vec![1.0, f64::NAN]]).is_err());
}
