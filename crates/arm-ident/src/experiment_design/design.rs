//! Search for movements that determine the parameters well.
//!
//! The search is a (1+1) evolution strategy over waypoints with restarts (Rechenberg's rule
//! for its step), as trapezoids at two speeds come within a few percent of optimised Fourier series.

use crate::error::IdentError;
use crate::experiment_design::forecast::{Demand, MovementForecast, Question, Seen, Task, said};
use crate::movement_limits::{Excess, Limit};
use arm_core::{Joints, Shape};
use arm_numerics::NumericsError;
use arm_sim::Normal;

/// Step of the search at its start, in ranges of a joint.
const FIRST_STEP: f64 = 0.25;

/// Evaluations without progress after which the search restarts.
const PATIENCE: usize = 60;

/// Runs of a movement that is slowed until it respects the limits; the last is at the slowest pace.
const MOST_RUNS: usize = 8;

/// Target share of a limit: the motion that the compliant contact adds does not scale with the pace.
const AIM: f64 = 0.99;

/// The contact is compliant: the arm may be this much faster than the commanded movement.
const GIVING: f64 = 1.1;

/// Slowest pace, relative to the requested one: the forces that remain there hold the arm against gravity.
const LEAST_PACE: f64 = 0.1;

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

/// Movements within what is allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimizedDesign<const N: usize> {
    /// The movements.
    pub tasks: Vec<Task<N>>,
    /// Pace of each, relative to the requested one.
    pub paces: Vec<f64>,
    /// For each the limit that it was slowed for, and the value at the requested pace; `None` where it is as fast as requested.
    pub slowed_for: Vec<Option<Excess>>,
    /// Forecast of the estimates.
    pub forecast: MovementForecast,
}

/// Movements that make the worst relative standard deviation small.
///
/// A movement that would exceed a limit is slowed until it does not: all of it by the same factor, so that its path stays.
///
/// # Errors
/// [`IdentError::NoPlan`] when no movement tried respects what is allowed, however slow, [`IdentError`] as for [`forecast`](crate::experiment_design::forecast::forecast).
pub fn design<const N: usize>(
    question: &Question<N>,
    allowed: &Allowed<N>,
    mut tried: impl FnMut(),
) -> Result<OptimizedDesign<N>, IdentError> {
    let mut random = Normal::new(allowed.seed, 7);
    let mut best: Option<(f64, OptimizedDesign<N>)> = None;
    let mut current: Option<(f64, Vec<Task<N>>)> = None;
    let (mut step, mut failures) = (FIRST_STEP, 0);
    let mut refusal = IdentError::Numerics(NumericsError::TooFew {
        name: "evaluations",
        found: 0,
        expected: 1,
    });
    for _ in 0..allowed.evaluations {
        let candidate = match &current {
            Some((_, tasks)) => mutated(tasks, allowed, step, &mut random),
            None => drawn(allowed, &mut random),
        };
        tried();
        let found = match fitting(question, candidate, allowed) {
            Ok(design) => Some((score(&design.forecast), design)),
            Err(error) => {
                if excess(&error) <= excess(&refusal) {
                    refusal = error;
                }
                None
            }
        };
        let better = found
            .as_ref()
            .is_some_and(|(s, _)| current.as_ref().is_none_or(|(now, _)| s < now));
        if let (true, Some((score, design))) = (better, found) {
            current = Some((score, design.tasks.clone()));
            if best.as_ref().is_none_or(|(b, _)| score < *b) {
                best = Some((score, design));
            }
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
        Some((_, design)) => Ok(design),
        None => Err(match refusal {
            IdentError::NoPlan { nearest, .. } => IdentError::NoPlan {
                evaluations: allowed.evaluations,
                nearest,
            },
            other => other,
        }),
    }
}

/// By how much a refused movement exceeds a limit; infinite if it was not refused by a limit.
fn excess(error: &IdentError) -> f64 {
    match error {
        IdentError::NoPlan { nearest, .. } => nearest.found / nearest.allowed,
        _ => f64::INFINITY,
    }
}

/// The worst counts; the others break ties.
fn score(forecast: &MovementForecast) -> f64 {
    let logs = forecast
        .predicted
        .iter()
        .map(|p| libm::log(p.relative().max(1e-12)));
    let mean = logs.sum::<f64>() / forecast.predicted.len() as f64;
    libm::log(forecast.worst().max(1e-12)) + 0.2 * mean
}

/// The movements, slowed where they would exceed a limit, and their forecast.
fn fitting<const N: usize>(
    question: &Question<N>,
    tasks: Vec<Task<N>>,
    allowed: &Allowed<N>,
) -> Result<OptimizedDesign<N>, IdentError> {
    let (mut slow, mut seen) = (Vec::new(), Vec::new());
    let (mut paces, mut slowed_for) = (Vec::new(), Vec::new());
    for task in tasks {
        let found = slowed(question, task, allowed)?;
        slow.push(found.task);
        seen.push(found.seen);
        paces.push(found.pace);
        slowed_for.push(found.slowed_for);
    }
    Ok(OptimizedDesign {
        forecast: said(question, &slow, &seen)?,
        tasks: slow,
        paces,
        slowed_for,
    })
}

/// A movement within the limits.
struct Slowed<const N: usize> {
    task: Task<N>,
    seen: Seen<N>,
    pace: f64,
    slowed_for: Option<Excess>,
}

/// A movement at the requested pace or, where that would exceed a limit, as fast as is allowed.
fn slowed<const N: usize>(
    question: &Question<N>,
    requested: Task<N>,
    allowed: &Allowed<N>,
) -> Result<Slowed<N>, IdentError> {
    let (mut pace, mut least) = (1.0, LEAST_PACE);
    let mut first: Option<Demand> = None;
    // Pace and force of the run before.
    let mut before: Option<[f64; 2]> = None;
    let mut slowed_for = None;
    let mut runs = 0;
    loop {
        let task = Task {
            speed: pace * requested.speed,
            acceleration: pace * pace * requested.acceleration,
            ..requested.clone()
        };
        let seen = Seen::of(question, &task)?;
        let found = seen.demand;
        runs += 1;
        if first.is_none() {
            // A trial ends with a sample.
            least = (found.duration / (allowed.duration - 1.0 / question.accuracy.rate).max(0.0))
                .max(LEAST_PACE);
        }
        let fastest = *first.get_or_insert(found);
        if let Some(nearest) = exceeded(&found, allowed, Limit::Duration, pace) {
            return Err(refused(nearest));
        }
        let Some((excess, share)) = tightest(&found, allowed, (pace, before)) else {
            return Ok(Slowed {
                task,
                seen,
                pace,
                slowed_for,
            });
        };
        if pace <= least {
            return Err(refused(excess));
        }
        // The limit that needs the slowest pace counts.
        slowed_for = exceeded(&fastest, allowed, excess.limit, 1.0).or(slowed_for);
        before = Some([pace, found.force]);
        pace = if runs + 1 == MOST_RUNS {
            least
        } else {
            (share * pace).min(AIM * pace).max(least)
        };
    }
}

const fn refused(nearest: Excess) -> IdentError {
    IdentError::NoPlan {
        evaluations: 1,
        nearest,
    }
}

/// By how much a movement exceeds a limit; `None` where it does not.
fn exceeded<const N: usize>(
    demand: &Demand,
    allowed: &Allowed<N>,
    limit: Limit,
    pace: f64,
) -> Option<Excess> {
    let (found, most) = match limit {
        Limit::Force => (demand.force, allowed.force),
        Limit::Speed => (demand.speed, allowed.speed),
        Limit::RobotSpeed => (demand.robot_speed, allowed.robot_speed),
        Limit::RobotAcceleration => (demand.robot_acceleration, allowed.robot_acceleration),
        Limit::Duration => (demand.duration, allowed.duration),
    };
    let giving = if limit == Limit::Speed { GIVING } else { 1.0 };
    (found > giving * most).then_some(Excess {
        limit,
        found,
        pace,
        allowed: most,
    })
}

/// The limit that needs the slowest movement, and the share of the pace at which it is expected to be respected.
fn tightest<const N: usize>(
    found: &Demand,
    allowed: &Allowed<N>,
    (pace, before): (f64, Option<[f64; 2]>),
) -> Option<(Excess, f64)> {
    let share = |excess: &Excess| {
        let aimed = AIM * excess.allowed / excess.found;
        match (excess.limit, before) {
            // With speed squared at first, then along the line through two runs: forces that grow ever faster are met from above.
            (Limit::Force, Some([other, force])) if force > excess.found => {
                let slope = (force - excess.found) / (other - pace);
                1.0 - (1.0 - aimed) * excess.found / (slope * pace)
            }
            (Limit::Force | Limit::RobotAcceleration, _) => libm::sqrt(aimed),
            (Limit::Speed, _) => GIVING * aimed,
            (Limit::RobotSpeed | Limit::Duration, _) => aimed,
        }
    };
    [
        Limit::Force,
        Limit::Speed,
        Limit::RobotSpeed,
        Limit::RobotAcceleration,
    ]
    .into_iter()
    .filter_map(|limit| exceeded(found, allowed, limit, pace))
    .map(|excess| (excess, share(&excess)))
    .min_by(|a, b| a.1.total_cmp(&b.1))
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
