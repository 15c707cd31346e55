//! `Rig`: an arm with everything that acts on it, as the core computes with it.

use arm_core::effect::{Effect, MAX_STATES, Motion, Place, States, advance_states};
use arm_core::{Chain, Contact, Joints, Pose, Robot, Setup, joint_force};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arm::{AnyChain, Arm, each_length};
use crate::arrays::{Numbers, in_order};
use crate::custom_effects;
use crate::errors::invalid;
use crate::model;
use crate::row_kernels::joints;

/// A model as the core computes with it: the arm, its effects, its contact with the robot and the robot itself.
///
/// Parameters
/// ----------
/// model : Model
///     Where it states no contact, that of `Contact.assumed`.
/// effects : sequence of Effect, optional
///     What acts, in place of `model.all_effects`.
///
/// Raises
/// ------
/// BadInput
///     For an effect at a joint that the model does not have.
#[pyclass(frozen, module = "armrs._armrs")]
pub struct Rig {
    pub arm: Arm,
    pub effects: Vec<Effect<f64>>,
    pub contact: Contact<f64>,
    pub robot: Option<Robot<f64>>,
}

#[pymethods]
impl Rig {
    #[new]
    #[pyo3(signature = (model, effects=None))]
    fn new(model: &Bound<'_, PyAny>, effects: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let model = model::one("model", model, |m: &model::Model| m.inner().clone())?;
        let effects = match effects {
            Some(effects) => model::each("effects", effects, |e: &model::Effect| e.0.core())?,
            None => model.core_effects(),
        };
        Self::of(&model, effects)
    }

    /// Longest step with which the fourth-order method follows each effect's smooth dry friction at rest [s], the arm stretched.
    ///
    /// Infinite for effects without it.
    fn longest_steps(&self) -> Vec<f64> {
        each_length!(&self.arm.chain, c => {
            self.effects.iter().map(|effect| arm_sim::longest_step(c, effect)).collect()
        })
    }

    /// Torque with which each effect resists in its joint along a motion, shape (n, n_effects) [N m].
    ///
    /// Parameters
    /// ----------
    /// q, qd, qdd : array_like, shape (n, n_joints)
    ///     Motion of the joints at equal intervals [rad, rad/s, rad/s²].
    /// interval : float
    ///     Between two samples [s].
    ///
    /// Notes
    /// -----
    /// The load of the joints is that of the arm that moves freely: the force at the hand is not in it. Effects that act
    /// elsewhere than in joints have no torque.
    fn resisting<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        qd: Numbers<'py>,
        qdd: Numbers<'py>,
        interval: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let chain = &self.arm.chain;
        each_length!(chain, c => {
            let rows = self.arm.rows([("q", &q), ("qd", &qd), ("qdd", &qdd)])?;
            let mut along = Along::new(c, &self.effects, interval);
            let torques = in_order(py, rows, self.effects.len(), |[q, qd, qdd], out| {
                along.next(&joints(q), &joints(qd), &joints(qdd), out);
            })?;
            custom_effects::failed()?;
            Ok(torques)
        })
    }
}

/// Effects along a motion, sample by sample: those with a state of their own remember.
struct Along<'a, const N: usize> {
    chain: &'a Chain<f64, N>,
    effects: &'a [Effect<f64>],
    memory: Vec<States<f64>>,
    interval: f64,
    time: f64,
    /// Where the states stand.
    last: Option<Motion<f64, N>>,
}

impl<'a, const N: usize> Along<'a, N> {
    fn new(chain: &'a Chain<f64, N>, effects: &'a [Effect<f64>], interval: f64) -> Self {
        let memory = vec![[0.0; MAX_STATES]; effects.len()];
        Self {
            chain,
            effects,
            memory,
            interval,
            time: 0.0,
            last: None,
        }
    }

    fn next(
        &mut self,
        q: &Joints<f64, N>,
        qd: &Joints<f64, N>,
        qdd: &Joints<f64, N>,
        out: &mut [f64],
    ) {
        let through = joint_force(self.chain, &Pose::new(q), (qd, qdd), [0.0; 2]);
        let mut motion = Motion::new(self.time, *q, *qd).with_joint_force(&through);
        motion.qdd = *qdd;
        if let Some(before) = self.last.replace(motion) {
            let between = (&before, &motion);
            advance_states(self.effects, between, &mut self.memory, self.interval);
        }
        for ((effect, memory), out) in self.effects.iter().zip(&self.memory).zip(out) {
            let joint = effect.kind.info().place == Place::Joint;
            *out = if joint {
                effect.torque(&motion.local(effect.index, *memory))
            } else {
                0.0
            };
        }
        self.time += self.interval;
    }
}

impl Rig {
    /// The rig of a model, with these effects in place of its own.
    pub fn of(model: &arm_model::Model, effects: Vec<Effect<f64>>) -> PyResult<Self> {
        for effect in &effects {
            effect.validate(model.n_joints()).map_err(invalid)?;
        }
        let robot = model.robot.map(|robot| robot.core()).transpose();
        Ok(Self {
            arm: Arm::of(model)?,
            effects,
            contact: model.core_contact(),
            robot: robot.map_err(invalid)?,
        })
    }

    /// The rig without its effects.
    pub fn setup<const N: usize>(&self, chain: &Chain<f64, N>) -> Setup<f64, N> {
        Setup::new(chain, self.contact)
    }
}
