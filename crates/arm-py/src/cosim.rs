//! The arm as a co-simulation slave; see `armrs.cosim`.

use arm_core::Chain;
use arm_cosim::{ArmSpec, Fmi, Initial, Refused, Slave, SlaveState, Variable};
use arm_sim::{Port, SimulationError};
use numpy::{PyArray1, PyReadonlyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arm::{AnyChain, each_length};
use crate::errors::{bad_input, slave};
use crate::rig::Rig;

/// How an arm is coupled and where it starts.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Coupling {
    name: String,
    /// "force" or "motion".
    port: String,
    step: f64,
    q: Vec<f64>,
    qd: Vec<f64>,
    /// The robot's handle at the start [m]; at the arm's tip when absent.
    handle: Option<[f64; 2]>,
    /// Whether it starts in equilibrium near `q`.
    rest: bool,
}

impl Coupling {
    fn spec(&self, rig: &Rig) -> PyResult<ArmSpec> {
        let port = match self.port.as_str() {
            "force" => Port::Force,
            "motion" => Port::Motion,
            other => return Err(bad_input("port", other, "force or motion")),
        };
        fn of<const N: usize>(chain: &Chain<f64, N>, rig: &Rig, name: &str, port: Port) -> ArmSpec {
            ArmSpec::new(name, port, &rig.setup(chain), &rig.effects)
        }
        let mut spec = each_length!(&rig.arm.chain, c => of(c, rig, &self.name, port));
        let joints = spec.joints();
        for (name, values) in [("start angles", &self.q), ("start speeds", &self.qd)] {
            if values.len() != joints {
                let found = format!("{} values", values.len());
                return Err(bad_input(name, found, &format!("{joints}, one a joint")));
            }
        }
        spec.step = self.step;
        (spec.start.q, spec.start.qd) = (self.q.clone(), self.qd.clone());
        match self.handle {
            Some(handle) => spec.start.handle = handle,
            None => spec = spec.with_handle_at_tip().map_err(refused)?,
        }
        if !self.rest {
            return Ok(spec);
        }
        spec.at_rest().map_err(|error| match error {
            SimulationError::NoEquilibrium(why) => {
                bad_input("start", why, "angles near which the arm can rest")
            }
            other => refused(other.into()),
        })
    }
}

/// A refusal before there is a slave.
fn refused(refused: Refused) -> PyErr {
    bad_input("arm", refused.message, "an arm that can be simulated")
}

/// A state of a slave.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct ArmState {
    state: SlaveState,
}

/// The compiled part of `armrs.cosim.Slave`.
#[pyclass(module = "armrs._armrs")]
pub struct ArmSlave {
    slave: Slave,
}

#[pymethods]
impl ArmSlave {
    #[new]
    fn new(rig: &Rig, coupling: Coupling) -> PyResult<Self> {
        let slave = Slave::new(coupling.spec(rig)?).map_err(refused)?;
        Ok(Self { slave })
    }

    #[getter]
    fn token(&self) -> &str {
        self.slave.token()
    }

    /// The arm as it travels in `resources/arm.json`.
    #[getter]
    fn json(&self) -> PyResult<String> {
        self.slave.spec().to_json().map_err(refused)
    }

    #[getter]
    fn mode(&self) -> &'static str {
        self.slave.mode().name()
    }

    #[getter]
    fn time(&self) -> f64 {
        self.slave.time()
    }

    fn variables<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let rows = self.slave.variables().iter().enumerate();
        rows.map(|(reference, v)| row(py, reference, v)).collect()
    }

    /// `modelDescription.xml` of FMI 2 or 3, and for 3 `terminalsAndIcons.xml`.
    fn description(&self, fmi: u32) -> PyResult<(String, Option<String>)> {
        let spec = self.slave.spec();
        let version = match fmi {
            2 => Fmi::Two,
            3 => Fmi::Three,
            other => return Err(bad_input("fmi", other, "2 or 3")),
        };
        let terminals = match version {
            Fmi::Two => None,
            Fmi::Three => Some(arm_cosim::terminals(spec).map_err(refused)?),
        };
        let description = arm_cosim::model_description(spec, version).map_err(refused)?;
        Ok((description, terminals))
    }

    #[pyo3(signature = (start, stop=None))]
    fn enter_initialization_mode(&mut self, start: f64, stop: Option<f64>) -> PyResult<()> {
        let done = self.slave.enter_initialization_mode(start, stop);
        done.map_err(|e| slave("enter_initialization_mode", e))
    }

    fn exit_initialization_mode(&mut self) -> PyResult<()> {
        let done = self.slave.exit_initialization_mode();
        done.map_err(|e| slave("exit_initialization_mode", e))
    }

    fn set(&mut self, references: Vec<u32>, values: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let values = values.as_array().to_vec();
        self.slave
            .set(&references, &values)
            .map_err(|e| slave("set", e))
    }

    fn get<'py>(
        &mut self,
        py: Python<'py>,
        references: Vec<u32>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut values = vec![0.0; references.len()];
        self.slave
            .get(&references, &mut values)
            .map_err(|e| slave("get", e))?;
        Ok(values.to_pyarray(py))
    }

    fn output_derivatives<'py>(
        &mut self,
        py: Python<'py>,
        references: Vec<u32>,
        orders: Vec<i32>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut values = vec![0.0; references.len()];
        let done = self
            .slave
            .output_derivatives(&references, &orders, &mut values);
        done.map_err(|e| slave("get_output_derivatives", e))?;
        Ok(values.to_pyarray(py))
    }

    fn do_step(&mut self, py: Python<'_>, time: f64, step: f64) -> PyResult<()> {
        let done = py.detach(|| self.slave.do_step(time, step));
        done.map_err(|e| slave("do_step", e))
    }

    fn terminate(&mut self) -> PyResult<()> {
        self.slave.terminate().map_err(|e| slave("terminate", e))
    }

    fn reset(&mut self) -> PyResult<()> {
        self.slave.reset().map_err(|e| slave("reset", e))
    }

    fn state(&self) -> ArmState {
        ArmState {
            state: self.slave.state(),
        }
    }

    fn set_state(&mut self, state: &ArmState) -> PyResult<()> {
        let done = self.slave.set_state(&state.state);
        done.map_err(|e| slave("set_state", e))
    }

    #[staticmethod]
    fn serialize<'py>(py: Python<'py>, state: &ArmState) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &state.state.to_bytes())
    }

    #[staticmethod]
    fn deserialize(bytes: &[u8]) -> PyResult<ArmState> {
        let state = SlaveState::from_bytes(bytes);
        let state = state.map_err(|e| slave("deserialize_state", e))?;
        Ok(ArmState { state })
    }
}

fn row<'py>(py: Python<'py>, reference: usize, v: &Variable) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    let unit = arm_cosim::unit(v.unit);
    row.set_item("name", &v.name)?;
    row.set_item("reference", reference)?;
    row.set_item("causality", v.causality.name())?;
    row.set_item("variability", v.variability.name())?;
    row.set_item(
        "initial",
        v.initial.map(|initial| match initial {
            Initial::Exact => "exact",
            Initial::Calculated => "calculated",
        }),
    )?;
    row.set_item("unit", unit.as_ref().map(|u| u.name.clone()))?;
    row.set_item("exponents", unit.map(|u| u.exponents.to_vec()))?;
    row.set_item("start", v.start)?;
    let (min, max) = v.range;
    row.set_item("min", min.is_finite().then_some(min))?;
    row.set_item("max", max.is_finite().then_some(max))?;
    row.set_item("nominal", v.nominal)?;
    row.set_item("description", &v.description)?;
    Ok(row)
}
