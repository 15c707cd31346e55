//! One step of an implicit-explicit Runge-Kutta method of second order: friction implicitly, all else explicitly.
//!
//! ARS(2,2,2) of Ascher, Ruuth, Spiteri 1997: both parts are of second order, the implicit one is L-stable, and the end of the step is its last stage, so
//! that a joint that sticks there rests exactly.

use arm_core::effect::States;
use arm_core::{Joints, Pose};
use nalgebra::SMatrix;

use super::friction::instant::{Arm, Friction, Mode};
use super::friction::{input_at, stop};
use super::implicit_friction::{ImplicitFriction, SmoothFriction, WithFriction};
use super::step::{Inputs, Memory};
use crate::closed_chain::model::Model;
use crate::closed_chain::stability::{MIDDLE, START};
use crate::closed_chain::state::{Input, Outcome, State};

/// Advances a state by one step of length `h`.
///
/// The implicit part is the speed in the angles, viscosity, and dry friction with its size and the inertia of the start of the step; what changes of them in the step is in the explicit part.
#[inline(never)]
pub(crate) fn imex<const N: usize>(
    model: &Model<f64, N>,
    h: f64,
    inputs: &Inputs<'_, f64, N>,
    (state, memory): (&mut State<f64, N>, &mut Memory<f64>),
) {
    let (q, qd) = (state.q, state.qd);
    let (start, dry) = match at_start(model, inputs.start, (&q, &qd), &memory.state) {
        Ok(found) => found,
        Err(ambiguous) => return stop(inputs.start.time, ambiguous, (state, memory)),
    };
    let mut smooth = core::mem::take(&mut memory.smooth);
    smooth.clear();
    let mut motion = inputs.start.motion(&q, &qd);
    motion.joint_force = start.joint_force;
    smooth.extend(SmoothFriction::among(
        &model.effects,
        &motion,
        &memory.state,
    ));
    let friction = ImplicitFriction {
        set_valued: Joints::from(dry.most),
        smooth: &smooth,
    };
    let reach = MIDDLE * h;
    let inertia = model.inertia(&Pose::new(&q));
    let viscosity = Joints::from_fn(|j, _| model.affine[j][2]);
    let rig = Rig {
        yielding: inertia
            .try_inverse()
            .unwrap_or_else(|| SMatrix::repeat(f64::NAN)),
        matrix: inertia / reach + SMatrix::from_diagonal(&viscosity),
        viscosity,
        friction,
    };
    let first = start.qdd + rig.yielding * (rig.rubbing(&qd) + dry.torque);
    let free = qd + first * reach;
    let middle = rig.end(&free, &qd);
    let held = (middle.speed - free) / reach;
    let place = q + middle.speed * reach;
    let input = input_at(inputs, h, MIDDLE);
    memory.advance_to_stage(model, reach, (inputs.start, &q, &qd), &start);
    let now = rig.at_stage(model, (&input, &place, &middle), memory.at_stage(model));
    memory.advance_to_end(
        model,
        [START, 1.0 - START].map(|w| w * h),
        (&input, &place, &middle.speed),
        &now.outcome,
    );
    let (early, late) = (h * START, h * (1.0 - START));
    let free = qd + first * early + now.explicit * late + held * (h - reach);
    let end = rig.end(&free, &middle.speed);
    state.qd = end.speed;
    state.q = q + middle.speed * (h - reach) + end.speed * reach;
    for (i, work) in state.work.iter_mut().enumerate() {
        *work += early * start.power[i] + late * now.outcome.power[i];
    }
    memory.smooth = smooth;
}

/// What follows from the state at the start of a step, and the set-valued friction in it; else the joint whose friction has no unique solution.
fn at_start<const N: usize>(
    model: &Model<f64, N>,
    input: &Input<f64, N>,
    moving: (&Joints<f64, N>, &Joints<f64, N>),
    memory: &[States<f64>],
) -> Result<(Outcome<f64, N>, Friction<f64, N>), (usize, f64)> {
    if !model.has_dry {
        let outcome = model.evaluate(input, moving.0, moving.1, memory);
        let none = Friction {
            torque: Joints::zeros(),
            most: [0.0; N],
        };
        return Ok((outcome, none));
    }
    let (_, solved) = Arm::at(model, input, moving).modes(memory, None);
    solved
        .ambiguous_friction
        .map_or(Ok((solved.outcome, solved.dry)), Err)
}

/// The implicit part of a step.
struct Rig<'a, const N: usize> {
    /// Accelerations per torque \[rad/(s² N m)\].
    yielding: SMatrix<f64, N, N>,
    /// Torque per change of speed in the time of a stage \[N m s/rad\].
    matrix: SMatrix<f64, N, N>,
    viscosity: Joints<f64, N>,
    friction: ImplicitFriction<'a, N>,
}

/// The middle stage.
struct Stage<const N: usize> {
    outcome: Outcome<f64, N>,
    /// Accelerations without the implicit part \[rad/s²\].
    explicit: Joints<f64, N>,
}

impl<const N: usize> Rig<'_, N> {
    /// Torques of viscosity and smooth friction at some speeds \[N m\].
    fn rubbing(&self, speed: &Joints<f64, N>) -> Joints<f64, N> {
        let viscous = self.viscosity.component_mul(speed);
        viscous + SmoothFriction::sum(self.friction.smooth, speed).0
    }

    /// Speeds at the end of a stage that would have the speeds `free` without friction.
    fn end(&self, free: &Joints<f64, N>, near: &Joints<f64, N>) -> WithFriction<N> {
        let lost = WithFriction {
            speed: Joints::repeat(f64::NAN),
            set_valued: Joints::zeros(),
            exact: false,
        };
        let viscous = -self.viscosity.component_mul(free);
        let found = self.friction.solve(&self.matrix, (free, &viscous), near);
        found.unwrap_or(lost)
    }

    /// What follows from the state at the middle stage.
    fn at_stage(
        &self,
        model: &Model<f64, N>,
        (input, q, at): (&Input<f64, N>, &Joints<f64, N>, &WithFriction<N>),
        memory: &[States<f64>],
    ) -> Stage<N> {
        let mut implicit = self.rubbing(&at.speed);
        let outcome = if model.has_dry {
            let modes = core::array::from_fn(|j| match (model.dry[j], at.speed[j]) {
                (false, _) => Mode::None,
                (true, 0.0) => Mode::Sticks,
                (true, speed) => Mode::Slips(speed.signum()),
            });
            let arm = Arm::at(model, input, (q, &at.speed));
            let solved = arm.solve(memory, (&modes, None));
            // The friction of a joint that sticks cancels; one that slips is corrected from its friction at the start of the step.
            implicit += Joints::from_fn(|j, _| match modes[j] {
                Mode::Sticks => solved.dry.torque[j],
                Mode::None | Mode::Slips(_) => at.set_valued[j],
            });
            solved.outcome
        } else {
            model.evaluate(input, q, &at.speed, memory)
        };
        Stage {
            explicit: outcome.qdd + self.yielding * implicit,
            outcome,
        }
    }
}
