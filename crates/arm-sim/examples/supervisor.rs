//! How often the supervisor stops a robot that does nothing wrong, and how soon one that does.
//!
//! `cargo run --release -p arm-sim --example supervisor -- 1000`

use arm_core::Shape;
use arm_sim::{
    Controller, Experiment, InjectedFault, Safety, SimulationError, control, sample_experiments,
};

/// Movements of different reach and speed, of arms with two and three segments in turn.
fn run(
    number: u64,
    fault: Option<(f64, InjectedFault)>,
) -> Result<(bool, Option<u64>, f64), SimulationError> {
    let share = |k: u64| ((number * 2_654_435_761 + k * 40_503) % 1000) as f64 / 1000.0;
    let duration = 2.0 + 6.0 * share(1);
    let (a, b) = (10.0 + 20.0 * share(2), 20.0 + 30.0 * share(3));
    let settings = (&Controller::default(), &Safety::default());
    let robot = sample_experiments::robot()?;
    let done = if number.is_multiple_of(2) {
        let ends = ([-60.0, 50.0], [-60.0 + a, 50.0 + b]);
        let arm = arm_core::sample_arms::mechanical_arm();
        let mut e: Experiment<2> =
            sample_experiments::led(arm, Shape::Smooth, ends, duration, [0.0; 2])?;
        e.robot = Some(robot);
        control(&e, settings, fault, number)?
    } else {
        let ends = ([-68.0, 40.0, 0.0], [-68.0 + a, 40.0 + b, 5.0]);
        let arm = arm_core::sample_arms::human_arm();
        let rest = [-1.1, 0.9, 0.05];
        let mut e: Experiment<3> =
            sample_experiments::led(arm, Shape::Trapezoid, ends, duration, rest)?;
        e.robot = Some(robot);
        control(&e, settings, fault, number)?
    };
    Ok((
        done.stop.is_some(),
        done.periods_to_stop,
        done.force_after_fault,
    ))
}

fn main() -> Result<(), SimulationError> {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|n| n.parse().ok())
        .unwrap_or(1000);
    let mut stopped = 0;
    for number in 0..runs {
        stopped += u64::from(run(number, None)?.0);
    }
    println!("{stopped} of {runs} clean runs were stopped");
    let faults = [
        InjectedFault::Runaway(0),
        InjectedFault::Runaway(1),
        InjectedFault::Frozen(0),
        InjectedFault::Frozen(1),
        InjectedFault::NotANumber(0),
        InjectedFault::NotANumber(1),
        InjectedFault::Late(1e-3),
        InjectedFault::Pressed([150.0, 0.0]),
        InjectedFault::Pressed([0.0, -150.0]),
    ];
    for fault in faults {
        let (mut seen, mut latest, mut force) = (0, 0, 0.0_f64);
        for number in 0..runs / 10 {
            // A fifth of the way: both joints of the robot move.
            let (_, periods, most) = run(number, Some((0.5 + 1e-4 * (number % 7) as f64, fault)))?;
            seen += u64::from(periods.is_some());
            latest = latest.max(periods.unwrap_or(u64::MAX));
            force = force.max(most);
        }
        println!(
            "{fault:?}: {seen} of {} stopped, {latest} periods at most, force on the arm up to {force:.0} N",
            runs / 10
        );
    }
    Ok(())
}
