//! Steps in which no joint starts or stops slipping, of one run or of several in lanes.

use core::array::from_fn;

use arm_core::effect::States;
use arm_core::{Joints, Pose, Resistance, Scalar};

use super::hold::hold;
use super::instant::{Friction, reserve};
use crate::closed_chain::model::Model;
use crate::closed_chain::state::{Input, Outcome, State, difference, powers, sum};
use crate::integrators::step::{Evaluate, Inputs, Memory, rk4_by_calls};

/// Speed against the direction of slip that is rounding \[rad/s\].
pub(super) const STILL: f64 = 1e-13;

/// Makes a step of Rk4 for a rig with [simple friction](Model::has_simple_friction) if no joint changes between slipping and sticking.
///
/// Returns 1 where it is made, with the bits of a step that looks for switches and finds none, and −1 where it is not: there the
/// state is invalid, and the step has to be repeated from the state before.
#[inline(always)]
pub(crate) fn steady<T: Scalar, const N: usize>(
    model: &Model<T, N>,
    h: f64,
    inputs: Inputs<T, N>,
    (state, memory): (&mut State<T, N>, &mut Memory<T>),
) -> T {
    let mut rig = Steady::new(model, &state.qd);
    rk4_by_calls(model, (h, inputs), (state, memory), &mut rig);
    rig.settle(&mut state.qd)
}

/// A rig with the modes of its joints fixed for one step.
struct Steady<'a, T, const N: usize> {
    model: &'a Model<T, N>,
    /// Direction in which a joint slips, 1 or −1; else 0.
    ways: Joints<T, N>,
    /// 1 for a joint that sticks, else 0.
    sticks: [T; N],
    any_sticks: bool,
    /// Evaluations so far.
    stage: usize,
    /// See [`steady`].
    made: T,
}

impl<'a, T: Scalar, const N: usize> Steady<'a, T, N> {
    #[inline(always)]
    fn new(model: &'a Model<T, N>, qd: &Joints<T, N>) -> Self {
        let (mut ways, mut sticks) = (Joints::<T, N>::repeat(T::ZERO), [T::ZERO; N]);
        for j in 0..N {
            if model.dry[j] {
                let way = T::if_less(qd[j], T::ZERO, -T::ONE, T::ONE);
                sticks[j] = T::if_less(T::ZERO, qd[j].abs(), T::ZERO, T::ONE);
                ways[j] = T::if_less(T::ZERO, sticks[j], T::ZERO, way);
            }
        }
        Self {
            model,
            ways,
            any_sticks: !sticks
                .iter()
                .all(|sticks| sticks.every(|sticks| sticks == 0.0)),
            sticks,
            stage: 0,
            made: T::ONE,
        }
    }

    /// Dry friction of joints that stick, which cancels their accelerations \[N m\].
    ///
    /// * `most` - what it can be at most \[N m\]
    #[inline(always)]
    fn hold(
        &mut self,
        resistance: &Resistance<T, N>,
        qdd: &mut Joints<T, N>,
        most: &[T; N],
    ) -> Joints<T, N> {
        let mut columns = [Joints::<T, N>::repeat(T::ZERO); N];
        for j in 0..N {
            if !self.sticks[j].every(|sticks| sticks == 0.0) {
                columns[j] = resistance.column(j);
            }
        }
        let own = from_fn(|j| columns[j][j]);
        let (torque, held) = hold(&columns, &own, from_fn(|j| qdd[j]), &self.sticks);
        for k in 0..N {
            for i in 0..N {
                qdd[i] -= torque[k] * columns[k][i];
            }
        }
        for j in 0..N {
            qdd[j] = T::if_less(T::ZERO, held[j], T::ZERO, qdd[j]);
        }
        // The limit of friction is checked at the start and at the end of the step only.
        if self.stage == 0 || self.stage == 3 {
            let most = *most;
            let friction = Friction { torque, most };
            for j in 0..N {
                let beyond = T::if_less(reserve(&friction, j), T::ZERO, -T::ONE, self.made);
                let made = T::if_less(T::ZERO, held[j], beyond, -T::ONE);
                self.made = T::if_less(T::ZERO, self.sticks[j], made, self.made);
            }
        }
        torque
    }

    /// Ends the step: speeds that rounding carried past zero, and those of joints that stick, are zero.
    #[inline(always)]
    fn settle(&self, qd: &mut Joints<T, N>) -> T {
        let mut made = self.made;
        for j in 0..N {
            if self.model.dry[j] {
                let speed = self.ways[j] * qd[j];
                let slipped = T::if_less(-T::of(STILL), speed, made, -T::ONE);
                made = T::if_less(T::ZERO, self.sticks[j], made, slipped);
                let still = T::if_less(speed, T::ZERO, T::ZERO, qd[j]);
                qd[j] = T::if_less(T::ZERO, self.sticks[j], T::ZERO, still);
            }
        }
        made
    }
}

impl<T: Scalar, const N: usize> Evaluate<T, N> for Steady<'_, T, N> {
    #[inline(always)]
    fn evaluate(
        &mut self,
        input: &Input<T, N>,
        (q, qd): (&Joints<T, N>, &Joints<T, N>),
        memory: &[States<T>],
    ) -> Outcome<T, N> {
        let model = self.model;
        let pose = Pose::new(q);
        let motion = input.motion(q, qd);
        let resisting = model.resisting(&motion, memory);
        let most = model.dry_friction(&motion, memory);
        let mut dry = self.ways;
        for j in 0..N {
            dry[j] = self.ways[j] * most[j];
        }
        let (force, lost) = model.contact(input, q, qd, &pose);
        let driving = model.driving(input, &pose);
        let net = difference(&difference(&driving, &resisting), &dry);
        let load = model.load(&pose, &net, force);
        let resistance = Resistance::at(&model.products, &pose, qd);
        let mut qdd = resistance.accelerations(&model.products, &pose, &load);
        if self.any_sticks {
            dry = sum(&self.hold(&resistance, &mut qdd, &most), &dry);
        }
        self.stage += 1;
        let v = model.velocity_of_force(input, qd, &pose);
        Outcome {
            qdd,
            force_on_arm: force,
            power: powers((force, v), [&driving, &sum(&resisting, &dry)], qd, lost),
            joint_force: motion.joint_force,
        }
    }
}

#[cfg(test)]
mod tests {
    use arm_core::effect::{Effect, Kind};

    use super::super::switching;
    use super::*;
    use crate::preparation::prepared_run::Prepared;
    use crate::sample_experiments;

    /// Along a movement most steps are steady, some of them with joints that stick.
    #[test]
    fn a_steady_step_has_the_bits_of_one_that_looks_for_switches() {
        let mut experiment = sample_experiments::human_experiment(4.0, [0.0; 3]).expect("a sample");
        experiment.effects.extend([
            Effect::new(Kind::Coulomb, 0).with(&[0.3, 0.0]),
            Effect::new(Kind::Coulomb, 2).with(&[0.1, 0.0]),
            Effect::new(Kind::Relaxation, 1).with(&[1.0]),
        ]);
        let run = Prepared::new(&experiment).expect("valid");
        assert!(run.model.has_simple_friction() && run.model.has_memory);
        let (q, qd) = run.start;
        let work = [0.0; 4];
        let mut state = State { q, qd, work };
        let mut memory = Memory::new(run.model.effects.len());
        let (mut slipping, mut sticking, mut switched) = (0, 0, 0);
        for step in 0..run.schedule.steps {
            let half = |half| run.input(run.schedule.half_time(2 * step + half));
            let [start, middle, end] = [half(0), half(1), half(2)];
            let (start, middle, end) = (&start, &middle, &end);
            let inputs = Inputs { start, middle, end };
            let (mut other, mut its_memory) = (state, memory.clone());
            let made = steady(
                &run.model,
                run.schedule.dt,
                inputs,
                (&mut other, &mut its_memory),
            );
            switching(
                &run.model,
                run.schedule.dt,
                &inputs,
                (&mut state, &mut memory),
            );
            if made > 0.0 {
                let sticks = state.qd[0] == 0.0 || state.qd[2] == 0.0;
                *(if sticks { &mut sticking } else { &mut slipping }) += 1;
                assert_eq!(
                    (state.q, state.qd, state.work),
                    (other.q, other.qd, other.work)
                );
                assert_eq!(memory.state, its_memory.state);
            } else {
                switched += 1;
            }
        }
        let counts = [slipping, sticking, switched];
        assert!(
            slipping > 1000 && sticking > 1000 && switched > 3,
            "{counts:?}"
        );
    }
}
