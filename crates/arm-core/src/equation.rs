//! The equation of motion as rows that are linear in what is not known: base parameters and effects.

use core::array::from_fn;

use crate::effect::{
    ActsOn, Effect, Motion, Place, States, advance_states, any_state, resisting_torque,
};
use crate::kinematics::to_links;
use crate::regressor::link_columns;
use crate::scalar::Real;
use crate::{Chain, Invalid, Joints, Pose, Scalar, check, joint_force, joints, static_torque};

/// What is known of an unknown before any data, and what it may never be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<T> {
    /// Value expected.
    pub mean: T,
    /// Its standard deviation; positive and finite.
    pub sd: T,
    /// Smallest value allowed; −∞ for none.
    pub min: T,
    /// Largest value allowed; ∞ for none.
    pub max: T,
}

impl<T: Real> Prior<T> {
    pub(crate) fn validate(&self, index: usize) -> Result<(), Invalid> {
        check::finite("expected value of unknown", index, self.mean)?;
        check::positive("standard deviation of unknown", index, self.sd)?;
        check::finite("standard deviation of unknown", index, self.sd)?;
        check::ordered("bound of unknown", index, [self.min, self.max])
    }
}

/// Standard deviation of an effect's parameter of which nothing is known, in its SI unit.
const OPEN: f64 = 10.0;

/// An arm with `E` effects as `P` unknowns: `X_1 … X_N, J_1 … J_N` of the [`Chain`], then the linear parameters of every
/// effect in turn, then places that stay unused.
///
/// Effects without a linear parameter are known torques, and so are normal moments and rotors. An effect that is switched
/// off is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equation<T, const N: usize, const P: usize, const E: usize> {
    chain: Chain<T, N>,
    effects: [Effect<T>; E],
    /// How many parameters of each effect are unknowns: the leading ones, see [`Info`](crate::effect::Info).
    linear: [usize; E],
    used: usize,
    feels_force: bool,
    /// Whether some effect has a state of its own.
    remembers: bool,
}

/// One row a joint: `columns · unknowns + known` is the torque that the motion needs \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needed<T, const N: usize, const P: usize> {
    /// Torque for each unit of each unknown.
    pub columns: [[T; P]; N],
    /// Torque of what is known.
    pub known: Joints<T, N>,
}

impl<T: Scalar, const N: usize, const P: usize> Needed<T, N, P> {
    /// No torque.
    #[inline]
    pub(crate) fn none() -> Self {
        Self {
            columns: [[T::ZERO; P]; N],
            known: joints([T::ZERO; N]),
        }
    }

    /// The torques at values of the unknowns \[N m\].
    #[inline]
    pub fn torque(&self, unknowns: &[T; P]) -> Joints<T, N> {
        self.torque_of(|i| unknowns[i])
    }

    /// The same of values that are asked for by the number of the unknown.
    #[inline]
    pub(crate) fn torque_of(&self, unknown: impl Fn(usize) -> T) -> Joints<T, N> {
        let mut sums = self.known;
        for i in 0..P {
            let value = unknown(i);
            for j in 0..N {
                sums[j] += self.columns[j][i] * value;
            }
        }
        sums
    }
}

/// What acts on an arm and was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<T, const N: usize> {
    /// Torques of motors in the joints \[N m\]; zero where there are none.
    pub torque: Joints<T, N>,
    /// Force on the arm at its tip \[N\].
    pub force_on_arm: [T; 2],
    /// Moment on the arm at its tip \[N m\].
    pub moment_on_arm: T,
}

impl<T: Scalar, const N: usize> Measured<T, N> {
    /// Nothing acts.
    pub fn none() -> Self {
        Self {
            torque: joints([T::ZERO; N]),
            force_on_arm: [T::ZERO; 2],
            moment_on_arm: T::ZERO,
        }
    }
}

impl<T: Scalar, const N: usize, const P: usize, const E: usize> Equation<T, N, P, E> {
    /// The unknowns of an arm; the values of chain and effects are what is expected of them.
    ///
    /// # Errors
    /// [`Invalid`] for an effect that does not suit the arm, and for more unknowns than `P`.
    pub fn new(chain: Chain<T, N>, effects: [Effect<T>; E]) -> Result<Self, Invalid> {
        let mut used = 2 * N;
        let mut leading = [0; E];
        for (effect, count) in effects.iter().zip(&mut leading).filter(|(e, _)| e.on) {
            effect.validate(N)?;
            // A rotor is an unknown like others: its column is the acceleration.
            if effect.kind.acts_on() != ActsOn::Joints && effect.kind.info().place != Place::Joint {
                return Err(Invalid::CannotAct {
                    kind: effect.kind.info().kind,
                });
            }
            *count = linear(effect).count();
            used += *count;
        }
        if used > P {
            return Err(Invalid::OutOfRange {
                name: "number of unknowns",
                index: 0,
                found: used as f64,
                min: 0.0,
                max: P as f64,
            });
        }
        Ok(Self {
            chain,
            effects,
            linear: leading,
            used,
            remembers: any_state(&effects),
            feels_force: effects.iter().any(|e| e.on && e.kind.feels_force()),
        })
    }

    /// The arm that is expected.
    pub fn chain(&self) -> &Chain<T, N> {
        &self.chain
    }
    /// The effects with the values expected of them.
    pub fn effects(&self) -> &[Effect<T>; E] {
        &self.effects
    }
    /// Whether an effect depends on the forces through the joints; otherwise they need not be computed.
    pub fn feels_force(&self) -> bool {
        self.feels_force
    }
    /// Number of unknowns in use; the others have no influence.
    pub fn used(&self) -> usize {
        self.used
    }

    /// What the arm as given says of its unknowns: base parameters from masses, centres of mass and inertias that are
    /// each uncertain by a relative standard deviation, effects about their values and otherwise open.
    pub fn priors(&self, uncertainty: T) -> [Prior<T>; P] {
        let infinite = T::of(f64::INFINITY);
        let unused = Prior {
            mean: T::ZERO,
            sd: T::ONE,
            min: -infinite,
            max: infinite,
        };
        let mut priors = [unused; P];
        let inertial = |mean: T, variance: T| Prior {
            mean,
            sd: uncertainty * variance.sqrt(),
            min: T::ZERO,
            max: infinite,
        };
        let mut next = priors.iter_mut();
        for second in [false, true] {
            for (j, s) in self.chain.segments.iter().enumerate() {
                let about_joint = s.inertia + s.mass * (s.com[0].squared() + s.com[1].squared());
                // Mass and centre of mass vary by themselves: their product by √2, an inertia about the joint by 2.
                let own = if second {
                    T::of(4.0) * about_joint.squared()
                } else {
                    T::of(2.0) * (s.mass * s.com[0]).squared()
                };
                let lever = if second { s.length.squared() } else { s.length };
                let beyond = self.chain.segments.iter().skip(j + 1);
                let variance = beyond.fold(own, |sum, d| sum + (lever * d.mass).squared());
                let mean = if second {
                    self.chain.j[j]
                } else {
                    self.chain.x[j]
                };
                if let Some(place) = next.next() {
                    *place = inertial(mean, variance);
                }
            }
        }
        let effects = self.effects.iter().filter(|e| e.on);
        for (prior, (mean, parameter)) in next.zip(effects.flat_map(linear)) {
            *prior = Prior {
                mean,
                sd: T::of(OPEN),
                min: T::of(parameter.min),
                max: T::of(parameter.max),
            };
        }
        priors
    }

    /// The arm and the effects with values in place of the unknowns.
    ///
    /// Of a chain only base parameters are known; the masses stay as they are, and centres of mass and inertias are
    /// moved so that the base parameters come out. Their gravity and motion are exact, the force in a bearing is not.
    pub fn with_values(&self, values: &[T; P]) -> (Chain<T, N>, [Effect<T>; E]) {
        let (mut chain, mut effects) = (self.chain, self.effects);
        let mut next = values.iter();
        for second in [false, true] {
            for j in 0..N {
                let Some(&value) = next.next() else { continue };
                let s = &mut chain.segments[j];
                if second {
                    s.inertia += value - chain.j[j];
                    chain.j[j] = value;
                } else {
                    let along = s.com[0] + (value - chain.x[j]) / s.mass;
                    s.inertia += s.mass * (s.com[0].squared() - along.squared());
                    s.com[0] = along;
                    chain.x[j] = value;
                }
            }
        }
        for effect in effects.iter_mut().filter(|e| e.on) {
            let parameters = effect.kind.info().parameters;
            for (value, _) in effect
                .parameters
                .iter_mut()
                .zip(parameters)
                .filter(|(_, p)| p.linear)
            {
                if let Some(&new) = next.next() {
                    *value = new;
                }
            }
        }
        (chain, effects)
    }

    /// The torques that a motion needs.
    ///
    /// * `motion` - without joint forces: they are taken from the arm as expected and from `measured`
    /// * `memory` - the states of each effect
    pub fn needed(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        measured: &Measured<T, N>,
    ) -> (Needed<T, N, P>, Joints<T, N>) {
        let mut rows = Needed::none();
        let acting = self.add_needed(motion, memory, measured, &mut rows);
        (rows, acting)
    }

    /// [`Equation::needed`], into rows that hold nothing yet; what acts.
    #[inline]
    pub(crate) fn add_needed(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        measured: &Measured<T, N>,
        rows: &mut Needed<T, N, P>,
    ) -> Joints<T, N> {
        let pose = Pose::new(&motion.q);
        self.add_inertial(&pose, [&motion.qd, &motion.qdd], rows);
        if self.feels_force() {
            self.add_effects_under_load(&pose, motion, memory, measured.force_on_arm, rows);
        } else {
            self.add_effects(motion, memory, rows);
        }
        let acting = static_torque(
            &self.chain,
            &pose,
            measured.force_on_arm,
            measured.moment_on_arm,
        );
        joints(from_fn(|j| acting[j] + measured.torque[j]))
    }

    /// The torques that carry the arm: its weight, and what its effects resist with at this motion. Inertia is left out.
    pub fn carrying(&self, motion: &Motion<T, N>, memory: &[States<T>; E]) -> Needed<T, N, P> {
        let mut rows = Needed::none();
        self.add_carrying(motion, memory, &mut rows);
        rows
    }

    /// [`Equation::carrying`], into rows that hold nothing yet.
    #[inline]
    pub(crate) fn add_carrying(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        rows: &mut Needed<T, N, P>,
    ) {
        // The regressor of an arm at rest.
        let pose = Pose::new(&motion.q);
        let [gy, gz] = self.chain.gravity;
        for k in 0..N {
            let x = gy * pose.sin[k] - gz * pose.cos[k];
            let h = (gy * pose.cos[k] + gz * pose.sin[k]) * self.chain.h[k];
            for j in 0..=k {
                rows.known[j] += h;
                if k < P {
                    rows.columns[j][k] = x;
                }
            }
        }
        self.add_effects(motion, memory, rows);
    }

    /// The states of the effects one period later, the motion taken as constant in it.
    /// No period and no speed makes a state run away, see [`advance_states`].
    pub fn advance(&self, motion: &Motion<T, N>, memory: &mut [States<T>; E], period: T) {
        if self.remembers {
            advance_states(&self.effects, (motion, motion), memory, period);
        }
    }

    #[inline(never)]
    fn add_inertial(
        &self,
        pose: &Pose<T, N>,
        [qd, qdd]: [&Joints<T, N>; 2],
        rows: &mut Needed<T, N, P>,
    ) {
        let moving = [&to_links(qd), &to_links(qdd)];
        for j in 0..N {
            rows.known[j] = self.chain.rotor[j] * qdd[j];
        }
        for k in 0..N {
            let [x, h, inertia] = link_columns(&self.chain, pose, moving, k);
            for (j, row) in rows.columns.iter_mut().enumerate() {
                for (place, column) in [(k, &x), (N + k, &inertia)] {
                    if let Some(place) = row.get_mut(place) {
                        *place = column[j];
                    }
                }
                rows.known[j] += h[j] * self.chain.h[k];
            }
        }
    }

    #[inline(never)]
    fn add_effects_under_load(
        &self,
        pose: &Pose<T, N>,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        force_on_arm: [T; 2],
        rows: &mut Needed<T, N, P>,
    ) {
        let moving = (&motion.qd, &motion.qdd);
        let force = joint_force(&self.chain, pose, moving, force_on_arm);
        self.add_effects(&motion.with_joint_force(&force), memory, rows);
    }

    #[inline(never)]
    fn add_effects(
        &self,
        motion: &Motion<T, N>,
        memory: &[States<T>; E],
        rows: &mut Needed<T, N, P>,
    ) {
        let mut column = 2 * N;
        for ((effect, &count), &state) in self.effects.iter().zip(&self.linear).zip(memory) {
            if !effect.on {
                continue;
            }
            if count == 0 {
                let one = core::slice::from_ref(effect);
                rows.known += resisting_torque(one, motion, &[state]);
            } else {
                effect.add_columns(motion, state, column, &mut rows.columns);
                column += count;
            }
        }
    }
}

/// Values and descriptions of the linear parameters of an effect.
fn linear<T: Scalar>(
    effect: &Effect<T>,
) -> impl Iterator<Item = (T, &'static crate::effect::Parameter)> {
    let parameters = effect.kind.info().parameters;
    let values = effect.parameters.into_iter().zip(parameters);
    values.filter(|(_, p)| p.linear)
}
