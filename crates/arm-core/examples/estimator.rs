//! Identification while the arm moves: an arm that is 8 % lighter than it was taken for.

use arm_core::effect::Motion;
use arm_core::estimator::{Estimator, Sample, Settings};
use arm_core::{Equation, Invalid, Joints, Measured, sample_arms};

fn main() -> Result<(), Invalid> {
    // Two segments, no effects: four unknowns.
    let arm = Equation::<f64, 2, 4, 0>::new(sample_arms::mechanical_arm(), [])?;
    let mut priors = arm.priors(0.1);
    for prior in &mut priors {
        prior.mean *= 1.08;
    }
    let settings = Settings::new(arm.chain(), 1e-3);
    let mut estimator = Estimator::new(arm, priors, &settings)?;
    let truth = arm.priors(0.1).map(|p| p.mean);
    for k in 0..10_000 {
        let t = f64::from(k) * 1e-3;
        let wave = |w: f64| {
            [
                libm::sin(w * t),
                w * libm::cos(w * t),
                -w * w * libm::sin(w * t),
            ]
        };
        let (a, b) = (wave(1.7), wave(2.9));
        let mut motion = Motion::new(t, Joints::from([a[0], b[0]]), Joints::from([a[1], b[1]]));
        motion.qdd = Joints::from([a[2], b[2]]);
        let nothing = Measured {
            torque: Joints::zeros(),
            force_on_arm: [0.0; 2],
            moment_on_arm: 0.0,
        };
        let (rows, _) = arm.needed(&motion, &[], &nothing);
        let measured = Measured {
            torque: rows.torque(&truth),
            ..nothing
        };
        estimator.update(Some(&Sample {
            q: motion.q,
            lead: None,
            measured,
        }));
    }
    for (estimate, value) in estimator.estimates().iter().zip(truth) {
        println!(
            "{:.4} ± {:.4}, in truth {value:.4}",
            estimate.value, estimate.sd
        );
    }
    println!("{:?}", estimator.health());
    Ok(())
}
