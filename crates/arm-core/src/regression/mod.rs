//! The equation of motion as rows that are linear in what is not known: base parameters and effects.

mod rows;
mod torques;

use crate::effect::{
    ActsOn, Effect, Kind, Motion, Parameter, Place, States, advance_states, any_state,
};
use crate::numeric::scalar::Real;
use crate::{Chain, Invalid, Joints, Scalar, check, joints};

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
    /// The first unknown of each effect, see [`Info`](crate::effect::Info).
    first: [u8; E],
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

    /// The same of values by the number of the unknown.
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
        let mut first = [0; E];
        for (effect, first) in effects.iter().zip(&mut first).filter(|(e, _)| e.on) {
            effect.validate(N)?;
            // A rotor is an unknown like others: its column is the acceleration.
            if effect.kind.acts_on() != ActsOn::Joints && effect.kind.info().place != Place::Joint {
                return Err(Invalid::CannotAct {
                    kind: effect.kind.info().kind,
                });
            }
            *first = used as u8;
            used += linear(effect).count();
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
            first,
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
    /// Whether some effect has states of its own, which [`Equation::advance`] carries on.
    pub fn remembers(&self) -> bool {
        self.remembers
    }
    /// Number of unknowns in use; the others have no influence.
    pub fn used(&self) -> usize {
        self.used
    }

    /// Priors of the unknowns from the arm as given: base parameters from masses, centres of mass and inertias that are
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

    /// The states of the effects one period later, the motion taken as constant in it.
    /// A state stays bounded at any period and speed, see [`advance_states`].
    pub fn advance(&self, motion: &Motion<T, N>, memory: &mut [States<T>; E], period: T) {
        if self.remembers {
            advance_states(&self.effects, (motion, motion), memory, period);
        }
    }
}

/// Values and descriptions of the linear parameters of an effect; a user-defined law has none that are fitted.
fn linear<T: Scalar>(effect: &Effect<T>) -> impl Iterator<Item = (T, &'static Parameter)> {
    let fitted = !matches!(effect.kind, Kind::Custom(_));
    let values = effect
        .parameters
        .into_iter()
        .zip(effect.kind.info().parameters);
    values.filter(move |(_, p)| fitted && p.linear)
}
