//! The same input gives the same bits on every platform, in debug and release.

use crate::noise::Noise;
use arm_numerics::least_squares::program::{Cone, Program};
use arm_numerics::linalg::svd::Svd;
use arm_numerics::signal::filter::Butterworth;
use arm_numerics::statistics::autoregressive::{AutoRegression, effective_samples};
use arm_numerics::statistics::distributions::student_t_quantile;
use arm_numerics::{Condenser, Factor, Matrix};

/// Digest of everything below. A difference means that an order of operations, a dependency or a platform's rounding has changed, and with it every result of
/// this crate in its last digits. If that was intended, put the digest of the failure here in a commit of its own that says why.
const DIGEST: u64 = 0x9c79_8dbc_6be1_5074;

/// FNV-1a over the bytes of the bits.
fn mix(digest: u64, values: &[f64]) -> u64 {
    values
        .iter()
        .flat_map(|v| v.to_bits().to_le_bytes())
        .fold(digest, |h, byte| {
            (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

#[test]
fn digest_of_every_part() {
    let mut noise = Noise::new(101);
    let mut digest = 0xcbf2_9ce4_8422_2325;

    let mut condenser = Condenser::new(6);
    for _ in 0..1000 {
        let row = noise.vector(6);
        condenser.push(&row, noise.normal()).expect("finite");
    }
    let factor = condenser.finish();
    digest = mix(digest, factor.r.as_slice());
    digest = mix(digest, &factor.z);
    digest = mix(digest, &[factor.rho2]);

    let svd = Svd::of(factor.r.clone());
    digest = mix(digest, &svd.sigma);
    digest = mix(digest, svd.v.as_slice());

    let bounded = Program::of(&factor).and_then(|p| p.bounds(&[0.0; 6], &[0.02; 6]));
    let ball = Cone {
        a: Matrix::identity(6),
        b: vec![0.0; 6],
        c: vec![0.0; 6],
        d: 0.03,
    };
    let cone = bounded.clone().and_then(|p| p.cone(ball.clone()));
    let grade = [1.0, 1e-3, 1e-5, 1e-7, 1.0, 1.0];
    let graded = Factor {
        r: factor.r.scaled_columns(&grade),
        ..factor.clone()
    };
    let epigraph =
        Program::of(&graded).and_then(|p| p.scale(&[1.0; 6])?.bounds(&[-1.0; 6], &[0.01; 6]));
    for program in [bounded, cone, epigraph] {
        let outcome = program.and_then(|p| p.solve()).expect("accepted");
        assert!(outcome.iterations > 0, "the solver must be part of this");
        digest = mix(digest, &outcome.x);
    }

    let slow = noise.slow(0.9, 500);
    let filter = Butterworth::low_pass(5, 4.0, 50.0).expect("in range");
    digest = mix(digest, &filter.both_ways(&slow).expect("long enough"));
    let model = AutoRegression::selected_about_zero(&[&slow], &[], 4).expect("long enough");
    digest = mix(digest, &model.coefficients);
    digest = mix(digest, &[effective_samples(&slow).expect("long enough")]);
    for (probability, dof) in [(0.975, 9.0), (0.9, 2.5), (0.999, 400.0)] {
        digest = mix(
            digest,
            &[student_t_quantile(probability, dof).expect("in range")],
        );
    }
    assert_eq!(digest, DIGEST, "digest is now {digest:#x}");
}
