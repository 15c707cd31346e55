use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Nature, Part, Prior};
use crate::Scalar;

/// A rhythmic torque of the muscles.
///
/// The amplitude is that of the muscles' torque on the joint; a resisting torque is its opposite.
pub struct Tremor;

impl Law for Tremor {
    const INFO: Info = Info {
        kind: "tremor",
        place: Place::Joint,
        summary: "rhythmic torque of the muscles",
        formula: "R = −amplitude · sin(2π frequency t + phase)",
        reference: "Deuschl, Bain, Brin 1998; Elble, Koller 1990",
        parameters: &[
            Parameter::linear("amplitude", "N m", -100.0, 100.0, 0.0),
            Parameter::shape("frequency", "Hz", 0.1, 50.0, 5.0),
            Parameter::shape("phase", "rad", -7.0, 7.0, 0.0),
        ],
        states: 0,
    };
    // The slowest tremor that is known, myorhythmia, has 1 to 4 Hz.
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).varying(&[1, 2])])
        .of_nature(Nature::Rhythm)
        .between(1.0, f64::INFINITY)
        .in_family(Family::Muscle);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        -p[0] * wave(p, at).0
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let (sin, cos) = wave(p, at);
        leading([
            -sin,
            -p[0] * cos * T::of(core::f64::consts::TAU) * at.time,
            -p[0] * cos,
        ])
    }
}

/// Sine and cosine of the phase at this instant.
#[inline]
fn wave<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> (T, T) {
    (T::of(core::f64::consts::TAU) * p[1] * at.time + p[2]).sin_cos()
}
