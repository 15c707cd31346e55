//! The streamed cascade on static samples of a known arm, which a force at the tip holds.

use super::noise::Noise;
use super::synthetic::wrong;
use arm_core::{Chain, Joints, Plane, Pose, gravity, jacobian, sample_arms};
use arm_ident::cascade::quasi_static::Stream;

const SAMPLES: usize = 3000;

/// Poses of a bent arm at rest, and the force at the tip that holds it: `F = J⁻ᵀ G`.
fn samples(chain: &Chain<f64, 2>) -> (Vec<Joints<f64, 2>>, Vec<Plane<f64>>) {
    let mut noise = Noise::new(7);
    (0..SAMPLES)
        .map(|_| {
            let q = Joints::from([-0.6 + 0.3 * noise.normal(), 1.1 + 0.2 * noise.normal()]);
            let pose = Pose::new(&q);
            let inverse = jacobian(chain, &pose).transpose().try_inverse();
            let force = inverse.expect("the arm is bent") * gravity(chain, &pose);
            (q, [force[0], force[1]])
        })
        .unzip()
}

#[test]
fn the_stream_finds_the_first_moments_from_a_wrong_start() {
    let truth = sample_arms::mechanical_arm();
    let (q, force) = samples(&truth);
    let model = wrong(&truth, [[1.1, 0.95, 1.0], [0.92, 1.06, 1.0]], 0.1);
    let mut stream = Stream::new(&model.chain);
    stream.push(&q, &force).expect("finite samples");
    let condensed = stream.finish().expect("finite samples");
    assert_eq!(condensed.samples(), SAMPLES);
    let found = condensed.solve(&model, 3.0).expect("a solution");
    for (found, truth) in found.first_moments.iter().zip(truth.first_moments()) {
        assert!((found - truth).abs() < 1e-6 * truth, "{found}, not {truth}");
    }
    assert!(found.residual_rms.iter().all(|&rms| rms < 1e-6));
}

#[test]
fn the_stream_is_the_same_however_it_is_cut() {
    let truth = sample_arms::mechanical_arm();
    let (q, force) = samples(&truth);
    let model = wrong(&truth, [[1.1, 0.95, 1.0], [0.92, 1.06, 1.0]], 0.1);
    let solve = |cut: usize| {
        let mut stream = Stream::new(&model.chain);
        for (q, force) in q.chunks(cut).zip(force.chunks(cut)) {
            stream.push(q, force).expect("finite samples");
        }
        let condensed = stream.finish().expect("finite samples");
        condensed.solve(&model, 3.0).expect("a solution")
    };
    let (whole, pieces) = (solve(SAMPLES), solve(37));
    for (a, b) in whole.first_moments.iter().zip(&pieces.first_moments) {
        assert_eq!(a.to_bits(), b.to_bits(), "{a} and {b}");
    }
}

#[test]
fn a_bad_sample_is_named_and_those_before_it_stand() {
    let truth = sample_arms::mechanical_arm();
    let (mut q, mut force) = samples(&truth);
    let model = wrong(&truth, [[1.1, 0.95, 1.0], [0.92, 1.06, 1.0]], 0.1);
    let solve = |stream: Stream<2>| {
        let condensed = stream.finish().expect("finite samples");
        condensed.solve(&model, 3.0).expect("a solution")
    };
    let mut good = Stream::new(&model.chain);
    good.push(&q[..SAMPLES - 100], &force[..SAMPLES - 100])
        .expect("finite samples");
    let good = solve(good);
    force[SAMPLES - 100][1] = f64::NAN;
    let mut stream = Stream::new(&model.chain);
    let error = stream
        .push(&q, &force)
        .expect_err("a force is not a number");
    assert!(
        error.to_string().contains(&(SAMPLES - 100).to_string()),
        "{error}"
    );
    assert_eq!(solve(stream), good);
    q[5][0] = 1e150;
    let mut stream = Stream::new(&model.chain);
    let error = stream.push(&q, &force).expect_err("an angle is too large");
    assert!(error.to_string().contains('5'), "{error}");
}

#[test]
fn blocks_that_are_full_leave_nothing_to_the_end() {
    let truth = sample_arms::mechanical_arm();
    let (q, force) = samples(&truth);
    let mut stream = Stream::new(&truth);
    stream
        .push(&q[..256], &force[..256])
        .expect("finite samples");
    assert_eq!(stream.finish().expect("finite samples").samples(), 256);
}
