//! Directional derivatives of outputs and rates, by differences of fourth order.

use crate::mode::Mode;
use crate::quantity::Quantity;
use crate::slave::Slave;
use crate::status::Refused;
use crate::variables::{Causality, Initial};

/// Largest change of a variable, relative to its nominal value. Rounding leaves about 1e-12 of a value, the formula 1e-16 of
/// what is smooth over the nominal value.
const CHANGE: f64 = 1e-4;

/// Places and weights of the central difference of fourth order.
const STENCIL: [(f64, f64); 4] = [
    (1.0, 8.0 / 12.0),
    (-1.0, -8.0 / 12.0),
    (2.0, -1.0 / 12.0),
    (-2.0, 1.0 / 12.0),
];

impl Slave {
    /// How outputs and time derivatives of states change with inputs and states, in the direction of `seed`; in the
    /// initialization also with parameters and start values.
    ///
    /// # Errors
    /// [`Refused`] when the slave is instantiated alone or in error, and for variables that are no unknowns or no knowns.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        derivative: &mut [f64],
    ) -> Result<(), Refused> {
        let modes = [
            Mode::Initialization,
            Mode::Step,
            Mode::Event,
            Mode::Continuous,
            Mode::Terminated,
        ];
        self.only_in("read directional derivatives", &modes)?;
        if unknowns.len() != derivative.len() || knowns.len() != seed.len() {
            return self.failed(
                "variables, seeds and directional derivatives differ in number".to_owned(),
            );
        }
        self.unknowns_and_knowns(unknowns, knowns)?;
        if let Some(value) = seed.iter().find(|v| !v.is_finite()) {
            return Err(Refused::discard(format!(
                "a seed is {value}, allowed is a finite number"
            )));
        }
        derivative.fill(0.0);
        let sizes = knowns.iter().zip(seed);
        let largest = sizes
            .map(|(&k, s)| s.abs() / self.table[k as usize].nominal)
            .fold(0.0, f64::max);
        if largest == 0.0 {
            return Ok(());
        }
        self.prepared()?;
        let (step, before) = (CHANGE / largest, self.state());
        let mut result = Ok(());
        for (place, weight) in STENCIL {
            result = self.moved(knowns, seed, place * step).and_then(|()| {
                for (&unknown, sum) in unknowns.iter().zip(derivative.iter_mut()) {
                    *sum += weight / step * self.value(unknown)?;
                }
                Ok(())
            });
            self.set_state(&before)?;
            if result.is_err() {
                break;
            }
        }
        result
    }

    fn unknowns_and_knowns(&mut self, unknowns: &[u32], knowns: &[u32]) -> Result<(), Refused> {
        let starting = self.mode == Mode::Initialization;
        let find = |table: &[crate::variables::Variable], &r: &u32| table.get(r as usize).cloned();
        for reference in unknowns {
            let known = find(&self.table, reference);
            let computed = known
                .is_some_and(|v| v.causality == Causality::Output || v.quantity.state().is_some());
            if !computed {
                return self.failed(format!(
                    "the value reference {reference} is not that of an output or a derivative"
                ));
            }
        }
        for reference in knowns {
            let known = find(&self.table, reference);
            let free = known.is_some_and(|v| {
                let exact = v.initial == Some(Initial::Exact);
                let at_start =
                    exact && matches!(v.causality, Causality::Parameter | Causality::Output);
                v.causality == Causality::Input
                    || if starting {
                        at_start
                    } else {
                        v.quantity.is_state()
                    }
            });
            if !free {
                return self.failed(format!(
                    "the value reference {reference} is not that of an input, a state, or in the initialization a start value"
                ));
            }
        }
        Ok(())
    }

    /// Changes what is known.
    fn moved(&mut self, knowns: &[u32], seed: &[f64], by: f64) -> Result<(), Refused> {
        let starting = self.mode == Mode::Initialization;
        for (&reference, &share) in knowns.iter().zip(seed) {
            let at = reference as usize;
            let (quantity, is_input) = {
                let v = &self.table[at];
                (v.quantity, v.causality == Causality::Input)
            };
            if is_input {
                self.values[at] += share * by;
                self.plant.set_input(quantity, self.values[at]);
            } else if starting {
                self.values[at] += share * by;
                self.stale = true;
            } else {
                self.move_state(quantity, share * by);
            }
        }
        Ok(())
    }

    fn move_state(&mut self, quantity: Quantity, by: f64) {
        let now = self.plant.output(quantity);
        self.plant.set_state(quantity, now + by);
    }
}
