use crate::noise::{Noise, gap};
use arm_ident::IdentError;
use arm_ident::inference::rank::{RankOptions, RankReport, analyse};
use arm_numerics::NumericsError;
use arm_numerics::{Factor, Matrix};

const G: f64 = 9.81;
const A1: f64 = 0.322;

fn report(y: &Matrix, scale: Option<Vec<f64>>) -> RankReport {
    let factor = Factor::of(y, &vec![0.0; y.rows()]).expect("finite");
    analyse(
        &factor.r,
        &RankOptions {
            scale,
            rows: y.rows(),
            tolerance: None,
        },
    )
    .expect("finite")
}

/// The shoulder's row of the thesis in one movement: columns `g cosθ₁` (m1·l1), `g a₁ cosθ₁` (m2) and 1 (a constant torque).
fn thesis(columns: impl Fn(f64) -> Vec<f64>) -> Matrix {
    let rows: Vec<Vec<f64>> = (0..200)
        .map(|i| columns(libm::cos(-1.2 + 0.01 * i as f64)))
        .collect();
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

#[test]
fn a_carried_mass_cannot_be_told_from_a_first_moment() {
    let y = thesis(|cos| vec![G * cos, G * A1 * cos, 1.0]);
    let names = ["m1*l1", "m2", "tau0"];
    let moment = ("m2 and m1*l1 trade 1 : -0.322", (0, 1, A1));
    // Where the prior of m2 is wider than that of m1*l1, m2 represents the group.
    let mass = ("m1*l1 and m2 trade 1 : -3.106", (1, 0, 1.0 / A1));
    for (scale, (words, (base, other, coefficient))) in [
        (None, moment),
        (Some(vec![0.05, 0.05, 0.05]), moment),
        (Some(vec![0.05, 0.2, 0.5]), mass),
    ] {
        let report = report(&y, scale);
        assert_eq!(report.rank, 2);
        assert_eq!(report.describe_trades(&names).expect("three"), [words]);
        let group = &report.combinations[0];
        let &[(index, found)] = &group.others[..] else {
            panic!("{group:?}");
        };
        assert_eq!((group.base, index), (base, other));
        assert!((found - coefficient).abs() < 1e-10, "{found}");
        // m2 alone is not determined, X1 = m1 l1 + a1 m2 and tau0 are.
        let share = |w: [f64; 3]| report.undetermined_share(&w).expect("three");
        assert!(share([0.0, 1.0, 0.0]) > 0.1);
        assert!(share([1.0, A1, 0.0]) < 1e-10);
        assert!(share([0.0, 0.0, 1.0]) < 1e-10);
        // The null vector changes no prediction.
        let null: Vec<f64> = report
            .null_space
            .column(0)
            .iter()
            .zip(&report.scale)
            .map(|(v, s)| v * s)
            .collect();
        assert!(gap(&y.times(&null), &[0.0; 200]) < 1e-12);
    }
}

/// The 3-link statics: h1, h2, h3, m2, m3 with null vectors (h1, m2) ∝ (a1, −1) and (h1, h2, m3) ∝ (a1, a2, −1).
#[test]
fn three_links_have_rank_three_of_five() {
    let a2 = 0.264;
    let mut noise = Noise::new(51);
    let mut y = Matrix::zeros(300, 5);
    for i in (0..300).step_by(3) {
        let cos = [noise.uniform(), noise.uniform(), noise.uniform()].map(|u| G * libm::cos(u));
        // One row a link.
        y[(i, 0)] = cos[0];
        y[(i, 3)] = A1 * cos[0];
        y[(i, 4)] = A1 * cos[0];
        y[(i + 1, 1)] = cos[1];
        y[(i + 1, 4)] = a2 * cos[1];
        y[(i + 2, 2)] = cos[2];
    }
    let report = report(&y, None);
    assert_eq!((report.rank, report.dependent.len()), (3, 2));
    assert!(report.singular_values[2] > 0.1 && report.singular_values[3] < 1e-13);
    for trade in report.trades() {
        let mut x = [0.0; 5];
        x[trade.base] = 1.0;
        trade.others.iter().for_each(|&(i, c)| x[i] = c);
        assert!(gap(&y.times(&x), &[0.0; 300]) < 1e-12);
    }
    for combination in &report.combinations {
        let mut w = [0.0; 5];
        w[combination.base] = 1.0;
        combination.others.iter().for_each(|&(i, c)| w[i] = c);
        assert!(report.undetermined_share(&w).expect("five") < 1e-10);
    }
}

#[test]
fn full_rank_and_dead_columns() {
    let mut noise = Noise::new(52);
    let full = report(&noise.matrix(50, 4), None);
    assert_eq!(
        (full.rank, full.base, full.null_space.cols()),
        (4, vec![0, 1, 2, 3], 0)
    );
    let dead = report(&noise.matrix(50, 3).scaled_columns(&[1.0, 0.0, 1.0]), None);
    assert_eq!(
        (dead.rank, dead.dependent.clone(), dead.condition),
        (2, vec![1], f64::INFINITY)
    );
    let names = ["a", "b", "c"];
    assert_eq!(
        dead.describe_trades(&names).expect("three"),
        ["b does not act on the data"]
    );
    let nothing = report(&Matrix::zeros(5, 2), None);
    assert_eq!((nothing.rank, nothing.base.len()), (0, 0));
}

#[test]
fn the_threshold_can_be_set() {
    let r = Matrix::diagonal(&[1.0, 1e-3, 1e-6]);
    let rank = |tolerance| {
        let scale = Some(vec![1.0; 3]);
        analyse(
            &r,
            &RankOptions {
                scale,
                rows: 3,
                tolerance,
            },
        )
        .expect("finite")
        .rank
    };
    assert_eq!([rank(None), rank(Some(1e-4)), rank(Some(0.5))], [3, 2, 1]);
}

#[test]
fn refuses_bad_input() {
    let r = Matrix::identity(2);
    let with = |scale: Option<Vec<f64>>, tolerance| {
        analyse(
            &r,
            &RankOptions {
                scale,
                rows: 2,
                tolerance,
            },
        )
    };
    assert!(matches!(
        with(Some(vec![1.0]), None),
        Err(IdentError::Numerics(NumericsError::Length {
            name: "scale",
            ..
        }))
    ));
    assert!(with(Some(vec![1.0, 0.0]), None).is_err());
    assert!(with(None, Some(f64::NAN)).is_err());
    let good = with(None, None).expect("accepted");
    assert!(good.describe_trades(&["a"]).is_err());
    assert!(good.undetermined_share(&[0.0, 0.0]).is_err());
    assert!(good.undetermined_share(&[1.0]).is_err());
}
