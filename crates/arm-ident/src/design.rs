//! Before an experiment: a movement that shows the parameters well.
//!
//! The search is a (1+1) evolution strategy over waypoints with restarts (Rechenberg's rule
//! for its step), for trapezoids at two speeds come within a few percent of optimised Fourier series.

use arm_core::{Joints, Shape};
use arm_sim::Normal;

use crate::error::IdentError;
use crate::forecast::{Forecast, Question, Task, forecast};

/// Step of the search at its start, in ranges of a joint.
const FIRST_STEP: f64 = 0.25;
/// Evaluations after which a search that gets nowhere starts anew.
const PATIENCE: usize = 60;

/// What a plan must respect, and how long to search.
#[derive(Clone, Debug, PartialEq)]
pub struct Allowed<const N: usize> {
    /// Range of each joint \[rad\].
    pub angle: [[f64; 2]; N],
    /// Fastest movement: largest speed of a joint \[rad/s\].
    pub speed: f64,
    /// Largest acceleration of a joint \[rad/s²\].
    pub acceleration: f64,
    /// Largest speed of a joint of the robot \[rad/s\].
    pub robot_speed: f64,
    /// Largest acceleration of a joint of the robot \[rad/s²\].
    pub robot_acceleration: f64,
    /// Largest force on the arm \[N\].
    pub force: f64,
    /// Longest trial \[s\].
    pub duration: f64,
    /// Speeds of the movements, relative to the fastest.
    pub speeds: Vec<f64>,
    /// Waypoints of a movement, besides the return to the first.
    pub waypoints: usize,
    /// Trials of each movement.
    pub repeats: usize,
    /// Forecasts that may be made.
    pub evaluations: usize,
    /// Of the search.
    pub seed: u64,
}

/// Movements that make the worst relative standard deviation small.
///
/// # Errors
/// [`IdentError::NoPlan`] when no movement tried respects what is allowed, [`IdentError`] as for [`forecast`].
pub fn design<const N: usize>(
    question: &Question<N>,
    allowed: &Allowed<N>,
    mut tried: impl FnMut(),
) -> Result<(Vec<Task<N>>, Forecast), IdentError> {
    let mut random = Normal::new(allowed.seed, 7);
    let mut best: Option<(f64, Vec<Task<N>>, Forecast)> = None;
    let mut current: Option<(f64, Vec<Task<N>>)> = None;
    let (mut step, mut failures) = (FIRST_STEP, 0);
    let mut refusal = IdentError::NoPlan { evaluations: 0 };
    for _ in 0..allowed.evaluations {
        let candidate = match &current {
            Some((_, tasks)) => mutated(tasks, allowed, step, &mut random),
            None => drawn(allowed, &mut random),
        };
        tried();
        let outcome = forecast(question, &candidate);
        let found = match outcome {
            Ok(forecast) if respects(&forecast, allowed) => Some((score(&forecast), forecast)),
            Ok(_) => None,
            Err(error) => {
                refusal = error;
                None
            }
        };
        let better = found
            .as_ref()
            .is_some_and(|(s, _)| current.as_ref().is_none_or(|(now, _)| s < now));
        if let (true, Some((score, forecast))) = (better, found) {
            if best.as_ref().is_none_or(|(b, _, _)| score < *b) {
                best = Some((score, candidate.clone(), forecast));
            }
            current = Some((score, candidate));
            // One success in five keeps the step.
            step = (step * 1.5).min(0.5);
            failures = 0;
        } else if current.is_some() {
            step = (step * 0.9).max(0.01);
            failures += 1;
            if failures >= PATIENCE {
                (current, step, failures) = (None, FIRST_STEP, 0);
            }
        }
    }
    match best {
        Some((_, tasks, forecast)) => Ok((tasks, forecast)),
        None => Err(match refusal {
            IdentError::NoPlan { .. } => IdentError::NoPlan {
                evaluations: allowed.evaluations,
            },
            other => other,
        }),
    }
}

/// The worst counts; the others break ties.
fn score(forecast: &Forecast) -> f64 {
    let logs = forecast
        .predicted
        .iter()
        .map(|p| libm::log(p.relative().max(1e-12)));
    let mean = logs.sum::<f64>() / forecast.predicted.len() as f64;
    libm::log(forecast.worst().max(1e-12)) + 0.2 * mean
}

fn respects<const N: usize>(forecast: &Forecast, allowed: &Allowed<N>) -> bool {
    // The contact gives way: the arm may be a little faster than it is led.
    forecast.force <= allowed.force
        && forecast.speed <= 1.1 * allowed.speed
        && forecast.robot_speed <= allowed.robot_speed
        && forecast.robot_acceleration <= allowed.robot_acceleration
        && forecast.durations.iter().all(|&d| d <= allowed.duration)
}

fn task<const N: usize>(
    mut waypoints: Vec<Joints<f64, N>>,
    relative: f64,
    allowed: &Allowed<N>,
) -> Task<N> {
    waypoints.extend(waypoints.first().copied());
    Task {
        waypoints,
        speed: relative * allowed.speed,
        acceleration: relative * allowed.acceleration,
        shape: Shape::Smooth,
        pause: 0.0,
        repeats: allowed.repeats,
    }
}

/// A number between 0 and 1 that is uniform enough.
fn share(random: &mut Normal) -> f64 {
    let x = random.next();
    0.5 * (1.0 + libm::erf(x / core::f64::consts::SQRT_2))
}

fn drawn<const N: usize>(allowed: &Allowed<N>, random: &mut Normal) -> Vec<Task<N>> {
    let mut one = |relative: &f64| {
        let waypoints = (0..allowed.waypoints)
            .map(|_| {
                Joints::from_fn(|j, _| {
                    let [low, high] = allowed.angle[j];
                    low + share(random) * (high - low)
                })
            })
            .collect();
        task(waypoints, *relative, allowed)
    };
    allowed.speeds.iter().map(&mut one).collect()
}

fn mutated<const N: usize>(
    tasks: &[Task<N>],
    allowed: &Allowed<N>,
    step: f64,
    random: &mut Normal,
) -> Vec<Task<N>> {
    tasks
        .iter()
        .zip(&allowed.speeds)
        .map(|(old, &relative)| {
            let own = &old.waypoints[..old.waypoints.len() - 1];
            let moved = own
                .iter()
                .map(|q| {
                    let touched = share(random) < 0.5;
                    Joints::from_fn(|j, _| {
                        let [low, high] = allowed.angle[j];
                        let by = step * (high - low) * random.next();
                        if touched {
                            (q[j] + by).clamp(low, high)
                        } else {
                            q[j]
                        }
                    })
                })
                .collect();
            task(moved, relative, allowed)
        })
        .collect()
}
