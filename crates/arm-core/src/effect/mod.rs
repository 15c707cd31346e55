//! Effects: everything that can act on the arm and everything that can distort what is seen of it.
//!
//! A kind of effect is a [`Law`] in a file of its own: its name, its parameters with units and bounds, its formula, and
//! what it does. An [`Effect`] is one instance: a kind at a joint, segment or channel, with values. Everything outside
//! this folder works on `Effect`s and never names a kind.
//!
//! To add a kind, write its file and add one line to the `catalogue!` below. A user-defined kind that needs no place in the
//! catalogue is an `CustomLaw` (feature `custom-effects`).

mod law;
// Firmware has the catalogue alone, without code for declared kinds.
#[cfg_attr(not(feature = "custom-effects"), path = "custom_effect_absent.rs")]
mod custom_effect;
mod place;
mod prior;
mod state;

pub use custom_effect::CustomEffect;
#[cfg(feature = "custom-effects")]
pub use custom_effect::CustomLaw;
pub use law::{
    ActsOn, Info, Law, Local, MAX_PARAMETERS, MAX_STATES, Parameter, Parameters, States,
};
pub use place::Place;
pub use prior::{Family, Nature, Part, Prior, Promise, Values};
pub use state::{advance_states, any_state};

use crate::{Chain, Contact, Invalid, Joints, Plane, Reading, Scalar, Setup, joints};

/// Declares the kinds: their modules, the enum, and the dispatch to each [`Law`].
macro_rules! catalogue {
    ($($module:ident :: $law:ident),* $(,)?) => {
        $(mod $module;)*

        /// A kind of effect: one of the catalogue, or one of a user's own.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Kind {
            $(#[doc = concat!("See `effect/", stringify!($module), ".rs`.")] $law,)*
            /// One that the catalogue does not hold.
            Custom(CustomEffect),
        }

        /// All kinds of the catalogue, in the order in which they are listed.
        pub const KINDS: &[Kind] = &[$(Kind::$law),*];

        impl Kind {
            /// Name, parameters, formula and reference.
            pub fn info(self) -> &'static Info {
                match self { $(Self::$law => const { &listed(<$module::$law as Law>::INFO) },)* Self::Custom(own) => own.info() }
            }
        }

        impl Kind {
            /// What is known of it before any data.
            pub fn prior(self) -> Prior {
                match self { $(Self::$law => <$module::$law as Law>::PRIOR,)* Self::Custom(own) => own.prior() }
            }
            /// What it is called in a sentence, where that is not its kind with spaces.
            pub const fn title(self) -> Option<&'static str> {
                match self { $(Self::$law => <$module::$law as Law>::TITLE,)* Self::Custom(_) => None }
            }
            /// What it acts on.
            pub const fn acts_on(self) -> ActsOn {
                match self { $(Self::$law => <$module::$law as Law>::ACTS_ON,)* Self::Custom(_) => ActsOn::Joints }
            }
            /// The family of effects that it belongs to.
            pub fn family(self) -> Family {
                self.prior().family.unwrap_or(Family::of_place(self.info().place))
            }
            /// Whether it also acts in the joint before, so that it cannot stand at the first one.
            pub const fn crosses(self) -> bool {
                match self { $(Self::$law => <$module::$law as Law>::CROSSES,)* Self::Custom(_) => false }
            }
            /// Whether its torque is a constant, or one whose sign alone follows the motion.
            pub const fn is_rate_independent(self) -> bool {
                match self { $(Self::$law => <$module::$law as Law>::RATE_INDEPENDENT,)* Self::Custom(_) => false }
            }
            /// Position of the parameter that makes its dry friction smooth, if it has any.
            pub const fn smoothed_by(self) -> Option<usize> {
                match self { $(Self::$law => <$module::$law as Law>::SMOOTHED_BY,)* Self::Custom(_) => None }
            }
            /// Whether it depends on the force through the joint.
            pub fn feels_force(self) -> bool {
                match self { $(Self::$law => <$module::$law as Law>::FEELS_FORCE,)* Self::Custom(own) => own.feels_force() }
            }
            /// Whether it depends on the activity of muscles, which must be given.
            pub const fn feels_activity(self) -> bool {
                match self { $(Self::$law => <$module::$law as Law>::FEELS_ACTIVITY,)* Self::Custom(_) => false }
            }
            /// Whether it acts on the rig or the sensors, or depends on more than the motion of an arm.
            pub fn needs_more_than_an_arm(self) -> bool {
                matches!(self.acts_on(), ActsOn::Rig | ActsOn::Sensors) || self.feels_activity()
            }
        }

        impl<T: Scalar> Effect<T> {
            /// Torque with which the joint resists \[N m\].
            #[inline]
            pub fn torque(&self, at: &Local<T>) -> T {
                if !self.on { return T::ZERO; }
                match self.kind {
                    $(Kind::$law => $module::$law::torque(&self.parameters, at),)*
                    Kind::Custom(own) => own.torque(&self.parameters, at),
                }
            }
            /// `[constant, to the angle, to the speed]` of the torque, where it is no more than that.
            pub fn affine(&self) -> Option<[T; 3]> {
                if !self.on { return None; }
                match self.kind { $(Kind::$law => $module::$law::affine(&self.parameters),)* Kind::Custom(_) => None }
            }
            /// Whether it is a constant moment, which is what the rest angle of a spring in its joint stands for too.
            pub fn is_constant(&self) -> bool {
                self.kind.is_rate_independent() && self.affine().is_some()
            }
            /// Largest torque of its dry friction: what it resists with in motion, and holds at most at rest \[N m\].
            #[inline]
            pub fn dry(&self, at: &Local<T>) -> T {
                if !self.on { return T::ZERO; }
                match self.kind { $(Kind::$law => $module::$law::dry(&self.parameters, at),)* Kind::Custom(_) => T::ZERO }
            }
            /// Its torque without dry friction \[N m\].
            #[inline]
            pub fn besides_dry(&self, at: &Local<T>) -> T {
                match self.kind { $(Kind::$law => $module::$law::besides_dry(&self.parameters, at),)* Kind::Custom(_) => T::ZERO }
            }
            /// Derivatives of [`Effect::torque`] to the parameters.
            #[inline]
            pub fn gradient(&self, at: &Local<T>) -> Parameters<T> {
                if !self.on { return [T::ZERO; MAX_PARAMETERS]; }
                match self.kind {
                    $(Kind::$law => $module::$law::gradient(&self.parameters, at),)*
                    Kind::Custom(_) => [T::ZERO; MAX_PARAMETERS],
                }
            }
            /// Its torque for each unit of its linear parameters, which come first: all that a controller evaluates of a law. Zero for
            /// other parameters, and for what resists in no joint.
            // Once in the code, for every use of it.
            #[inline(never)]
            pub(crate) fn unit_torques<const N: usize>(&self, motion: &Motion<T, N>, memory: &States<T>) -> UnitTorques<T> {
                let mut units = [T::ZERO; MAX_LINEAR];
                match self.kind {
                    // Of a gradient of which less is read, less is computed.
                    $(Kind::$law => if <$module::$law as Law>::ACTS_ON.joints(<$module::$law as Law>::INFO.place) {
                        const LINEAR: usize = linear_parameters(<$module::$law as Law>::INFO.parameters);
                        const { assert!(LINEAR <= MAX_LINEAR) };
                        let gradient = $module::$law::gradient(&self.parameters, &motion.local(self.index, *memory));
                        for (unit, &value) in units.iter_mut().zip(&gradient).take(LINEAR) {
                            *unit = value;
                        }
                    })*
                    Kind::Custom(_) => {}
                }
                units
            }
            /// Factor with which the same torque also resists in the joint before.
            #[inline]
            pub fn proximal_share(&self) -> T {
                if !self.on { return T::ZERO; }
                match self.kind { $(Kind::$law => $module::$law::proximal_share(&self.parameters),)* Kind::Custom(_) => T::ZERO }
            }
            /// Whether what it does depends on states of its own.
            #[cfg_attr(target_os = "none", inline(never))]
            pub fn remembers(&self) -> bool {
                match self.kind {
                    $(Kind::$law => <$module::$law as Law>::INFO.states > 0 && !$module::$law::forgets(&self.parameters),)*
                    Kind::Custom(own) => own.info().states > 0,
                }
            }
            /// Time derivatives of the effect's own states.
            #[cfg_attr(target_os = "none", inline(never))]
            #[cfg_attr(not(target_os = "none"), inline)]
            pub fn memory_rate(&self, at: &Local<T>) -> States<T> {
                if !self.on { return [T::ZERO; MAX_STATES]; }
                match self.kind {
                    $(Kind::$law => $module::$law::memory_rate(&self.parameters, at),)*
                    Kind::Custom(own) => own.memory_rate(&self.parameters, at),
                }
            }
            /// Adds the torque with which the joints of a moving arm resist; nothing for an index beyond the arm.
            #[inline]
            fn resist<const N: usize>(&self, motion: &Motion<T, N>, memory: States<T>, total: &mut Joints<T, N>) {
                // `Local` is made within each branch, so that only what a kind uses is computed.
                match self.kind {
                    $(Kind::$law => {
                        let torque = $module::$law::torque(&self.parameters, &motion.local(self.index, memory));
                        total[self.index] += torque;
                        if $module::$law::CROSSES && self.index > 0 {
                            total[self.index - 1] += $module::$law::proximal_share(&self.parameters) * torque;
                        }
                    })*
                    Kind::Custom(own) => {
                        total[self.index] += own.torque(&self.parameters, &motion.local(self.index, memory));
                    }
                }
            }
            /// Changes the rig before a run.
            pub fn alter<const N: usize>(&self, setup: &mut Setup<T, N>) {
                if !self.on { return; }
                match self.kind { $(Kind::$law => $module::$law::alter(&self.parameters, self.index, setup),)* Kind::Custom(_) => {} }
            }
            /// Changes what the sensors read.
            pub fn distort<const N: usize>(&self, reading: &mut Reading<T, N>) {
                if !self.on { return; }
                match self.kind { $(Kind::$law => $module::$law::distort(&self.parameters, self.index, reading),)* Kind::Custom(_) => {} }
            }
        }
    };
}

catalogue! {
    viscous::Viscous,
    coulomb::Coulomb,
    stribeck::Stribeck,
    load_friction::LoadFriction,
    quadratic_drag::QuadraticDrag,
    angle_viscosity::AngleViscosity,
    active_viscosity::ActiveViscosity,
    elastic::Elastic,
    active_stiffness::ActiveStiffness,
    cubic_elastic::CubicElastic,
    relaxation::Relaxation,
    thixotropy::Thixotropy,
    constant_moment::ConstantMoment,
    end_range::EndRange,
    biarticular::Biarticular,
    biarticular_end_range::BiarticularEndRange,
    stretch_reflex::StretchReflex,
    tremor::Tremor,
    voluntary::Voluntary,
    motor_inertia::MotorInertia,
    added_mass::AddedMass,
    gravity_moment::GravityMoment,
    inertia::Inertia,
    segment_length::SegmentLength,
    gravity_tilt::GravityTilt,
    shoulder_motion::ShoulderMotion,
    shoulder_heave::ShoulderHeave,
    backlash::Backlash,
    contact_compliance::ContactCompliance,
    contact_damping::ContactDamping,
    robot_ripple::RobotRipple,
    force_bias::ForceBias,
    force_drift::ForceDrift,
    force_gain::ForceGain,
    force_misalignment::ForceMisalignment,
    angle_offset::AngleOffset,
    time_delay::TimeDelay,
    handle_slip::HandleSlip,
}

/// Most parameters in which the torque of one effect is linear.
pub(crate) const MAX_LINEAR: usize = 2;

/// Torques for each unit of the linear parameters of an effect \[N m\].
pub(crate) type UnitTorques<T> = [T; MAX_LINEAR];

/// How many parameters of a kind its torque is linear in.
const fn linear_parameters(parameters: &[Parameter]) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < parameters.len() {
        count += parameters[i].linear as usize;
        i += 1;
    }
    count
}

/// An entry of the catalogue, with its text only where that is compiled in.
const fn listed(info: Info) -> Info {
    if cfg!(feature = "prose") {
        return info;
    }
    Info {
        summary: "",
        formula: "",
        reference: "",
        ..info
    }
}

impl Kind {
    /// The kind with a stable name.
    ///
    /// # Errors
    /// [`Invalid::Unknown`] when the catalogue does not hold it.
    pub fn named(name: &str) -> Result<Self, Invalid> {
        KINDS
            .iter()
            .copied()
            .find(|k| k.info().kind == name)
            .ok_or(Invalid::Unknown {
                name: "kind of effect",
            })
    }
}

/// One effect: a kind, where it acts, and its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect<T> {
    /// What it is.
    pub kind: Kind,
    /// Zero-based joint, segment or channel, see [`Place`].
    pub index: usize,
    /// Values in the order of [`Info::parameters`].
    pub parameters: Parameters<T>,
    /// The off switch: a run with an effect switched off has the bits of a run without it.
    pub on: bool,
}

impl<T: Scalar> Effect<T> {
    /// An effect with the default values of its kind.
    pub fn new(kind: Kind, index: usize) -> Self {
        let mut parameters = [T::ZERO; MAX_PARAMETERS];
        for (value, parameter) in parameters.iter_mut().zip(kind.info().parameters) {
            *value = T::of(parameter.default);
        }
        Self {
            kind,
            index,
            parameters,
            on: true,
        }
    }

    /// The same effect with its leading parameters set.
    pub fn with(mut self, values: &[T]) -> Self {
        for (value, &given) in self.parameters.iter_mut().zip(values) {
            *value = given;
        }
        self
    }

    /// [`Effect::proximal_share`] of one that also resists in the joint before.
    #[inline]
    pub(crate) fn share_before(&self) -> Option<T> {
        self.kind.crosses().then(|| self.proximal_share())
    }

    /// Whether it is set-valued dry friction, or has some: no speed makes it smooth, and a simulation solves for it.
    pub fn is_dry(&self) -> bool {
        let smoothing = self
            .kind
            .smoothed_by()
            .and_then(|at| self.parameters.get(at));
        smoothing.is_some_and(|s| s.every(|s| s == 0.0))
    }

    /// Checks the values against the bounds of the kind, and the index against the number of joints.
    ///
    /// # Errors
    /// [`Invalid`] names the first parameter that is outside.
    pub fn validate(&self, joints: usize) -> Result<(), Invalid> {
        let info = self.kind.info();
        let places = match info.place {
            Place::Joint | Place::Segment | Place::AngleSensor => joints,
            Place::ForceSensor => 3,
            Place::Frame | Place::Base | Place::Contact | Place::Hand | Place::Sensors => {
                usize::MAX
            }
        };
        // What also acts in the joint before needs one.
        let shared = info.place == Place::Joint && !self.proximal_share().within(0.0, 0.0);
        let first = usize::from(shared);
        if self.index < first || self.index >= places {
            return Err(Invalid::OutOfRange {
                name: info.place.name(),
                index: 0,
                found: (self.index + 1) as f64,
                min: (first + 1) as f64,
                max: places as f64,
            });
        }
        for (index, (value, parameter)) in self.parameters.iter().zip(info.parameters).enumerate() {
            let name = parameter.name;
            if !value.is_finite() {
                return Err(Invalid::NotFinite { name, index });
            }
            let (min, max) = (parameter.min, parameter.max);
            if !value.every(|v| parameter.allows(v)) {
                let found = core::cell::Cell::new(min);
                let _ = value.every(|v| {
                    found.set(v);
                    parameter.allows(v)
                });
                return Err(Invalid::OutOfRange {
                    name,
                    index,
                    found: found.get(),
                    min,
                    max,
                });
            }
        }
        Ok(())
    }
}

/// A motion of the whole arm at one instant, the input of joint effects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<T, const N: usize> {
    /// Time since the start of the trial \[s\].
    pub time: T,
    /// Joint angles \[rad\].
    pub q: Joints<T, N>,
    /// Joint speeds \[rad/s\].
    pub qd: Joints<T, N>,
    /// Joint accelerations \[rad/s²\].
    pub qdd: Joints<T, N>,
    /// Magnitude of the force through each joint \[N\].
    pub joint_force: [T; N],
    /// Activity of the muscles that move each joint: 0 at rest, 1 in a maximal voluntary contraction.
    pub activity: [T; N],
}

impl<T: Scalar, const N: usize> Motion<T, N> {
    /// A motion without accelerations, joint forces and muscle activity.
    pub fn new(time: T, q: Joints<T, N>, qd: Joints<T, N>) -> Self {
        Self {
            time,
            q,
            qd,
            qdd: joints([T::ZERO; N]),
            joint_force: [T::ZERO; N],
            activity: [T::ZERO; N],
        }
    }

    /// The same motion with the magnitudes of the forces through the joints, see [`joint_force`](crate::joint_force).
    pub fn with_joint_force(mut self, force: &[Plane<T>; N]) -> Self {
        self.joint_force = force.map(|[y, z]| (y.squared() + z.squared()).sqrt());
        self
    }

    /// Input of an effect at a joint; zero for an index beyond the arm.
    #[inline]
    pub fn local(&self, joint: usize, memory: States<T>) -> Local<T> {
        let at = |values: &[T]| values.get(joint).copied().unwrap_or(T::ZERO);
        Local {
            time: self.time,
            q: at(self.q.as_slice()),
            qd: at(self.qd.as_slice()),
            qdd: at(self.qdd.as_slice()),
            proximal_q: if joint > 0 && joint <= N {
                self.q[joint - 1]
            } else {
                T::ZERO
            },
            joint_force: at(&self.joint_force),
            activity: at(&self.activity),
            memory,
        }
    }
}

/// The arm with all that effects change of it: masses, lengths, rotors, the direction of gravity. Torques in joints are left.
///
/// # Errors
/// The index of the first effect that is refused, and why: a value outside its bounds, an arm that cannot be, or one that
/// needs more than an arm ([`Kind::needs_more_than_an_arm`], [`Invalid::CannotAct`]).
pub fn applied<T: Scalar, const N: usize>(
    chain: &Chain<T, N>,
    effects: &[Effect<T>],
) -> Result<Chain<T, N>, (usize, Invalid)> {
    let mut setup = Setup::new(chain, Contact::new([T::ZERO; 2], [T::ZERO; 2]));
    for (index, effect) in effects.iter().enumerate().filter(|(_, e)| e.on) {
        effect.validate(N).map_err(|why| (index, why))?;
        if effect.kind.needs_more_than_an_arm() {
            let kind = effect.kind.info().kind;
            return Err((index, Invalid::CannotAct { kind }));
        }
        if effect.kind.acts_on() == ActsOn::Arm {
            effect.alter(&mut setup);
            setup.chain().map_err(|why| (index, why))?;
        }
    }
    setup.chain().map_err(|why| (0, why))
}

/// The effects that are on in one of `N` joints, each with its states; those without any count as zero.
#[inline]
fn in_joints<'a, T: Scalar, const N: usize>(
    effects: &'a [Effect<T>],
    memory: &'a [States<T>],
) -> impl Iterator<Item = (&'a Effect<T>, States<T>)> {
    let states = |i| memory.get(i).copied().unwrap_or([T::ZERO; MAX_STATES]);
    effects
        .iter()
        .enumerate()
        .filter(|(_, effect)| effect.on && effect.index < N)
        .map(move |(i, effect)| (effect, states(i)))
}

/// Sum of what all effects resist with, shoulder first \[N m\].
///
/// * `memory` - the states of each effect, in the same order; missing ones count as zero
#[inline]
pub fn resisting_torque<T: Scalar, const N: usize>(
    effects: &[Effect<T>],
    motion: &Motion<T, N>,
    memory: &[States<T>],
) -> Joints<T, N> {
    let mut total = joints([T::ZERO; N]);
    for (effect, state) in in_joints::<T, N>(effects, memory) {
        effect.resist(motion, state, &mut total);
    }
    total
}

/// Sum of what all effects resist with besides set-valued dry friction \[N m\], see [`resisting_torque`].
#[inline]
pub fn resisting_besides_dry<T: Scalar, const N: usize>(
    effects: &[Effect<T>],
    motion: &Motion<T, N>,
    memory: &[States<T>],
) -> Joints<T, N> {
    let mut total = joints([T::ZERO; N]);
    for (effect, state) in in_joints::<T, N>(effects, memory) {
        if effect.is_dry() {
            total[effect.index] += effect.besides_dry(&motion.local(effect.index, state));
        } else {
            effect.resist(motion, state, &mut total);
        }
    }
    total
}

/// Largest torque of the set-valued dry friction of each joint \[N m\], see [`resisting_torque`].
#[inline]
pub fn dry_friction<T: Scalar, const N: usize>(
    effects: &[Effect<T>],
    motion: &Motion<T, N>,
    memory: &[States<T>],
) -> [T; N] {
    let mut most = [T::ZERO; N];
    for (effect, state) in in_joints::<T, N>(effects, memory) {
        if effect.is_dry() {
            most[effect.index] += effect.dry(&motion.local(effect.index, state));
        }
    }
    most
}

/// Largest torque of the set-valued dry friction of one joint \[N m\], see [`dry_friction`].
#[inline]
pub fn dry_friction_of<T: Scalar, const N: usize>(
    joint: usize,
    effects: &[Effect<T>],
    motion: &Motion<T, N>,
    memory: &[States<T>],
) -> T {
    in_joints::<T, N>(effects, memory)
        .filter(|(effect, _)| effect.index == joint && effect.is_dry())
        .fold(T::ZERO, |most, (effect, state)| {
            most + effect.dry(&motion.local(joint, state))
        })
}
