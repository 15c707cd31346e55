//! The interface of an effect: its description, its law, and its parameters.

pub use super::place::Place;
use super::prior::Prior;
use crate::{Reading, Scalar, Setup, Wave};

/// Most parameters that one effect has.
pub const MAX_PARAMETERS: usize = 6;

/// Parameter values in the order of [`Info::parameters`]; unused places are zero.
pub type Parameters<T> = [T; MAX_PARAMETERS];

/// Most states that one effect has.
pub const MAX_STATES: usize = 3;

/// The states of an effect; unused places are zero.
pub type States<T> = [T; MAX_STATES];

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name in files and results.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Value when none is given.
    pub default: f64,
    /// Whether the torque is linear in it. A fit takes linear parameters as unknowns and holds the others.
    pub linear: bool,
    /// Whether zero is allowed beside the bounds, for the limit of the law.
    pub or_zero: bool,
}

impl Parameter {
    /// A parameter in which the torque is linear.
    pub const fn linear(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        default: f64,
    ) -> Self {
        Self {
            name,
            unit,
            min,
            max,
            default,
            linear: true,
            or_zero: false,
        }
    }

    /// The same, with zero allowed beside the bounds.
    pub const fn or_zero(mut self) -> Self {
        self.or_zero = true;
        self
    }

    /// Whether a value is allowed.
    pub fn allows(&self, value: f64) -> bool {
        (self.min..=self.max).contains(&value) || (self.or_zero && value == 0.0)
    }

    /// A parameter of the shape, which a linear fit holds.
    pub const fn shape(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        default: f64,
    ) -> Self {
        Self {
            linear: false,
            ..Self::linear(name, unit, min, max, default)
        }
    }
}

/// The entry of a kind in the catalogue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// Stable name in models, reports and JSON.
    pub kind: &'static str,
    /// Where it acts.
    pub place: Place,
    /// One line on what it is.
    pub summary: &'static str,
    /// The formula; `R` is a resisting torque.
    pub formula: &'static str,
    /// Where the formula comes from.
    pub reference: &'static str,
    /// Its parameters; those in which the torque is linear come first.
    pub parameters: &'static [Parameter],
    /// How many states of its own it carries, advanced with the simulation.
    pub states: usize,
}

/// Input of a joint effect: one joint at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local<T> {
    /// Time since the start of the trial \[s\].
    pub time: T,
    /// Angle of the joint \[rad\].
    pub q: T,
    /// Its speed \[rad/s\].
    pub qd: T,
    /// Its acceleration \[rad/s²\].
    pub qdd: T,
    /// Angle of the joint before, zero at the first \[rad\].
    pub proximal_q: T,
    /// Magnitude of the force through the joint \[N\].
    pub joint_force: T,
    /// Activity of the muscles that move the joint: 0 at rest, 1 in a maximal voluntary contraction.
    pub activity: T,
    /// The effect's own states, zero at the start.
    pub memory: States<T>,
}

impl<T: Scalar> Local<T> {
    /// A joint at an angle and a speed, with nothing else: at the start, without states, and no force through it.
    #[inline]
    pub fn moving(q: T, qd: T) -> Self {
        Self {
            time: T::ZERO,
            q,
            qd,
            qdd: T::ZERO,
            proximal_q: T::ZERO,
            joint_force: T::ZERO,
            activity: T::ZERO,
            memory: [T::ZERO; MAX_STATES],
        }
    }
}

/// What an effect acts on, and so where it can be applied: a controller with a model of the arm alone applies the first two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ActsOn {
    /// The joints, with a torque that depends on the motion.
    Joints,
    /// The arm itself: its masses, lengths, rotors, or the direction of gravity. [`Law::alter`] makes it part of the chain.
    Arm,
    /// The rig around the arm: its base, the contact, the robot.
    Rig,
    /// What the sensors read.
    Sensors,
}

impl ActsOn {
    /// Whether a kind at a place has a column in the equation of motion: a torque in a joint, or the rotor there.
    pub(super) const fn joints(self, place: Place) -> bool {
        matches!((self, place), (Self::Joints, _) | (_, Place::Joint))
    }
    /// What an effect at a place acts on unless its law sets something else.
    const fn at(place: Place) -> Self {
        match place {
            Place::Joint => Self::Joints,
            Place::Segment | Place::Hand | Place::Frame => Self::Arm,
            Place::Base | Place::Contact => Self::Rig,
            Place::AngleSensor | Place::ForceSensor | Place::Sensors => Self::Sensors,
        }
    }
}

/// The behaviour of one kind of effect. What a kind does not do stays at its default, which is nothing.
pub trait Law {
    /// Name, parameters, formula and reference.
    const INFO: Info;
    /// Whether it acts in the joint before as well, by [`Law::proximal_share`].
    const CROSSES: bool = false;
    /// Whether it depends on [`Local::joint_force`].
    const FEELS_FORCE: bool = false;
    /// Whether it depends on [`Local::activity`].
    const FEELS_ACTIVITY: bool = false;
    /// What it is called in a sentence, where that is not its kind with spaces.
    const TITLE: Option<&'static str> = None;
    /// What it acts on.
    const ACTS_ON: ActsOn = ActsOn::at(Self::INFO.place);
    /// Whether its torque is a constant, or one whose sign alone follows the motion: what a quasi-static analysis can find.
    const RATE_INDEPENDENT: bool = false;
    /// Position of the parameter that makes the sign of the speed smooth, for a law whose torque, or a part of it, is dry
    /// friction. Where that parameter is zero the friction is set-valued: [`Law::dry`] against the motion, and at rest whatever
    /// holds the joint up to that, which a simulation solves for.
    const SMOOTHED_BY: Option<usize> = None;
    /// What is known of it before any data.
    const PRIOR: Prior = Prior::FIRST;

    /// Torque with which the joint resists \[N m\].
    fn torque<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> T {
        T::ZERO
    }
    /// `[constant, to the angle, to the speed]` of a torque that is no more than a linear function of its joint's motion; a
    /// simulation adds those of one joint up before it starts. Nothing for other laws.
    fn affine<T: Scalar>(_p: &Parameters<T>) -> Option<[T; 3]> {
        None
    }
    /// Largest torque of its dry friction: what it resists with in motion, and holds at most at rest \[N m\]; not negative.
    fn dry<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> T {
        T::ZERO
    }
    /// [`Law::torque`] of a law with dry friction without that friction \[N m\].
    fn besides_dry<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> T {
        T::ZERO
    }
    /// Derivatives to the parameters of the torque that the motion needs at the joint: of [`Law::torque`], and for a kind
    /// that alters the rig in one joint, of what inverse dynamics gains there. A state of its own counts as given.
    fn gradient<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> Parameters<T> {
        [T::ZERO; MAX_PARAMETERS]
    }
    /// Factor with which the same torque also resists in the joint before.
    fn proximal_share<T: Scalar>(_p: &Parameters<T>) -> T {
        T::ZERO
    }
    /// Whether it does without its states at these values.
    fn forgets<T: Scalar>(_p: &Parameters<T>) -> bool {
        false
    }
    /// Time derivatives of the effect's own states.
    fn memory_rate<T: Scalar>(_p: &Parameters<T>, _at: &Local<T>) -> States<T> {
        [T::ZERO; MAX_STATES]
    }
    /// Changes the rig before a run. What is changed here must not appear in [`Law::torque`] again.
    fn alter<T: Scalar, const N: usize>(
        _p: &Parameters<T>,
        _index: usize,
        _setup: &mut Setup<T, N>,
    ) {
    }
    /// Changes what the sensors read.
    fn distort<T: Scalar, const N: usize>(
        _p: &Parameters<T>,
        _index: usize,
        _reading: &mut Reading<T, N>,
    ) {
    }
}

/// The sign of a speed, smooth through zero: `tanh(q̇/smoothing)`.
///
/// As in Andersson, Söderberg, Björklund 2007: friction without a sticking state. For a smoothing of zero it is the sign itself,
/// zero at rest.
#[inline]
pub(super) fn smooth_sign<T: Scalar>(speed: T, smoothing: T) -> T {
    let sign = || {
        let negative = T::if_less(speed, T::ZERO, -T::ONE, T::ZERO);
        T::if_less(T::ZERO, speed, T::ONE, negative)
    };
    T::where_less(T::ZERO, smoothing, || (speed / smoothing).tanh(), sign)
}

/// Derivative of [`smooth_sign`] to `smoothing`, from its value.
#[inline]
pub(super) fn smooth_sign_slope<T: Scalar>(sign: T, speed: T, smoothing: T) -> T {
    let slope = -(T::ONE - sign.squared()) * speed / smoothing.squared();
    T::if_less(T::ZERO, smoothing, slope, T::ZERO)
}

/// `smoothing` of all kinds of dry friction: zero for friction that sticks.
pub(super) const SMOOTHING: Parameter =
    Parameter::shape("smoothing", "rad/s", 1e-4, 1.0, 0.01).or_zero();

/// Parameters of what swings in place.
pub(super) const WAVE: [Parameter; 4] = [
    Parameter::shape("y", "m", -0.1, 0.1, 0.0),
    Parameter::shape("z", "m", -0.1, 0.1, 0.0),
    Parameter::shape("frequency", "Hz", 0.01, 100.0, 1.0),
    Parameter::shape("phase", "rad", -7.0, 7.0, 0.0),
];

/// Adds the amplitudes of [`WAVE`] to a wave, which takes its frequency and phase.
pub(super) fn add_wave<T: Scalar>(p: &Parameters<T>, wave: &mut Wave<T>) {
    wave.amplitude[0] += p[0];
    wave.amplitude[1] += p[1];
    wave.frequency = p[2];
    wave.phase = p[3];
}

/// Values for the leading parameters or states, zero for the others.
#[inline]
pub(super) fn leading<T: Scalar, const P: usize, const A: usize>(values: [T; P]) -> [T; A] {
    let mut all = [T::ZERO; A];
    for (place, value) in all.iter_mut().zip(values) {
        *place = value;
    }
    all
}
