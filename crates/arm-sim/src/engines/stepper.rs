//! The native engine step by step, for coupling with other simulators.

use arm_core::effect::{Effect, MAX_STATES, States};
use arm_core::{Joints, Plane, Pose, Setup};

use crate::closed_chain::model::{Link, Model};
use crate::closed_chain::stability;
use crate::closed_chain::state::{BaseMotion, Input, State};
use crate::engines::native::{diverged, why};
use crate::error::finite;
use crate::experiment::description::altered;
use crate::integrators::advance::advance;
use crate::integrators::friction;
use crate::integrators::step::{Inputs, Memory};
use crate::preparation::initial_state;
use crate::preparation::prepared_run::{assemble, refuse_unknown_activity};
use crate::{Handle, Integrator, SimulationError};

/// Most inner steps in one call of [`Stepper::advance`].
const MOST_STEPS: f64 = 1e7;

/// The interface between the arm and its environment. Force and velocity of either port make a power bond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// A force on the arm at its tip comes in, position and velocity of the tip go out.
    Force,
    /// Position and velocity of the robot's handle come in; the spring and damper of the contact are on this side, and the
    /// force on the robot goes out.
    Motion,
}

/// What acts on the arm from outside. Each port reads what belongs to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside<const N: usize> {
    /// Force port: force on the arm at its tip when `age` was zero \[N\].
    pub force_on_arm: Plane<f64>,
    /// Force port: its time derivative, held \[N/s\].
    pub force_rate: Plane<f64>,
    /// Motion port: the handle \[m\] when `age` was zero.
    pub position: Plane<f64>,
    /// Motion port: velocity of the handle when `age` was zero \[m/s\].
    pub velocity: Plane<f64>,
    /// Motion port: acceleration of the handle, held \[m/s²\].
    pub acceleration: Plane<f64>,
    /// Time since handle or force had the stated values \[s\].
    pub age: f64,
    /// Torques of motors in the joints when `torque_age` was zero \[N m\].
    pub torque: Joints<f64, N>,
    /// Their time derivatives, held \[N m/s\].
    pub torque_rate: Joints<f64, N>,
    /// Time since the torques had the stated values \[s\].
    pub torque_age: f64,
}

impl<const N: usize> Default for Outside<N> {
    fn default() -> Self {
        Self {
            force_on_arm: [0.0; 2],
            force_rate: [0.0; 2],
            position: [0.0; 2],
            velocity: [0.0; 2],
            acceleration: [0.0; 2],
            age: 0.0,
            torque: Joints::zeros(),
            torque_rate: Joints::zeros(),
            torque_age: 0.0,
        }
    }
}

/// What drives the arm at a time, `later` after the inputs were set \[s\]; as it stands in the hand.
#[inline]
fn input<const N: usize>(
    setup: &Setup<f64, N>,
    outside: &Outside<N>,
    (time, later): (f64, f64),
) -> Input<f64, N> {
    let since = outside.age + later;
    let [r, v, a] = [outside.position, outside.velocity, outside.acceleration];
    let mut input = Input {
        time,
        handle: Handle {
            position: [0, 1].map(|i| r[i] + v[i] * since + 0.5 * a[i] * since * since),
            velocity: [0, 1].map(|i| v[i] + a[i] * since),
            acceleration: a,
        },
        torque: outside.torque + outside.torque_rate * (outside.torque_age + later),
        base: BaseMotion::still(),
        activity: [0.0; N],
    };
    input.stands_as_in(setup);
    input
}

/// A state with everything that the future depends on but the inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot<const N: usize> {
    /// Joint angles \[rad\].
    pub q: Joints<f64, N>,
    /// Joint speeds \[rad/s\].
    pub qd: Joints<f64, N>,
    /// Work since the start: by the port, by motors, against resistance, lost in the damping of the contact \[J\].
    pub work: [f64; 4],
    /// States of the effects that have one.
    pub memory: Vec<States<f64>>,
    /// Time from which whole inner steps are counted \[s\].
    pub origin: f64,
    /// Whole inner steps since.
    pub ticks: u64,
}

/// What follows from state and inputs at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen<const N: usize> {
    /// Position of the tip \[m\].
    pub tip: Plane<f64>,
    /// Velocity of the tip \[m/s\].
    pub tip_velocity: Plane<f64>,
    /// Acceleration of the tip \[m/s²\].
    pub tip_acceleration: Plane<f64>,
    /// Accelerations of the joints \[rad/s²\].
    pub qdd: Joints<f64, N>,
    /// Force on the arm at its tip \[N\].
    pub force_on_arm: Plane<f64>,
    /// Time derivative of that force, with the inputs going on as they are \[N/s\].
    pub force_rate: Plane<f64>,
    /// Time derivative of the works \[W\].
    pub power: [f64; 4],
}

/// An arm that is advanced by communication steps through one of its ports.
///
/// It makes the steps of [`simulate`](crate::engines::simulate): with the same inputs at the same inner steps both have the same bits.
/// A ripple of the robot and a slip of the handle are added to the handle of the motion port, as encoders do not measure them; a
/// heaving base follows its own time.
///
/// ```
/// use arm_sim::{Outside, Port, Stepper, sample_experiments};
/// let experiment = sample_experiments::mechanical_experiment(1.0, [0.0; 2])?;
/// let mut arm = Stepper::new(&experiment.setup, &experiment.effects, Port::Force, 0.25e-3)?;
/// arm.start([-1.0, 0.5].into(), [0.0; 2].into(), 0.0)?;
/// let before = arm.snapshot();
/// arm.advance(&Outside::default(), 1e-3)?;
/// let after = arm.snapshot();
/// arm.restore(&before);
/// arm.advance(&Outside::default(), 1e-3)?;
/// assert_eq!(arm.snapshot(), after);
/// # Ok::<(), arm_sim::SimulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stepper<const N: usize> {
    setup: Setup<f64, N>,
    model: Model<f64, N>,
    dt: f64,
    state: State<f64, N>,
    memory: Memory<f64>,
    origin: f64,
    ticks: u64,
    /// Memory for the state before a step, to which a failed step returns.
    before: Snapshot<N>,
}

impl<const N: usize> Stepper<N> {
    /// An arm at the zero angles at time zero.
    ///
    /// * `setup` - the rig without the effects
    /// * `dt` - inner step of [`Integrator::Rk4`] \[s\]
    ///
    /// # Errors
    /// [`SimulationError`] for a rig, an effect or a step that is refused.
    pub fn new(
        setup: &Setup<f64, N>,
        effects: &[Effect<f64>],
        port: Port,
        dt: f64,
    ) -> Result<Self, SimulationError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(SimulationError::Setting {
                name: "step",
                found: dt,
                allowed: "a positive number of seconds",
            });
        }
        refuse_unknown_activity(effects, false)?;
        let setup = altered(setup, effects)?;
        let link = match port {
            Port::Force => Link::Forced([0.0; 2]),
            Port::Motion => Link::Compliant(setup.contact),
        };
        let model = assemble(&setup, effects, link)?;
        let memory = Memory::new(model.effects.len());
        let before = Snapshot {
            q: Joints::zeros(),
            qd: Joints::zeros(),
            work: [0.0; 4],
            memory: memory.state.clone(),
            origin: 0.0,
            ticks: 0,
        };
        let state = State {
            q: before.q,
            qd: before.qd,
            work: before.work,
        };
        Ok(Self {
            setup,
            model,
            dt,
            state,
            memory,
            origin: 0.0,
            ticks: 0,
            before,
        })
    }

    /// Starts anew at given angles \[rad\], speeds \[rad/s\] and time \[s\]; memories of effects and works are zero.
    ///
    /// # Errors
    /// [`SimulationError`] for a value that is not finite, or a contact too stiff for the inner step.
    pub fn start(
        &mut self,
        q: Joints<f64, N>,
        qd: Joints<f64, N>,
        time: f64,
    ) -> Result<(), SimulationError> {
        finite("start time", time, "a finite number of seconds")?;
        let at = self.input(&Outside::default());
        let (q, qd) = initial_state::given(&self.model, &at, (&q, &qd))?;
        stability::check(&self.model, (Integrator::Rk4, self.dt), &q)?;
        self.state = State {
            q,
            qd,
            work: [0.0; 4],
        };
        self.memory.state.fill([0.0; MAX_STATES]);
        (self.origin, self.ticks) = (time, 0);
        Ok(())
    }

    /// Angles near given ones at which the arm rests under constant inputs \[rad\].
    ///
    /// # Errors
    /// [`SimulationError::NoEquilibrium`] where none is found.
    pub fn equilibrium(
        &mut self,
        outside: &Outside<N>,
        near: &Joints<f64, N>,
    ) -> Result<Joints<f64, N>, SimulationError> {
        self.apply(outside, 0.0);
        initial_state::equilibrium(&self.model, &self.input(outside), near)
    }

    /// Number of effects, and so of those whose states are in a snapshot.
    pub fn memories(&self) -> usize {
        self.memory.state.len()
    }

    /// Joint angles \[rad\].
    pub fn q(&self) -> &Joints<f64, N> {
        &self.state.q
    }

    /// Joint speeds \[rad/s\].
    pub fn qd(&self) -> &Joints<f64, N> {
        &self.state.qd
    }

    /// Work since the start, as in [`Snapshot::work`] \[J\].
    pub fn work(&self) -> &[f64; 4] {
        &self.state.work
    }

    /// Time \[s\]; whole inner steps are counted and not summed, so that it does not drift.
    pub fn time(&self) -> f64 {
        self.origin + self.ticks as f64 * self.dt
    }

    /// Advances by a communication step: a whole number of inner steps where `duration` is one but for rounding, and else
    /// the next number of equal steps that are no longer than the inner step.
    ///
    /// A force with a rate is held at its mean over each inner step. Does not allocate. The ages in `outside` are not changed: they
    /// grow by `duration` unless new inputs are set.
    ///
    /// # Errors
    /// [`SimulationError`] for a duration that is not positive or too long, and when the state ceases to be finite; the state
    /// is then as before the call.
    pub fn advance(&mut self, outside: &Outside<N>, duration: f64) -> Result<(), SimulationError> {
        let steps = duration / self.dt;
        if !(steps > 0.0 && steps <= MOST_STEPS) {
            return Err(SimulationError::Setting {
                name: "communication step",
                found: duration,
                allowed: "a positive number of seconds, at most 10 million inner steps",
            });
        }
        self.keep();
        self.apply(outside, 0.0);
        let whole = (steps + 0.5).floor();
        let regular = whole >= 1.0 && (steps - whole).abs() < 1e-6;
        let (count, h) = if regular {
            (whole as u64, self.dt)
        } else {
            let count = steps.ceil();
            (count as u64, duration / count)
        };
        let end = self.time() + duration;
        // Whole steps are counted from the origin, as in a run of the native engine.
        let (from, first) = if regular {
            (self.origin, 2 * self.ticks)
        } else {
            (self.time(), 0)
        };
        let input_at = |setup: &Setup<f64, N>, half: u64| {
            let time = from + 0.5 * (first + half) as f64 * h;
            input(setup, outside, (time, 0.5 * half as f64 * h))
        };
        let is_forced_evenly = outside.force_rate == [0.0; 2];
        let mut next = input_at(&self.setup, 0);
        for done in 1..=count {
            let start = next;
            next = input_at(&self.setup, 2 * done);
            let inputs = Inputs {
                start: &start,
                middle: &input_at(&self.setup, 2 * done - 1),
                end: &next,
            };
            if !is_forced_evenly {
                self.apply(outside, (done as f64 - 0.5) * h);
            }
            let at = (&mut self.state, &mut self.memory);
            advance(&self.model, Integrator::Rk4, h, inputs, at);
            if let Some(joint) = diverged(&self.state) {
                let time = next.time;
                self.undo();
                let why = why(&self.memory, (done as usize, time, joint));
                self.memory.ambiguous_friction = None;
                return Err(why);
            }
        }
        if regular {
            self.ticks += count;
        } else {
            (self.origin, self.ticks) = (end, 0);
        }
        Ok(())
    }

    /// Outputs at the present state and inputs.
    pub fn seen(&mut self, outside: &Outside<N>) -> Seen<N> {
        self.apply(outside, 0.0);
        let State { q, qd, .. } = &self.state;
        let pose = Pose::new(q);
        let input = self.input(outside);
        let (outcome, _) = friction::at(&self.model, &input, (q, qd), &self.memory.state);
        let tip = self.model.tip(q, &pose);
        let tip_velocity = self.model.tip_velocity(qd, &pose);
        let tip_acceleration = self.model.tip_acceleration(&self.state, &outcome.qdd);
        let (handle, base) = (&input.handle, &input.base);
        let less = |a: Plane<f64>, b: Plane<f64>| [a[0] - b[0], a[1] - b[1]];
        let force_rate = match &self.model.link {
            Link::Compliant(contact) => contact.force_rate(
                less(handle.position, tip),
                less(handle.velocity, tip_velocity),
                less(handle.acceleration, tip_acceleration),
            ),
            _ => outside.force_rate,
        };
        let in_world = |a: Plane<f64>, b: Plane<f64>| [a[0] + b[0], a[1] + b[1]];
        Seen {
            tip: in_world(tip, base.position),
            tip_velocity: in_world(tip_velocity, base.velocity),
            tip_acceleration: in_world(tip_acceleration, base.acceleration),
            qdd: outcome.qdd,
            force_on_arm: outcome.force_on_arm,
            force_rate,
            power: outcome.power,
        }
    }

    /// Position and velocity of the tip \[m, m/s\], and the force on the arm there \[N\]: less work than [`Stepper::seen`].
    #[inline]
    pub fn tip(&mut self, outside: &Outside<N>) -> (Plane<f64>, Plane<f64>, Plane<f64>) {
        self.apply(outside, 0.0);
        let State { q, qd, .. } = &self.state;
        let pose = Pose::new(q);
        let input = self.input(outside);
        let (force, _) = self.model.contact(&input, q, qd, &pose);
        let (tip, velocity) = (self.model.tip(q, &pose), self.model.tip_velocity(qd, &pose));
        (
            [0, 1].map(|axis| tip[axis] + input.base.position[axis]),
            [0, 1].map(|axis| velocity[axis] + input.base.velocity[axis]),
            force,
        )
    }

    /// Kinetic and potential energy, and the energy in the springs of the contact \[J\].
    pub fn energy(&self, outside: &Outside<N>) -> [f64; 3] {
        let State { q, qd, .. } = &self.state;
        let handle = self.input(outside).handle.position;
        self.model.energy(&Pose::new(q), (q, qd), handle)
    }

    /// The state, to come back to it.
    pub fn snapshot(&self) -> Snapshot<N> {
        Snapshot {
            q: self.state.q,
            qd: self.state.qd,
            work: self.state.work,
            memory: self.memory.state.clone(),
            origin: self.origin,
            ticks: self.ticks,
        }
    }

    /// Comes back to a state of an arm with the same effects.
    ///
    /// # Panics
    /// For a snapshot with another number of effects.
    pub fn restore(&mut self, snapshot: &Snapshot<N>) {
        self.state = State {
            q: snapshot.q,
            qd: snapshot.qd,
            work: snapshot.work,
        };
        self.memory.state.copy_from_slice(&snapshot.memory);
        (self.origin, self.ticks) = (snapshot.origin, snapshot.ticks);
    }

    /// What drives the arm now.
    fn input(&self, outside: &Outside<N>) -> Input<f64, N> {
        input(&self.setup, outside, (self.time(), 0.0))
    }

    /// Sets the force at the tip to what it is `later` from now \[s\].
    fn apply(&mut self, outside: &Outside<N>, later: f64) {
        if let Link::Forced(force) = &mut self.model.link {
            let since = outside.age + later;
            *force = [0, 1].map(|i| outside.force_on_arm[i] + outside.force_rate[i] * since);
        }
    }

    fn keep(&mut self) {
        let before = &mut self.before;
        (before.q, before.qd, before.work) = (self.state.q, self.state.qd, self.state.work);
        before.memory.copy_from_slice(&self.memory.state);
    }

    fn undo(&mut self) {
        let before = &self.before;
        (self.state.q, self.state.qd, self.state.work) = (before.q, before.qd, before.work);
        self.memory.state.copy_from_slice(&before.memory);
    }
}
