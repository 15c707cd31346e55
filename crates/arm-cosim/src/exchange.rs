//! Model Exchange: the importer integrates the arm, which gives derivatives of its states.

use crate::mode::Mode;
use crate::quantity::Quantity;
use crate::slave::Slave;
use crate::status::Refused;

const READABLE: [Mode; 4] = [
    Mode::Initialization,
    Mode::Event,
    Mode::Continuous,
    Mode::Terminated,
];

impl Slave {
    /// How many continuous states there are.
    pub fn states(&self) -> usize {
        self.state_rows().count()
    }

    /// Value references of the continuous states, in their order.
    fn state_rows(&self) -> impl Iterator<Item = (u32, Quantity)> + '_ {
        let states = self.table.iter().filter_map(|v| v.quantity.state());
        states.filter_map(|state| {
            let at = self.table.iter().position(|v| v.quantity == state)?;
            Some((u32::try_from(at).ok()?, state))
        })
    }

    /// Interrupts the integration.
    ///
    /// # Errors
    /// [`Refused`] outside the continuous-time mode.
    pub fn enter_event_mode(&mut self) -> Result<(), Refused> {
        self.only_in("enter the event mode", &[Mode::Continuous])?;
        self.mode = Mode::Event;
        Ok(())
    }

    /// Begins the integration, or goes on with it.
    ///
    /// # Errors
    /// [`Refused`] outside the event mode.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Refused> {
        self.only_in("enter the continuous-time mode", &[Mode::Event])?;
        self.mode = Mode::Continuous;
        Ok(())
    }

    /// Updates discrete states, of which there are none.
    ///
    /// # Errors
    /// [`Refused`] outside the event mode.
    pub fn update_discrete_states(&mut self) -> Result<(), Refused> {
        self.only_in("update discrete states", &[Mode::Event])
    }

    /// Takes note of a step of the importer's integrator.
    ///
    /// # Errors
    /// [`Refused`] outside the continuous-time mode.
    pub fn completed_integrator_step(&mut self) -> Result<(), Refused> {
        self.only_in("complete a step of the integrator", &[Mode::Continuous])
    }

    /// Sets the time \[s\].
    ///
    /// # Errors
    /// [`Refused`] outside event and continuous-time mode, and for a time that is not finite.
    pub fn set_time(&mut self, time: f64) -> Result<(), Refused> {
        self.only_in("set the time", &[Mode::Event, Mode::Continuous])?;
        if !time.is_finite() {
            return Err(Refused::discard(format!(
                "the time is {time}, allowed is a finite number of seconds"
            )));
        }
        self.plant.set_time(time);
        Ok(())
    }

    /// Writes the continuous states: angles \[rad\], speeds \[rad/s\], works \[J\].
    ///
    /// # Errors
    /// [`Refused`] before the initialization, and for room for another number of states.
    pub fn continuous_states(&mut self, states: &mut [f64]) -> Result<(), Refused> {
        self.read_states("states", states, |slave, reference, _| {
            slave.value(reference)
        })
    }

    /// Writes the time derivatives of the continuous states.
    ///
    /// # Errors
    /// As [`Slave::continuous_states`]; [`Status::Discard`](crate::Status::Discard) where one is not finite.
    pub fn state_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Refused> {
        self.read_states("derivatives", derivatives, |slave, _, state| {
            slave.prepared()?;
            let value = slave.plant.derivative(state);
            if value.is_finite() {
                return Ok(value);
            }
            Err(Refused::discard(format!(
                "a derivative is {value}: states or inputs are too large"
            )))
        })
    }

    /// Writes the usual sizes of the continuous states.
    ///
    /// # Errors
    /// As [`Slave::continuous_states`].
    pub fn nominals(&mut self, nominals: &mut [f64]) -> Result<(), Refused> {
        self.read_states("nominals", nominals, |slave, reference, _| {
            Ok(slave.table[reference as usize].nominal)
        })
    }

    /// Sets the continuous states.
    ///
    /// # Errors
    /// [`Refused`] outside the continuous-time mode, for another number of states, and for values that are not finite.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Refused> {
        self.only_in("set states", &[Mode::Continuous])?;
        self.as_many_as_states("states", states.len())?;
        if let Some(value) = states.iter().find(|v| !v.is_finite()) {
            return Err(Refused::discard(format!(
                "a state is {value}, allowed is a finite number"
            )));
        }
        let rows: Vec<_> = self.state_rows().collect();
        for ((_, state), &value) in rows.into_iter().zip(states) {
            self.plant.set_state(state, value);
        }
        Ok(())
    }

    fn read_states(
        &mut self,
        what: &str,
        room: &mut [f64],
        read: impl Fn(&mut Self, u32, Quantity) -> Result<f64, Refused>,
    ) -> Result<(), Refused> {
        self.only_in(&format!("read {what}"), &READABLE)?;
        self.as_many_as_states(what, room.len())?;
        let rows: Vec<_> = self.state_rows().collect();
        for ((reference, state), value) in rows.into_iter().zip(room) {
            *value = read(self, reference, state)?;
        }
        Ok(())
    }

    fn as_many_as_states(&mut self, what: &str, found: usize) -> Result<(), Refused> {
        let allowed = self.states();
        if found == allowed {
            return Ok(());
        }
        self.failed(format!("{found} {what}, the arm has {allowed} states"))
    }
}
