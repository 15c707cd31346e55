use crate::noise::{Noise, gap};
use arm_numerics::least_squares::condense::{BLOCK, Column, LARGEST};
use arm_numerics::{Condenser, Factor, Matrix, NumericsError};
use nalgebra::{DMatrix, DVector};

/// Rounding of a well-conditioned QR of a few thousand rows.
const ROUNDING: f64 = 1e-12;

fn row_major(y: &Matrix) -> Vec<f64> {
    let t = y.transpose();
    t.as_slice().to_vec()
}

fn condensed(y: &Matrix, b: &[f64]) -> Factor {
    let mut condenser = Condenser::new(y.cols());
    condenser
        .push_block(&row_major(y), b)
        .expect("finite numbers");
    condenser.finish()
}

/// nalgebra's Householder QR of all rows at once, with the signs of ours.
fn direct(y: &Matrix, b: &[f64]) -> Factor {
    let (n, p) = (y.rows(), y.cols());
    let qr = DMatrix::from_column_slice(n, p, y.as_slice()).qr();
    let mut rhs = DVector::from_column_slice(b);
    qr.q_tr_mul(&mut rhs);
    let r = qr.r();
    let sign = |i: usize| if r[(i, i)] < 0.0 { -1.0 } else { 1.0 };
    Factor {
        r: Matrix::from_fn(p, p, |i, j| sign(i) * r[(i, j)]),
        z: (0..p).map(|i| sign(i) * rhs[i]).collect(),
        rho2: rhs.rows(p, n - p).norm_squared(),
        rows: n,
    }
}

#[test]
fn equals_a_direct_qr() {
    let mut noise = Noise::new(1);
    for (n, p) in [(5, 3), (BLOCK, 4), (BLOCK + 1, 1), (3000, 12), (517, 18)] {
        let (y, b) = (noise.matrix(n, p), noise.vector(n));
        let (ours, theirs) = (condensed(&y, &b), direct(&y, &b));
        let scale = (n as f64).sqrt();
        assert!(gap(ours.r.as_slice(), theirs.r.as_slice()) < ROUNDING * scale);
        assert!(gap(&ours.z, &theirs.z) < ROUNDING * scale);
        assert!((ours.rho2 - theirs.rho2).abs() < ROUNDING * n as f64);
        assert_eq!(ours.rows, n);
    }
}

/// At a condition number of 1e7 the Gram matrix keeps two digits; a QR factor keeps nine.
#[test]
fn keeps_the_precision_of_qr_at_condition_1e7() {
    let mut noise = Noise::new(2);
    let (n, p) = (2000, 6);
    let mut y = noise.matrix(n, p);
    for i in 0..n {
        y[(i, 3)] = y[(i, 0)] + 1e-7 * y[(i, 3)];
        y[(i, 5)] = y[(i, 1)] - y[(i, 2)] + 1e-6 * y[(i, 5)];
    }
    let truth = [1.0, -2.0, 0.5, 1.5, 3.0, -1.0];
    let b = y.times(&truth);
    let factor = condensed(&y, &b);
    let ours = factor.solve().expect("full rank in double precision");
    let theirs = direct(&y, &b).solve().expect("full rank");
    assert!(gap(&ours, &truth) < 2e-8, "{}", gap(&ours, &truth));
    assert!(gap(&theirs, &truth) < 2e-8);

    let a = DMatrix::from_column_slice(n, p, y.as_slice());
    let gram = (a.transpose() * &a).lu();
    let normal = gram
        .solve(&(a.transpose() * DVector::from_column_slice(&b)))
        .map_or(f64::INFINITY, |x| gap(x.as_slice(), &truth));
    assert!(normal > 1e-5, "the comparison shows nothing: {normal}");
}

#[test]
fn grouping_of_calls_does_not_change_a_bit() {
    let mut noise = Noise::new(3);
    let (y, b) = (noise.matrix(1000, 5), noise.vector(1000));
    let rows = row_major(&y);
    let whole = condensed(&y, &b);
    let mut single = Condenser::new(5);
    for (row, &b) in rows.chunks_exact(5).zip(&b) {
        single.push(row, b).expect("finite");
    }
    let mut pieces = Condenser::new(5);
    for (rows, b) in rows.chunks(5 * 77).zip(b.chunks(77)) {
        pieces.push_block(rows, b).expect("finite");
    }
    assert_eq!(single.finish(), whole);
    assert_eq!(pieces.finish(), whole);
}

#[test]
fn merging_equals_pushing_everything() {
    let mut noise = Noise::new(4);
    let (y, b) = (noise.matrix(900, 4), noise.vector(900));
    let rows = row_major(&y);
    let part = |from: usize, to: usize| {
        let mut condenser = Condenser::new(4);
        condenser
            .push_block(&rows[4 * from..4 * to], &b[from..to])
            .expect("finite");
        condenser
    };
    let mut merged = part(0, 711);
    merged
        .merge_factor(&part(711, 900).finish())
        .expect("same size");
    let (merged, whole) = (merged.finish(), condensed(&y, &b));
    assert!(gap(merged.r.as_slice(), whole.r.as_slice()) < ROUNDING);
    assert!(gap(&merged.z, &whole.z) < ROUNDING);
    assert!((merged.rho2 - whole.rho2).abs() < 900.0 * ROUNDING);
    assert_eq!(merged.rows, 900);
}

#[test]
fn pushing_does_not_allocate() {
    let mut noise = Noise::new(5);
    let (rows, b) = (noise.vector(12 * 1000), noise.vector(1000));
    let mut condenser = Condenser::new(12);
    let counted = allocation_counter::measure(|| {
        for (row, &b) in rows.chunks_exact(12).zip(&b) {
            condenser.push(row, b).expect("finite");
        }
        condenser.push_block(&rows, &b).expect("finite");
    });
    assert_eq!(counted.count_total, 0);
    assert_eq!(condenser.rows(), 2000);
}

#[test]
fn degenerate_problems_condense() {
    let empty = Condenser::new(3).finish();
    assert_eq!((empty.rows, empty.rho2), (0, 0.0));
    assert!(matches!(
        empty.solve(),
        Err(NumericsError::Rank {
            found: 0,
            expected: 3,
            ..
        })
    ));

    let mut without_parameters = Condenser::new(0);
    without_parameters
        .push_block(&[], &[3.0, 4.0])
        .expect("finite");
    assert!((without_parameters.finish().rho2 - 25.0).abs() < 1e-13);

    // Numbers whose squares underflow or nearly overflow.
    for size in [1e-200, 1e-139, 1e139] {
        let mut condenser = Condenser::new(1);
        for _ in 0..1000 {
            condenser.push(&[size], 2.0 * size).expect("acceptable");
        }
        let factor = condenser.finish();
        assert!(factor.r[(0, 0)].is_finite() && factor.rho2.is_finite());
        if size > 1e-150 {
            assert!((factor.solve().expect("one column")[0] - 2.0).abs() < 1e-13);
        }
    }
}

#[test]
fn refuses_bad_rows_and_keeps_its_state() {
    let mut condenser = Condenser::new(2);
    condenser.push(&[1.0, 2.0], 3.0).expect("finite");
    assert_eq!(
        condenser.push(&[1.0], 3.0),
        Err(NumericsError::Length {
            name: "row",
            found: 1,
            expected: 2
        })
    );
    for bad in [f64::NAN, f64::INFINITY, -LARGEST] {
        assert!(matches!(
            condenser.push(&[1.0, bad], 3.0),
            Err(NumericsError::NotFinite {
                name: "row",
                index: 1,
                ..
            })
        ));
        assert!(matches!(
            condenser.push(&[1.0, 1.0], bad),
            Err(NumericsError::NotFinite { name: "rhs", .. })
        ));
        let block = [1.0, 2.0, bad, 2.0, 1.0, 2.0];
        let mut partly = condenser.clone();
        let error = partly.push_block(&block, &[0.0; 3]);
        assert!(matches!(
            error,
            Err(NumericsError::NotFinite { index: 2, .. })
        ));
        assert_eq!(partly.rows(), 2);
    }
    assert!(condenser.push_block(&[1.0; 3], &[1.0; 2]).is_err());
    assert!(condenser.merge_factor(&Condenser::new(3).finish()).is_err());
    assert_eq!(condenser.rows(), 1);
    let message = condenser
        .push(&[1.0, f64::NAN], 0.0)
        .expect_err("NaN")
        .to_string();
    assert_eq!(
        message,
        "row holds NaN at index 1, expected a finite number"
    );
}

/// A partly filled panel gives the factor of its rows pushed one by one. Values beyond its rows, and refused panels, have no effect.
#[test]
fn part_of_a_panel_is_its_rows() {
    let mut noise = Noise::new(8);
    let (y, b) = (noise.matrix(BLOCK + 37, 3), noise.vector(BLOCK + 37));
    let one_by_one = condensed(&y, &b);
    let mut condenser = Condenser::new(3);
    let write = |panel: &mut [Column], first: usize| {
        for (j, column) in panel.iter_mut().enumerate() {
            for (i, value) in column.0.iter_mut().enumerate() {
                let row = first + i;
                *value = match (row < b.len(), j) {
                    (false, _) => f64::NAN,
                    (true, 3) => b[row],
                    (true, _) => y[(row, j)],
                };
            }
        }
    };
    condenser
        .push_panel(BLOCK, |panel| write(panel, 0))
        .expect("finite numbers");
    let refused = condenser.push_panel(38, |panel| write(panel, BLOCK));
    assert!(matches!(
        refused,
        Err(NumericsError::NotFinite { index: BLOCK, .. })
    ));
    condenser
        .push_panel(30, |panel| write(panel, BLOCK))
        .expect("finite numbers");
    for row in BLOCK + 30..BLOCK + 37 {
        let values = [0, 1, 2].map(|j| y[(row, j)]);
        condenser.push(&values, b[row]).expect("finite numbers");
    }
    assert_eq!(condenser.finish(), one_by_one);
}
