//! `Rig`: an arm with everything that acts on it, as the core computes with it.

use arm_core::effect::{Effect, Kind};
use arm_core::{Chain, Contact, Elbow, Robot, Setup};
use pyo3::prelude::*;

use crate::arm::Arm;
use crate::errors::{bad_input, invalid};

/// An arm, its effects, its contact with the robot and the robot itself.
///
/// Parameters
/// ----------
/// arm : Arm
/// effects : list of (kind, index, values)
///     Zero-based joint, segment or channel; values in the order of the catalogue.
/// contact : ((float, float), (float, float))
///     Stiffness [N/m] and damping [N s/m] in y and z.
/// robot : ((float, float), (float, float), str), optional
///     Lengths [m], base [m], elbow "up" or "down".
#[pyclass(frozen, module = "armrs._armrs")]
pub struct Rig {
    pub arm: Py<Arm>,
    pub effects: Vec<Effect<f64>>,
    pub contact: Contact<f64>,
    pub robot: Option<Robot<f64>>,
}

type Pair = (f64, f64);

#[pymethods]
impl Rig {
    #[new]
    #[pyo3(signature = (arm, effects, contact, robot=None))]
    fn new(
        py: Python<'_>,
        arm: Py<Arm>,
        effects: Vec<(String, usize, Vec<f64>)>,
        contact: (Pair, Pair),
        robot: Option<(Pair, Pair, String)>,
    ) -> PyResult<Self> {
        let joints = arm.borrow(py).n_joints();
        let effects = effects
            .into_iter()
            .map(|(kind, index, values)| {
                let effect = Effect::new(Kind::named(&kind)?, index).with(&values);
                effect.validate(joints)?;
                Ok(effect)
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(invalid)?;
        let (stiffness, damping) = contact;
        let robot = robot
            .map(|(lengths, base, elbow)| {
                let elbow = match elbow.as_str() {
                    "up" => Elbow::Up,
                    "down" => Elbow::Down,
                    other => return Err(bad_input("robot elbow", other, "up or down")),
                };
                Robot::new(lengths.into(), base.into(), elbow).map_err(invalid)
            })
            .transpose()?;
        Ok(Self {
            arm,
            effects,
            contact: Contact::new(stiffness.into(), damping.into()),
            robot,
        })
    }
}

impl Rig {
    /// The rig without its effects.
    pub fn setup<const N: usize>(&self, chain: &Chain<f64, N>) -> Setup<f64, N> {
        Setup::new(chain, self.contact)
    }
}
