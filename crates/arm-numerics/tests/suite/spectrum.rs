use core::f64::consts::TAU;

use arm_numerics::signal::spectrum::{Sum, line};

#[test]
fn a_line_is_found_between_the_points_of_the_grid() {
    let frequency = 6.10173;
    let at = |i: i32| {
        let noise = libm::sin(f64::from(i * i % 4001)) + libm::sin(f64::from(i * 37 % 991));
        libm::sin(TAU * frequency * f64::from(i) / 50.0 + 0.3) + 0.2 * noise
    };
    let trial = vec![(0..600).map(at).collect::<Vec<f64>>()];
    for sum in [Sum::Powers, Sum::Swings] {
        let found = line(&[&trial, &trial, &trial], 50.0, 2.0, sum).expect("a line");
        // The grid has steps of 4 mHz: at its points the swing would be out of phase by 0.08 rad at the ends.
        assert!((found - frequency).abs() < 4e-4, "{found}");
    }
}
