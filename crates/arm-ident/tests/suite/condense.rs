//! Placeholder of the first commit: the line of three points.

use arm_ident::Factor;
use arm_ident::Matrix;

#[test]
fn three_points_on_a_line() {
    let y = Matrix::from_row_major(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]).expect("six numbers");
    let x = Factor::of(&y, &[1.0, 3.0, 5.0])
        .and_then(|f| f.solve())
        .expect("full rank");
    assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
}
