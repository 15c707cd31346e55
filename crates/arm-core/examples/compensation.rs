//! The torque that carries an arm whose first moments are known to 3 %, with its standard deviation.

use arm_core::effect::Motion;
use arm_core::{Compensation, Equation, Invalid, Joints, sample_arms};

fn main() -> Result<(), Invalid> {
    let arm = Equation::<f64, 3, 6, 0>::new(sample_arms::human_arm(), [])?;
    let values = arm.priors(0.05).map(|p| p.mean);
    let mut covariance = [[0.0; 6]; 6];
    for i in 0..3 {
        covariance[i][i] = (0.03 * values[i]) * (0.03 * values[i]);
    }
    let carry = Compensation::new(arm, values, &covariance)?;
    for degrees in [-90.0_f64, -45.0, 0.0] {
        let q = Joints::from([degrees.to_radians(), 0.0, 0.0]);
        let found = carry.carry(&Motion::new(0.0, q, Joints::zeros()), &[]);
        println!(
            "{degrees:4}°: {:.2} ± {:.2} N m at the shoulder",
            found.torque[0], found.sd[0]
        );
    }
    Ok(())
}
