//! Runs with angles of a stated accuracy: comparison of runs determines the step.
//!
//! On a uniform grid the error of the fourth-order method is `C hᵖ` at every sample, so that two runs with steps h and r h differ
//! by `(rᵖ − 1)` times the error of the finer one (Richardson 1911). The order p is 4 where all is smooth. Where something is not (dry
//! friction, play, effects that are not linear), a run is compared with the two before it, and p is taken as 1: two runs may agree by
//! chance while a reflex or a bound is crossed earlier in one. Every decision follows from bits of the runs, so that the step is the
//! same everywhere.

use std::ops::ControlFlow;

use arm_core::Joints;

use crate::closed_chain::model::Link;
use crate::closed_chain::stability::Vibration;
use crate::preparation::prepared_run::model_of;
use crate::{
    Columns, Coupling, Drive, Engine, Experiment, Integrator, Recording, SimulationError, Start,
    simulate_batch, simulate_in_pieces,
};

/// Order of the integrator.
const ORDER: f64 = 4.0;
/// The first step, as a fraction of the largest that is stable.
const FIRST: f64 = 0.5;
/// Share of the accuracy that the predicted error of the next step may reach.
const AIM: f64 = 0.7;
/// How much finer the next run is, at least and at most: a smaller ratio gives a poor estimate of the error.
const FINER: (f64, f64) = (1.5, 8.0);
/// Shortest step that is tried \[s\].
const SHORTEST: f64 = 1e-6;
/// Samples after which [`resolve`] checks for an interrupt: with the shortest step, half a second at 50 Hz.
const PIECE: usize = 64;

/// The step of a run, and how far its angles are from those of an ever finer one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolved {
    /// Step \[s\]: the interval from sample to sample, divided by a whole number.
    pub dt: f64,
    /// Largest error of a recorded angle, as estimated from a coarser run \[rad\].
    pub error: f64,
}

/// Simulates experiments with the native engine so that recorded angles are right to an accuracy \[rad\]; `dt` and the integrator of
/// the experiments do not matter.
///
/// * `threads` - as of [`simulate_batch`]; no result depends on it
///
/// # Errors
/// [`SimulationError::Accuracy`] where the accuracy is not reached; [`SimulationError::Setting`] for an accuracy that is not positive or
/// experiments that are recorded at every step; else as [`simulate`](crate::simulate).
///
/// ```
/// use arm_sim::{sample_experiments, simulate_accurately};
/// let mut experiment = sample_experiments::human_experiment(2.0, [0.0; 3])?;
/// experiment.output_interval = Some(0.02);
/// let (recording, resolved) = simulate_accurately(&[experiment], 1e-6, 1).remove(0)?;
/// assert!(resolved.error <= 1e-6 && resolved.dt > 1e-3);
/// assert_eq!(recording.time.len(), 101);
/// # Ok::<(), arm_sim::SimulationError>(())
/// ```
pub fn simulate_accurately<const N: usize>(
    experiments: &[Experiment<N>],
    accuracy: f64,
    threads: usize,
) -> Vec<Result<(Recording<N>, Resolved), SimulationError>> {
    let (mut done, mut pending) = (Vec::new(), Vec::new());
    for (i, experiment) in experiments.iter().enumerate() {
        match Search::new(experiment, accuracy) {
            Ok(search) => {
                pending.push((i, search));
                done.push(None);
            }
            Err(error) => done.push(Some(Err(error))),
        }
    }
    while !pending.is_empty() {
        // Equal steps side by side.
        pending.sort_by_key(|(_, search)| search.steps);
        let runs: Vec<_> = pending.iter().map(|(_, s)| s.experiment.clone()).collect();
        let runs = simulate_batch(&runs, threads);
        let judged = pending
            .into_iter()
            .zip(runs)
            .filter_map(|((i, mut search), run)| {
                let judged = search.judge(run.as_ref().map(|run| [&run.q[..], &run.qd[..]]));
                done[i] = Some(match (judged, run) {
                    (Ok(None), _) => return Some((i, search)),
                    (Ok(Some(resolved)), Ok(recording)) => Ok((recording, resolved)),
                    (Err(error), _) | (_, Err(error)) => Err(error),
                });
                None
            });
        pending = judged.collect();
    }
    done.into_iter().flatten().collect()
}

/// The step of [`simulate_accurately`] for one experiment; of the runs nothing but their angles is kept.
///
/// * `go_on` - called between pieces of a run; `None` ends the search
///
/// # Errors
/// As [`simulate_accurately`].
pub fn resolve<const N: usize>(
    experiment: &Experiment<N>,
    accuracy: f64,
    go_on: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<Resolved>, SimulationError> {
    let mut search = Search::new(experiment, accuracy)?;
    search.columns = Columns::Motion;
    loop {
        let (mut q, mut qd, mut flow) = (Vec::new(), Vec::new(), ControlFlow::Continue(()));
        let run = simulate_in_pieces(Engine::Native, &search.experiment, PIECE, &mut |piece| {
            q.extend_from_slice(&piece.recording.q);
            qd.extend_from_slice(&piece.recording.qd);
            flow = go_on();
            flow
        });
        if flow.is_break() {
            return Ok(None);
        }
        let resolved = search.judge(run.as_ref().map(|()| [&q[..], &qd[..]]))?;
        if resolved.is_some() {
            return Ok(resolved);
        }
    }
}

/// A coarser run.
struct Coarser {
    /// Steps from sample to sample.
    steps: usize,
    angles: Vec<f64>,
}

/// The search for the step of one experiment.
struct Search<const N: usize> {
    /// With the step that is tried next. The first run only serves to compare the second with.
    experiment: Experiment<N>,
    /// What is recorded of later runs.
    columns: Columns,
    accuracy: f64,
    /// From sample to sample \[s\].
    interval: f64,
    /// Steps in that.
    steps: usize,
    is_smooth: bool,
    /// The runs that the next one is compared with, the latest last.
    coarser: Vec<Coarser>,
}

impl<const N: usize> Search<N> {
    fn new(experiment: &Experiment<N>, accuracy: f64) -> Result<Self, SimulationError> {
        let setting = |name, found, allowed| SimulationError::Setting {
            name,
            found,
            allowed,
        };
        if !(accuracy > 0.0 && accuracy.is_finite()) {
            return Err(setting(
                "accuracy",
                accuracy,
                "a positive number of radians",
            ));
        }
        let interval = experiment.output_interval.unwrap_or(f64::NAN);
        if !(interval > 0.0 && interval.is_finite()) {
            let allowed = "a positive number of seconds where the step is chosen";
            return Err(setting("output interval", interval, allowed));
        }
        let setup = experiment.altered()?;
        let model = model_of(experiment, &setup)?;
        let (Start::Given { q, .. } | Start::Equilibrium { near: q }) = &experiment.start;
        let largest = match &model.link {
            Link::Compliant(contact) => {
                Vibration::at(contact, &model, q).largest_step(Integrator::Rk4)
            }
            _ => f64::INFINITY,
        };
        let mut search = Self {
            experiment: experiment.clone(),
            columns: experiment.columns,
            accuracy,
            interval,
            steps: 0,
            is_smooth: model.is_smooth(),
            coarser: Vec::new(),
        };
        search.experiment.integrator = Integrator::Rk4;
        search.experiment.columns = Columns::Motion;
        search.divide((interval / (FIRST * largest)).min(interval / SHORTEST));
        Ok(search)
    }

    /// Starts at the equilibrium that a run has found; with a rigid coupling, which projects its start, it is computed again.
    fn start_as_before(&mut self, columns: [&[f64]; 2]) {
        let is_compliant = !matches!(
            self.experiment.drive,
            Drive::Handle {
                coupling: Coupling::Rigid,
                ..
            }
        );
        if is_compliant && matches!(self.experiment.start, Start::Equilibrium { .. }) {
            let [q, qd] = columns.map(|all| Joints::from_fn(|j, _| all[j]));
            self.experiment.start = Start::Given { q, qd };
        }
    }

    /// Checks a run by its angles and speeds: `None` where another run is needed.
    fn judge(
        &mut self,
        run: Result<[&[f64]; 2], &SimulationError>,
    ) -> Result<Option<Resolved>, SimulationError> {
        let [angles, speeds] = match run {
            Ok(columns) => columns,
            // A step that is too long may end the run.
            Err(SimulationError::TooStiff { .. } | SimulationError::Diverged { .. })
                if self.experiment.dt > 2.0 * SHORTEST =>
            {
                self.coarser.clear();
                self.experiment.columns = Columns::Motion;
                self.divide(2.0 * self.steps as f64);
                return Ok(None);
            }
            Err(error) => return Err(error.clone()),
        };
        let error = self.error(angles);
        let (steps, dt) = (self.steps as f64, self.experiment.dt);
        let finer = match error {
            Some(error) if error <= self.accuracy => return Ok(Some(Resolved { dt, error })),
            Some(error) => {
                let predicted = libm::pow(error / (AIM * self.accuracy), 1.0 / ORDER);
                let finer = predicted.max(FINER.0).min(FINER.1);
                if dt / finer < SHORTEST {
                    return Err(SimulationError::Accuracy {
                        requested: self.accuracy,
                        reached: error,
                        dt,
                    });
                }
                finer
            }
            None => FINER.0,
        };
        self.experiment.columns = self.columns;
        self.start_as_before([angles, speeds]);
        if self.coarser.len() == self.compared() {
            self.coarser.remove(0);
        }
        self.coarser.push(Coarser {
            steps: self.steps,
            angles: angles.to_vec(),
        });
        self.divide(finer * steps);
        Ok(None)
    }

    /// How many runs one is compared with.
    fn compared(&self) -> usize {
        if self.is_smooth { 1 } else { 2 }
    }

    /// The largest error of the angles, estimated from the coarser runs; `None` where there are too few.
    fn error(&self, angles: &[f64]) -> Option<f64> {
        let order = if self.is_smooth { ORDER } else { 1.0 };
        let beside = |coarser: &Coarser| {
            let distance = coarser
                .angles
                .iter()
                .zip(angles)
                .map(|(a, b)| (a - b).abs());
            let finer = self.steps as f64 / coarser.steps as f64;
            distance.fold(0.0, f64::max) / (libm::pow(finer, order) - 1.0)
        };
        (self.coarser.len() == self.compared())
            .then(|| self.coarser.iter().map(beside).fold(0.0, f64::max))
    }

    /// Takes at least so many steps from sample to sample.
    fn divide(&mut self, steps: f64) {
        let steps = (steps - 1e-9).ceil().max(1.0);
        self.steps = steps as usize;
        self.experiment.dt = self.interval / steps;
    }
}
