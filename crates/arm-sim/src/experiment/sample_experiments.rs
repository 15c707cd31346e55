//! Documented sample experiments for tests, benchmarks and examples.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Joints, Robot, Setup, Shape, sample_arms};

use crate::{Coupling, Drive, Experiment, HandlePath, Movement, SimulationError, Start};

/// Contact stiffness of the thesis (table after 4.10), both directions \[N/m\].
pub const STIFFNESS: f64 = 10_000.0;
/// Joint viscosity, with the sign that damps \[N m s/rad\].
pub const VISCOSITY: f64 = 0.2;
/// Joint stiffness \[N m/rad\].
pub const ELASTICITY: f64 = 0.5;

/// The robot of the thesis: two links of 0.45 m, in front of the arm.
///
/// # Errors
/// None for these values.
pub fn robot() -> Result<Robot<f64>, SimulationError> {
    Ok(Robot::new([0.45, 0.45], [1.05, -0.10], Elbow::Up)?)
}

/// The upper extremity of table 4.10 led along the forward kinematics of `(−68 + 12 s, 40 + 40 s, 5 s)°`, where s goes from
/// 0 to 1 and back with trapezoidal speed; viscosity and elasticity about `rest` in every joint; contact without damping.
///
/// # Errors
/// [`SimulationError`] for a duration that is not positive.
pub fn human_experiment(duration: f64, rest: [f64; 3]) -> Result<Experiment<3>, SimulationError> {
    let (from, to) = ([-68.0, 40.0, 0.0], [-56.0, 80.0, 5.0]);
    led(
        sample_arms::human_arm(),
        Shape::Trapezoid,
        (from, to),
        duration,
        rest,
    )
}

/// The mechanical arm of table 4.9, led from (−60, 50)° to (−40, 80)° and back in the same way.
///
/// # Errors
/// As [`human_experiment`].
pub fn mechanical_experiment(
    duration: f64,
    rest: [f64; 2],
) -> Result<Experiment<2>, SimulationError> {
    let (from, to) = ([-60.0, 50.0], [-40.0, 80.0]);
    led(
        sample_arms::mechanical_arm(),
        Shape::Trapezoid,
        (from, to),
        duration,
        rest,
    )
}

/// Any arm led there and back between two poses \[°\], in equilibrium at the start.
///
/// # Errors
/// As [`human_experiment`].
pub fn led<const N: usize>(
    arm: Chain<f64, N>,
    shape: Shape,
    (from, to): ([f64; N], [f64; N]),
    duration: f64,
    rest: [f64; N],
) -> Result<Experiment<N>, SimulationError> {
    let [from, to] = [from, to].map(|q| Joints::from(q.map(f64::to_radians)));
    let half = 0.5 * duration;
    let movement = Movement::timed(shape, &[from, to, from], &[half, half], 0.1)?;
    let setup = Setup::new(&arm, Contact::new([STIFFNESS; 2], [0.0; 2]));
    let drive = Drive::Handle {
        path: HandlePath::of_arm(arm, movement),
        coupling: Coupling::Compliant,
    };
    let mut experiment = Experiment::new(setup, drive, duration);
    experiment.start = Start::Equilibrium { near: from };
    for (joint, rest) in rest.into_iter().enumerate() {
        experiment.effects.extend([
            Effect::new(Kind::Viscous, joint).with(&[VISCOSITY]),
            Effect::new(Kind::Elastic, joint).with(&[ELASTICITY, rest]),
        ]);
    }
    Ok(experiment)
}

/// The run whose digest represents the bits of the simulator: two seconds of the human arm with a robot, damped contact and
/// effects of every kind that a run computes differently (friction with the hyperbolic tangent, exponential end stops,
/// states of their own, joint forces, a moving base, ripple).
///
/// # Errors
/// None for these values.
pub fn reference() -> Result<Experiment<3>, SimulationError> {
    let mut experiment = human_experiment(2.0, [-1.1, 0.9, 0.05])?;
    experiment.setup.contact.damping = [25.0; 2];
    experiment.robot = Some(robot()?);
    experiment.output_interval = Some(0.02);
    experiment.effects.extend([
        Effect::new(Kind::Coulomb, 1).with(&[0.161, 0.01]),
        Effect::new(Kind::Stribeck, 0).with(&[0.1]),
        Effect::new(Kind::LoadFriction, 2).with(&[0.001, 0.05]),
        Effect::new(Kind::Relaxation, 0).with(&[2.0, 0.5]),
        Effect::new(Kind::Thixotropy, 1).with(&[0.05, 0.3]),
        Effect::new(Kind::EndRange, 1).with(&[1.0, 1.0, 8.0, 1.6, 0.2]),
        Effect::new(Kind::Biarticular, 2).with(&[0.4]),
        Effect::new(Kind::Tremor, 2).with(&[0.02, 6.0]),
        Effect::new(Kind::AddedMass, 0).with(&[0.277]),
        Effect::new(Kind::ShoulderMotion, 0).with(&[0.02, 0.01, -1.1]),
        Effect::new(Kind::RobotRipple, 0).with(&[2e-4, 1e-4, 3.0, 0.2]),
        Effect::new(Kind::Backlash, 0).with(&[2e-5, 1e-5]),
    ]);
    Ok(experiment)
}
