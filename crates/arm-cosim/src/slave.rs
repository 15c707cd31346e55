//! The life cycle of a co-simulation slave: which call is allowed when, and what each does.

use arm_core::Shown;
use arm_sim::SimulationError;

use crate::mode::Mode;
use crate::plant::{Plant, plant};
use crate::spec::ArmSpec;
use crate::state::SlaveState;
use crate::status::{Refused, Status};
use crate::variables::{Causality, Initial, Variability, Variable, fits, put, token, variables};

/// How far apart the importer's time and ours may be, relative to the larger of 1 s and the time.
const SAME_TIME: f64 = 1e-9;

/// The same relative to the step.
const SAME_STEP: f64 = 0.25;

/// From which difference on our time is brought back to that of the importer, in the same way.
const OWN_TIME: f64 = 1e-10;

/// The same relative to the step.
const OWN_STEP: f64 = 1e-3;

/// An arm as a co-simulation slave.
///
/// Every call ends as the standard has it: an [`Error`](Status::Error) leads to [`Mode::Failed`], a
/// [`Discard`](Status::Discard) leaves the slave as it was. Setting several values happens wholly or not at all.
pub struct Slave {
    spec: ArmSpec,
    pub(crate) table: Vec<Variable>,
    token: String,
    pub(crate) mode: Mode,
    /// Whether the importer integrates it.
    exchange: bool,
    pub(crate) values: Vec<f64>,
    pub(crate) plant: Box<dyn Plant>,
    /// Whether parameters or start values were set since the plant was made.
    pub(crate) stale: bool,
    start: f64,
    stop: f64,
}

impl Slave {
    /// An instantiated slave.
    ///
    /// # Errors
    /// [`Refused`] for an arm that the core refuses.
    pub fn new(spec: ArmSpec) -> Result<Self, Refused> {
        Self::made(spec, false)
    }

    /// An instantiated arm that the importer integrates: Model Exchange.
    ///
    /// # Errors
    /// [`Refused`] for an arm that the core refuses, or that is not offered so: see [`ArmSpec::no_exchange`].
    pub fn for_exchange(spec: ArmSpec) -> Result<Self, Refused> {
        Self::made(spec, true)
    }

    fn made(spec: ArmSpec, exchange: bool) -> Result<Self, Refused> {
        let table = variables(&spec)?;
        let token = token(&spec)?;
        let values = table.iter().map(|v| v.start.unwrap_or(0.0)).collect();
        let mut slave = Self {
            plant: plant(&spec)?,
            spec,
            table,
            token,
            mode: Mode::Instantiated,
            exchange,
            values,
            stale: true,
            start: 0.0,
            stop: f64::INFINITY,
        };
        slave.prepare()?;
        Ok(slave)
    }

    /// The arm as it was given; parameters that were set since are not in it.
    pub fn spec(&self) -> &ArmSpec {
        &self.spec
    }

    /// Its variables; the place in the table is the value reference.
    pub fn variables(&self) -> &[Variable] {
        &self.table
    }

    /// What protects it: see [`token`].
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Where it is in its life.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Time \[s\].
    pub fn time(&self) -> f64 {
        match self.mode {
            Mode::Instantiated | Mode::Initialization => self.start,
            _ => self.plant.time(),
        }
    }

    /// Value reference of a variable.
    pub fn reference(&self, name: &str) -> Option<u32> {
        let at = self.table.iter().position(|v| v.name == name)?;
        u32::try_from(at).ok()
    }

    /// Begins the initialization at a time \[s\]; later steps may not go beyond `stop`.
    ///
    /// # Errors
    /// [`Refused`] in another mode, and for times that are not finite or not in order.
    pub fn enter_initialization_mode(
        &mut self,
        start: f64,
        stop: Option<f64>,
    ) -> Result<(), Refused> {
        self.only_in("enter the initialization", &[Mode::Instantiated])?;
        self.set_experiment(start, stop)?;
        self.mode = Mode::Initialization;
        Ok(())
    }

    /// Start and stop time as they are set: the start, and infinity where the run has no end \[s\].
    pub fn experiment(&self) -> (f64, f64) {
        (self.start, self.stop)
    }

    /// Sets start and stop time before the initialization begins, as FMI 2.0 has it.
    ///
    /// # Errors
    /// As [`Slave::enter_initialization_mode`].
    pub fn set_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Refused> {
        self.only_in("set up the experiment", &[Mode::Instantiated])?;
        let stop = stop.unwrap_or(f64::INFINITY);
        if !start.is_finite() {
            return self.failed(format!(
                "the start time is {start}, allowed is a finite number of seconds"
            ));
        }
        if stop.is_nan() || stop < start {
            return self.failed(format!(
                "the stop time is {} s, allowed is at least the start time, {} s",
                Shown(stop),
                Shown(start)
            ));
        }
        (self.start, self.stop, self.stale) = (start, stop, true);
        Ok(())
    }

    /// Ends the initialization: parameters and start values are taken.
    ///
    /// # Errors
    /// [`Refused`] in another mode, and for values that the core refuses together.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Refused> {
        self.only_in("leave the initialization", &[Mode::Initialization])?;
        if let Err(refused) = self.prepare() {
            return self.failed(refused.message);
        }
        self.mode = if self.exchange {
            Mode::Event
        } else {
            Mode::Step
        };
        Ok(())
    }

    /// Sets variables by value reference, all or none.
    ///
    /// # Errors
    /// [`Status::Error`] for a reference that is not known, or not to be set now; [`Status::Discard`] for a value that is
    /// not finite or out of range.
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Result<(), Refused> {
        self.only_in(
            "set variables",
            &[
                Mode::Instantiated,
                Mode::Initialization,
                Mode::Step,
                Mode::Event,
                Mode::Continuous,
            ],
        )?;
        if references.len() != values.len() {
            return self.failed(format!(
                "{} values for {} variables",
                values.len(),
                references.len()
            ));
        }
        for (&reference, &value) in references.iter().zip(values) {
            let Some(variable) = self.table.get(reference as usize) else {
                return self.failed(format!("no variable has the value reference {reference}"));
            };
            if !settable(variable, self.mode) {
                let (name, causality) = (&variable.name, variable.causality.name());
                let message = format!(
                    "{name} ({causality}) cannot be set when the slave is {}",
                    self.mode.name()
                );
                return self.failed(message);
            }
            if !fits(variable, value) {
                let Variable {
                    name,
                    unit,
                    range: (min, max),
                    ..
                } = variable;
                return Err(Refused::discard(format!(
                    "{name} is {}, allowed is a finite number, {} to {} {unit}",
                    Shown(value),
                    Shown(*min),
                    Shown(*max)
                )));
            }
        }
        for (&reference, &value) in references.iter().zip(values) {
            let at = reference as usize;
            self.values[at] = value;
            let variable = &self.table[at];
            if variable.causality == Causality::Input {
                self.plant.set_input(variable.quantity, value);
            } else {
                self.stale = true;
            }
        }
        if self.stale && matches!(self.mode, Mode::Step | Mode::Event) {
            self.tune()?;
        }
        Ok(())
    }

    /// Sets how inputs go on: their time derivatives are variables of their own, and that of `robot.r` is `robot.v`. A zero of
    /// another order is nothing to do.
    ///
    /// # Errors
    /// [`Status::Error`] for a variable without a derivative of that order; else as [`Slave::set`].
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), Refused> {
        if references.len() != orders.len() || references.len() != values.len() {
            return self.failed(
                "references, orders and values of derivatives differ in number".to_owned(),
            );
        }
        let (mut rates, mut given) = (Vec::new(), Vec::new());
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(values) {
            let derivative = |at: usize| {
                let of = self.table.get(at)?.quantity;
                let mut table = self.table.iter();
                table.position(|v| v.quantity.input() == Some(of))
            };
            let at = reference as usize;
            let is_input = self
                .table
                .get(at)
                .is_some_and(|v| v.causality == Causality::Input);
            let rate = (0..order).try_fold(at, |at, _| derivative(at));
            match rate.filter(|_| is_input && order > 0) {
                Some(rate) => {
                    rates.push(u32::try_from(rate).unwrap_or(u32::MAX));
                    given.push(value);
                }
                None if is_input && order > 0 && value == 0.0 => {}
                None => {
                    return self.failed(format!(
                        "the value reference {reference} has no derivative of order {order} that can be set"
                    ));
                }
            }
        }
        self.set(&rates, &given)
    }

    /// Reads variables by value reference, in every mode.
    ///
    /// # Errors
    /// [`Status::Error`] for a reference that is not known, and before the first step for parameters that the core refuses
    /// together; [`Status::Discard`] for a value that follows from inputs beyond all numbers.
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Refused> {
        if references.len() != values.len() {
            return self.failed(format!(
                "room for {} values of {} variables",
                values.len(),
                references.len()
            ));
        }
        for (&reference, value) in references.iter().zip(values) {
            *value = self.value(reference)?;
        }
        Ok(())
    }

    pub(crate) fn value(&mut self, reference: u32) -> Result<f64, Refused> {
        let at = reference as usize;
        let Some(variable) = self.table.get(at) else {
            return self.failed(format!("no variable has the value reference {reference}"));
        };
        let before = matches!(self.mode, Mode::Instantiated | Mode::Initialization);
        let moving = !before && !self.stale;
        match (variable.causality, variable.initial) {
            (Causality::Independent, _) => Ok(self.time()),
            (Causality::Output, Some(Initial::Exact)) if !moving => Ok(self.values[at]),
            (Causality::Output, _) | (Causality::Local, Some(Initial::Calculated)) => {
                let quantity = variable.quantity;
                self.prepared()?;
                let value = self.plant.output(quantity);
                if !value.is_finite() {
                    let name = &self.table[at].name;
                    return Err(Refused::discard(format!(
                        "{name} is {value}: the inputs or parameters are too large"
                    )));
                }
                Ok(value)
            }
            (Causality::Input | Causality::Parameter | Causality::Local, _) => Ok(self.values[at]),
        }
    }

    /// First time derivatives of outputs, with the inputs going on as they are.
    ///
    /// # Errors
    /// [`Refused`] outside the step mode, for variables that are no outputs, and for other orders than 1.
    pub fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), Refused> {
        self.only_in("read derivatives", &[Mode::Step, Mode::Terminated])?;
        if references.len() != values.len() || references.len() != orders.len() {
            return self.failed(
                "references, orders and values of derivatives differ in number".to_owned(),
            );
        }
        for ((&reference, &order), value) in references.iter().zip(orders).zip(values) {
            let variable = self.table.get(reference as usize);
            let Some(quantity) = variable
                .filter(|v| v.causality == Causality::Output)
                .map(|v| v.quantity)
            else {
                return self.failed(format!(
                    "the value reference {reference} is not that of an output"
                ));
            };
            if order != 1 {
                return self.failed(format!(
                    "the order of a derivative is {order}, allowed is 1"
                ));
            }
            *value = self.plant.derivative(quantity);
        }
        Ok(())
    }

    /// Makes one communication step from `time` \[s\], which must be where the slave stands.
    ///
    /// # Errors
    /// [`Status::Error`] for a time or a step that is not allowed; [`Status::Discard`] when the state ceases to be finite:
    /// the slave is then as before the step.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), Refused> {
        self.only_in("make a step", &[Mode::Step])?;
        let own = self.plant.time();
        let within = |share: f64, a: f64, b: f64| (a - b).abs() <= share * b.abs().max(1.0);
        // A step within 1e-6 of a whole number of inner steps is not yet rounded to it, see `Stepper::advance`.
        let lag = 2e-6 * self.spec.step;
        // Far from zero a share of the time may be more than a step: then a part of the step decides.
        let near = |a: f64, b: f64| {
            let apart = (a - b).abs();
            apart <= lag || (within(SAME_TIME, a, b) && apart <= SAME_STEP * step.max(0.0))
        };
        if !near(time, own) {
            return self.failed(format!(
                "a step from {} s was asked for, the slave is at {} s",
                Shown(time),
                Shown(own)
            ));
        }
        let end = time + step;
        if step > 0.0 && end <= time {
            return self.failed(format!(
                "a step of {} s from {} s was asked for: a number cannot hold the time after it",
                Shown(step),
                Shown(time)
            ));
        }
        if end > self.stop && !near(end, self.stop) {
            return self.failed(format!(
                "a step to {} s was asked for, the run ends at {} s",
                Shown(end),
                Shown(self.stop)
            ));
        }
        // Steps that are nearly whole inner steps, such as 1 ms in single precision, would take us ever further away from the
        // importer's time: we go to where it is. Mere rounding is left alone, for it would change bits.
        let same = within(OWN_TIME, time, own) && (time - own).abs() <= OWN_STEP * step.max(0.0);
        let duration = if step > 0.0 && !same { end - own } else { step };
        match self.plant.advance(duration) {
            Ok(()) => Ok(()),
            Err(error @ SimulationError::Diverged { .. }) => {
                Err(Refused::discard(error.to_string()))
            }
            Err(error) => self.failed(error.to_string()),
        }
    }

    /// Ends the run.
    ///
    /// # Errors
    /// [`Refused`] outside the step mode.
    pub fn terminate(&mut self) -> Result<(), Refused> {
        self.only_in("terminate", &[Mode::Step, Mode::Event, Mode::Continuous])?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    /// Goes back to how the slave was made.
    ///
    /// # Errors
    /// None for a slave that was made.
    pub fn reset(&mut self) -> Result<(), Refused> {
        for (value, variable) in self.values.iter_mut().zip(&self.table) {
            *value = variable.start.unwrap_or(0.0);
        }
        (self.start, self.stop) = (0.0, f64::INFINITY);
        (self.mode, self.stale) = (Mode::Instantiated, true);
        self.prepare()
    }

    /// The state, to come back to it; possible in every mode.
    pub fn state(&self) -> SlaveState {
        SlaveState {
            mode: self.mode,
            stale: self.stale,
            span: (self.start, self.stop),
            values: self.values.clone(),
            plant: self.plant.save(),
            token: self.token.clone(),
        }
    }

    /// Comes back to a state; possible in every mode.
    ///
    /// # Errors
    /// [`Refused`] for a state of another arm or version, or with values that no arm can have; the slave is then as before.
    pub fn set_state(&mut self, state: &SlaveState) -> Result<(), Refused> {
        if state.token != self.token || state.values.len() != self.values.len() {
            let (found, allowed) = (&state.token, &self.token);
            return Err(Refused::error(format!(
                "the state belongs to {found}, this slave is {allowed}"
            )));
        }
        let running = matches!(state.mode, Mode::Event | Mode::Continuous);
        if running != self.exchange && (running || state.mode == Mode::Step) {
            return Err(Refused::error(
                "the state is that of the other interface: Model Exchange or co-simulation",
            ));
        }
        let fit = |(v, &value): (&Variable, &f64)| v.start.is_none() || fits(v, value);
        let (numbers, (start, stop)) = (&state.plant.numbers, state.span);
        let fits = numbers.len() == self.plant.size()
            && numbers.iter().all(|v| v.is_finite())
            && self.table.iter().zip(&state.values).all(fit)
            && start.is_finite()
            && start <= stop;
        if !fits {
            return Err(Refused::error("the state does not fit this arm"));
        }
        let parameters = self.table.iter().zip(self.values.iter().zip(&state.values));
        let same = parameters
            .filter(|(v, _)| v.causality == Causality::Parameter)
            .all(|(_, (a, b))| a.to_bits() == b.to_bits());
        let before = std::mem::replace(&mut self.values, state.values.clone());
        if (!same || self.stale)
            && let Err(refused) = self.remake()
        {
            self.values = before;
            return Err(refused);
        }
        self.give_inputs();
        self.plant.load(&state.plant);
        (self.start, self.stop) = state.span;
        (self.mode, self.stale) = (state.mode, state.stale);
        Ok(())
    }

    /// Makes the plant from the values, unless that is done.
    pub(crate) fn prepared(&mut self) -> Result<(), Refused> {
        if self.stale { self.prepare() } else { Ok(()) }
    }

    fn prepare(&mut self) -> Result<(), Refused> {
        let spec = self.remake()?;
        self.give_inputs();
        self.plant.start(&spec, self.start)?;
        self.stale = false;
        Ok(())
    }

    /// A plant with the parameters and inputs as they are set.
    fn remake(&mut self) -> Result<ArmSpec, Refused> {
        let mut spec = self.spec.clone();
        for (variable, &value) in self.table.iter().zip(&self.values) {
            if variable.start.is_some() {
                put(&mut spec, variable.quantity, value);
            }
        }
        if let Some(why) = spec.no_exchange().filter(|_| self.exchange) {
            return Err(Refused::error(why));
        }
        self.plant = plant(&spec)?;
        Ok(spec)
    }

    /// Takes parameters that were changed while the arm moves: its state goes on.
    fn tune(&mut self) -> Result<(), Refused> {
        let saved = self.plant.save();
        match self.remake() {
            Ok(_) => {
                self.give_inputs();
                self.plant.load(&saved);
                self.stale = false;
                Ok(())
            }
            Err(refused) => self.failed(refused.message),
        }
    }

    fn give_inputs(&mut self) {
        for (variable, &value) in self.table.iter().zip(&self.values) {
            if variable.causality == Causality::Input {
                self.plant.set_input(variable.quantity, value);
            }
        }
    }

    pub(crate) fn only_in(&mut self, what: &str, modes: &[Mode]) -> Result<(), Refused> {
        if modes.contains(&self.mode) {
            return Ok(());
        }
        self.failed(format!(
            "cannot {what} when the slave is {}",
            self.mode.name()
        ))
    }

    /// Ends as an error: from now on only reading, going back to a state and a reset are possible.
    ///
    /// # Errors
    /// Always.
    pub fn failed<T>(&mut self, message: String) -> Result<T, Refused> {
        self.mode = Mode::Failed;
        Err(Refused {
            status: Status::Error,
            message,
        })
    }
}

fn settable(variable: &Variable, mode: Mode) -> bool {
    let before = matches!(mode, Mode::Instantiated | Mode::Initialization);
    match variable.causality {
        Causality::Input => true,
        Causality::Parameter => {
            let between = matches!(mode, Mode::Step | Mode::Event);
            before || (between && variable.variability == Variability::Tunable)
        }
        Causality::Output => before && variable.initial == Some(Initial::Exact),
        Causality::Independent | Causality::Local => false,
    }
}
