use core::cmp::Ordering;
use core::fmt;
use core::hash::{Hash, Hasher};

use super::law::{Info, Local, MAX_PARAMETERS, MAX_STATES, Parameters, States};
use super::prior::Prior;
use crate::Scalar;

/// The law of a joint effect that the catalogue does not hold.
///
/// It is simulated, searched for and refitted like those of the catalogue. It computes in double precision, whatever the
/// precision of the run.
///
/// ```
/// use arm_core::effect::{Effect, Info, Kind, Local, CustomEffect, CustomLaw, Parameter, Parameters, Place};
///
/// /// Small magnets hold the joint at equal distances.
/// struct Detent;
///
/// impl CustomLaw for Detent {
///     fn info(&self) -> &'static Info {
///         const INFO: Info = Info {
///             kind: "detent",
///             place: Place::Joint,
///             summary: "moment of magnets at equal angles",
///             formula: "R = height · sin(q/pitch)",
///             reference: "the data sheet",
///             parameters: &[
///                 Parameter::linear("height", "N m", 0.0, 10.0, 0.0),
///                 Parameter::shape("pitch", "rad", 0.01, 1.0, 0.1),
///             ],
///             states: 0,
///         };
///         &INFO
///     }
///     fn torque(&self, p: &Parameters<f64>, at: &Local<f64>) -> f64 {
///         p[0] * libm::sin(at.q / p[1])
///     }
/// }
///
/// static DETENT: Detent = Detent;
/// let kind = Kind::Custom(CustomEffect::new(&DETENT));
/// let effect = Effect::<f64>::new(kind, 1).with(&[0.2]);
/// assert_eq!(effect.validate(2), Ok(()));
/// assert_eq!(effect.torque(&Local::moving(0.05, 0.0)), 0.2 * libm::sin(0.5));
/// ```
pub trait CustomLaw: Sync {
    /// Name, parameters, formula and reference; parameters in which the torque is linear come first.
    fn info(&self) -> &'static Info;
    /// What is known of it before any data.
    fn prior(&self) -> Prior {
        Prior::FIRST
    }
    /// Whether it depends on [`Local::joint_force`].
    fn feels_force(&self) -> bool {
        false
    }
    /// Torque with which the joint resists \[N m\].
    fn torque(&self, p: &Parameters<f64>, at: &Local<f64>) -> f64;
    /// Time derivatives of the effect's own states, for a law that has some.
    fn memory_rate(&self, _p: &Parameters<f64>, _at: &Local<f64>) -> States<f64> {
        [0.0; MAX_STATES]
    }
}

/// A user-defined kind: a law that outlives every run. Two are the same when their names are.
#[derive(Clone, Copy)]
pub struct CustomEffect(&'static dyn CustomLaw);

impl CustomEffect {
    /// A kind with a law.
    pub const fn new(law: &'static dyn CustomLaw) -> Self {
        Self(law)
    }

    pub(super) fn info(self) -> &'static Info {
        self.0.info()
    }

    pub(super) fn prior(self) -> Prior {
        self.0.prior()
    }

    pub(super) fn feels_force(self) -> bool {
        self.0.feels_force()
    }

    /// Evaluates a function of the law for every lane of a number.
    fn each<T: Scalar>(
        p: &Parameters<T>,
        at: &Local<T>,
        f: impl Fn(&Parameters<f64>, &Local<f64>) -> f64,
    ) -> T {
        const SEEN: usize = MAX_PARAMETERS + 7;
        const ALL: usize = SEEN + MAX_STATES;
        let mut values = [T::ZERO; ALL];
        values[..MAX_PARAMETERS].copy_from_slice(p);
        values[MAX_PARAMETERS..SEEN].copy_from_slice(&[
            at.time,
            at.q,
            at.qd,
            at.qdd,
            at.proximal_q,
            at.joint_force,
            at.activity,
        ]);
        values[SEEN..].copy_from_slice(&at.memory);
        T::together(values, |v: [f64; ALL]| {
            let mut p = [0.0; MAX_PARAMETERS];
            p.copy_from_slice(&v[..MAX_PARAMETERS]);
            let [time, q, qd, qdd, proximal_q, joint_force, activity] =
                core::array::from_fn(|k| v[MAX_PARAMETERS + k]);
            let at = Local {
                time,
                q,
                qd,
                qdd,
                proximal_q,
                joint_force,
                activity,
                memory: core::array::from_fn(|k| v[SEEN + k]),
            };
            f(&p, &at)
        })
    }

    pub(super) fn torque<T: Scalar>(self, p: &Parameters<T>, at: &Local<T>) -> T {
        Self::each(p, at, |p, at| self.0.torque(p, at))
    }

    pub(super) fn memory_rate<T: Scalar>(self, p: &Parameters<T>, at: &Local<T>) -> States<T> {
        core::array::from_fn(|k| Self::each(p, at, |p, at| self.0.memory_rate(p, at)[k]))
    }
}

impl fmt::Debug for CustomEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Custom({})", self.0.info().kind)
    }
}

impl PartialEq for CustomEffect {
    fn eq(&self, other: &Self) -> bool {
        self.0.info().kind == other.0.info().kind
    }
}

impl Eq for CustomEffect {}

impl Hash for CustomEffect {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.info().kind.hash(state);
    }
}

impl PartialOrd for CustomEffect {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for CustomEffect {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.info().kind.cmp(other.0.info().kind)
    }
}
