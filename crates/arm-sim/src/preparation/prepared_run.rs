//! A prepared run: checked experiment, effects applied, schedule, robot angles.

use std::ops::Range;

use arm_core::effect::{Effect, Place};
use arm_core::{Joints, Setup};

use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::stability;
use crate::closed_chain::state::{BaseMotion, Input};
use crate::error::finite;
use crate::experiment::discontinuities::Discontinuities;
use crate::experiment::step_grid::StepGrid;
use crate::free_memory::require_memory;
use crate::preparation::initial_state;
use crate::{
    Columns, Coupling, Drive, Experiment, Handle, HandlePath, Integrator, JointMotion,
    SimulationError, Start,
};
use arm_core::simd_dispatch::{Computation, dispatch};

/// An experiment that passed all checks.
#[derive(Clone, Debug)]
pub(crate) struct Prepared<'a, const N: usize> {
    pub experiment: &'a Experiment<N>,
    /// The rig with all effects applied.
    pub setup: Setup<f64, N>,
    pub model: Model<f64, N>,
    pub schedule: StepGrid,
    /// Where the drive is not smooth.
    pub discontinuities: Discontinuities,
    /// Angles and speeds at the start.
    pub start: (Joints<f64, N>, Joints<f64, N>),
    /// Commanded robot motion at each sample, where it is kept; empty without a robot.
    robot: Vec<JointMotion<2>>,
}

impl<'a, const N: usize> Prepared<'a, N> {
    pub fn new(experiment: &'a Experiment<N>) -> Result<Self, SimulationError> {
        Self::recorded(experiment, false)
    }

    /// Where no more than a piece of the run is held, what grows with its length is looked at once and not kept.
    pub fn recorded(
        experiment: &'a Experiment<N>,
        in_pieces: bool,
    ) -> Result<Self, SimulationError> {
        let schedule = StepGrid::of(experiment)?;
        refuse_unknown_activity(&experiment.effects, experiment.activity.is_some())?;
        let setup = experiment.altered()?;
        let model = model_of(experiment, &setup)?;
        known(experiment, &schedule)?;
        let motion = reached(experiment, &schedule, 0..schedule.samples());
        let robot = if in_pieces {
            for robot in motion {
                robot?;
            }
            Vec::new()
        } else {
            if experiment.robot.is_some() {
                require_memory((size_of::<JointMotion<2>>() * schedule.samples()) as u64)?;
            }
            motion.collect::<Result<_, _>>()?
        };
        let mut prepared = Self {
            experiment,
            setup,
            model,
            schedule,
            discontinuities: Discontinuities::of(experiment, &schedule),
            start: (Joints::zeros(), Joints::zeros()),
            robot,
        };
        let (input, solver) = (prepared.input(0.0), (experiment.integrator, schedule.dt));
        let model = &prepared.model;
        prepared.start = match &experiment.start {
            Start::Given { q, qd } => initial_state::given(model, &input, (q, qd))?,
            Start::Equilibrium { near } => {
                // First near it: no equilibrium need be found of a contact that is refused anyhow.
                stability::check(model, solver, near)?;
                let q = initial_state::equilibrium(model, &input, near)?;
                (q, initial_state::following(model, &input, &q))
            }
        };
        stability::check(model, solver, &prepared.start.0)?;
        Ok(prepared)
    }

    /// Whether the commanded motion of a robot is known and recorded.
    pub fn records_robot(&self) -> bool {
        self.experiment.robot.is_some()
            && self.experiment.columns == Columns::All
            && matches!(self.experiment.drive, Drive::Handle { .. })
    }

    /// Commanded robot motion at some samples; none without a robot.
    pub fn robot_motion(&self, samples: Range<usize>) -> impl Iterator<Item = JointMotion<2>> {
        let known = self.robot.get(samples.clone()).unwrap_or_default();
        let rest = samples.start + known.len()..samples.end;
        // That the robot gets there was seen before the run.
        let computed = reached(self.experiment, &self.schedule, rest).filter_map(Result::ok);
        known.iter().copied().chain(computed)
    }

    /// Handle as it stands in the hand, and torques at a time \[s\].
    #[inline]
    pub fn input(&self, time: f64) -> Input<f64, N> {
        let mut input = command(self.experiment, time);
        input.stands_as_in(&self.setup);
        input
    }

    /// [`Prepared::input`] after each of some numbers of half steps, appended to `out`.
    pub fn inputs(&self, half_steps: &[usize], out: &mut Vec<Input<f64, N>>) {
        let from = out.len();
        commands(self.experiment, &self.schedule, half_steps, out);
        if self.setup.is_as_commanded() {
            return;
        }
        for input in &mut out[from..] {
            input.stands_as_in(&self.setup);
        }
    }

    pub fn integrator(&self) -> Integrator {
        self.experiment.integrator
    }
}

/// What the drive commands at a time, seen from the base where its path was measured.
#[inline]
pub(crate) fn command<const N: usize>(experiment: &Experiment<N>, time: f64) -> Input<f64, N> {
    let mut input = Input {
        time,
        handle: Handle {
            position: [0.0; 2],
            velocity: [0.0; 2],
            acceleration: [0.0; 2],
        },
        torque: Joints::zeros(),
        base: BaseMotion::still(),
        activity: [0.0; N],
    };
    match &experiment.drive {
        Drive::Handle { path, .. } => input.handle = path.at(time),
        Drive::Torque(Some(series)) => input.torque = series.at(time).value.into(),
        Drive::Torque(None) => {}
    }
    with_measured(experiment, core::slice::from_mut(&mut input));
    input
}

/// Points of time whose commands are computed side by side.
const ABREAST: usize = 16;

/// [`command`] after each of some numbers of half steps, appended to `out`; the same bits.
pub(crate) fn commands<const N: usize>(
    experiment: &Experiment<N>,
    schedule: &StepGrid,
    half_steps: &[usize],
    out: &mut Vec<Input<f64, N>>,
) {
    let Drive::Handle { path, .. } = &experiment.drive else {
        let times = half_steps.iter().map(|&half| schedule.half_time(half));
        out.extend(times.map(|time| command(experiment, time)));
        return;
    };
    let from = out.len();
    dispatch(Abreast {
        path,
        schedule,
        half_steps,
        out,
    });
    with_measured(experiment, &mut out[from..]);
}

/// Moves the base along its measured path, sets the activity of muscles and adds the torques of assistance, where there are such.
#[inline]
fn with_measured<const N: usize>(experiment: &Experiment<N>, inputs: &mut [Input<f64, N>]) {
    if let Some(path) = &experiment.base {
        for input in &mut *inputs {
            let jet = path.at(input.time);
            input.move_base([jet.value, jet.rate, jet.curvature]);
        }
    }
    if let Some(activity) = &experiment.activity {
        for input in &mut *inputs {
            input.activity = activity.at(input.time).value;
        }
    }
    if let Some(assistance) = &experiment.assistance {
        for input in inputs {
            input.torque += assistance.torque(input.time);
        }
    }
}

/// Refuses effects that depend on muscle activity where none is given.
pub(crate) fn refuse_unknown_activity(
    effects: &[Effect<f64>],
    activity: bool,
) -> Result<(), SimulationError> {
    let deaf = |e: &&Effect<f64>| e.on && e.kind.feels_activity() && !activity;
    match effects.iter().find(deaf) {
        Some(effect) => Err(SimulationError::NoActivity {
            kind: effect.kind.info().kind,
        }),
        None => Ok(()),
    }
}

struct Abreast<'a, const N: usize> {
    path: &'a HandlePath<N>,
    schedule: &'a StepGrid,
    half_steps: &'a [usize],
    out: &'a mut Vec<Input<f64, N>>,
}

impl<const N: usize> Computation for Abreast<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for halves in self.half_steps.chunks(ABREAST) {
            // A last group that is not full repeats its end.
            let half = |i: usize| halves[i.min(halves.len() - 1)];
            // Not by `from_fn`, which may become a call.
            let mut times = [0.0; ABREAST];
            for (i, time) in times.iter_mut().enumerate() {
                *time = self.schedule.half_time(half(i));
            }
            let handles = self.path.abreast(&times);
            self.out.extend((0..halves.len()).map(|i| Input {
                time: times[i],
                handle: handles.at(i),
                torque: Joints::zeros(),
                base: BaseMotion::still(),
                activity: [0.0; N],
            }));
        }
    }
}

/// The model of an experiment whose effects have been applied to its rig.
pub(crate) fn model_of<const N: usize>(
    experiment: &Experiment<N>,
    setup: &Setup<f64, N>,
) -> Result<Model<f64, N>, SimulationError> {
    let mut model = assemble(setup, &experiment.effects, link(experiment, setup)?)?;
    model.heaves |= experiment.base.is_some();
    if let Some(assistance) = &experiment.assistance {
        model.assist(assistance.springs.stiffness, assistance.springs.damping);
    }
    Ok(model)
}

/// The model of a rig whose effects have been applied.
pub(crate) fn assemble<const N: usize>(
    setup: &Setup<f64, N>,
    effects: &[Effect<f64>],
    link: Link<f64>,
) -> Result<Model<f64, N>, SimulationError> {
    check(setup)?;
    let in_joints = |e: &&Effect<f64>| e.on && e.kind.info().place == Place::Joint;
    let effects = effects.iter().filter(in_joints).copied();
    Ok(Model::new(setup, link, effects.collect())?)
}

/// What the chain does not check.
fn check<const N: usize>(setup: &Setup<f64, N>) -> Result<(), SimulationError> {
    let contact = &setup.contact;
    let at_least_zero = [
        ("contact stiffness", contact.stiffness),
        ("contact damping", contact.damping),
        ("play of the contact", contact.play),
    ];
    for (name, values) in at_least_zero {
        for found in values {
            if !(found >= 0.0 && found.is_finite()) {
                let allowed = "zero or more";
                return Err(SimulationError::Setting {
                    name,
                    found,
                    allowed,
                });
            }
        }
    }
    let settings = [
        ("placement", setup.placement[0]),
        ("placement", setup.placement[1]),
        ("base motion", setup.base_motion[0]),
        ("base motion", setup.base_motion[1]),
        ("rest angle of the base", setup.base_rest),
        ("ripple", setup.displaced.ripple.amplitude[0]),
        ("ripple", setup.displaced.ripple.amplitude[1]),
        ("ripple frequency", setup.displaced.ripple.frequency),
        ("ripple phase", setup.displaced.ripple.phase),
        ("heave", setup.heave.amplitude[0]),
        ("heave", setup.heave.amplitude[1]),
        ("heave frequency", setup.heave.frequency),
        ("heave phase", setup.heave.phase),
        ("slip", setup.displaced.slip[0]),
        ("slip", setup.displaced.slip[1]),
        ("start of the slip", setup.displaced.slip_start),
        ("force delay", setup.force_delay),
    ];
    for (name, found) in settings {
        finite(name, found, "a finite number")?;
    }
    Ok(())
}

/// How the tip of an experiment is held.
fn link<const N: usize>(
    experiment: &Experiment<N>,
    setup: &Setup<f64, N>,
) -> Result<Link<f64>, SimulationError> {
    match &experiment.drive {
        Drive::Torque(_) => Ok(Link::Free),
        Drive::Handle {
            coupling: Coupling::Compliant,
            ..
        } => Ok(Link::Compliant(setup.contact)),
        Drive::Handle {
            coupling: Coupling::Rigid,
            ..
        } if N < 2 => Err(SimulationError::RigidCoupling { joints: N }),
        Drive::Handle {
            coupling: Coupling::Rigid,
            ..
        } => Ok(Link::Rigid),
    }
}

/// Whether the drive is known for the whole run.
pub(crate) fn known<const N: usize>(
    experiment: &Experiment<N>,
    schedule: &StepGrid,
) -> Result<(), SimulationError> {
    let drive = match &experiment.drive {
        Drive::Handle { path, .. } => Some(("the handle's path", path.span())),
        Drive::Torque(series) => series
            .as_ref()
            .map(|s| ("the joint torque", (s.start(), s.end()))),
    };
    let base = experiment.base.as_ref();
    let base = base.map(|path| ("the path of the base", (path.start(), path.end())));
    let activity = experiment.activity.as_ref();
    let activity = activity.map(|series| ("the muscle activity", (series.start(), series.end())));
    let assistance = experiment.assistance.as_ref().map(|a| &a.towards);
    let assistance = assistance.map(|series| ("the assistance", (series.start(), series.end())));
    let others = base.into_iter().chain(activity).chain(assistance);
    let needed = schedule.time(schedule.steps);
    // The last sample may miss the end by rounding.
    let slack = 1e-6 * schedule.dt;
    for (name, (from, to)) in drive.into_iter().chain(others) {
        if !(from <= slack && needed <= to + slack) {
            return Err(SimulationError::TooShort {
                name,
                from,
                to,
                needed,
            });
        }
    }
    Ok(())
}

/// Commanded robot motion at some samples, or why it does not get there; nothing without a robot.
fn reached<const N: usize>(
    experiment: &Experiment<N>,
    schedule: &StepGrid,
    samples: Range<usize>,
) -> impl Iterator<Item = Result<JointMotion<2>, SimulationError>> {
    let led = match (&experiment.robot, &experiment.drive) {
        (Some(robot), Drive::Handle { path, .. }) => Some((robot, path)),
        _ => None,
    };
    led.into_iter().flat_map(move |(robot, path)| {
        let time = move |sample: usize| schedule.time(sample * schedule.every);
        samples
            .clone()
            .map(move |sample| path.robot_motion(robot, time(sample)))
    })
}
