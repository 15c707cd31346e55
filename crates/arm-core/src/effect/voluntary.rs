use super::law::{Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Nature, Prior};
use crate::Scalar;

/// A burst of muscle torque: a smooth pulse that starts and ends with zero slope and is highest in its middle.
///
/// The amplitude is that of the muscles' torque on the joint, positive towards a growing angle; a resisting torque is its
/// opposite.
pub struct Voluntary;

impl Law for Voluntary {
    const INFO: Info = Info {
        kind: "voluntary",
        place: Place::Joint,
        summary: "burst of muscle torque",
        formula: "R = −amplitude · 64 s³(1 − s)³, s = (t − start)/duration within 0 to 1",
        reference: "pulse of force as in Gordon, Ghez 1987; polynomial form",
        parameters: &[
            Parameter::linear("amplitude", "N m", -200.0, 200.0, 0.0),
            Parameter::shape("start", "s", -1000.0, 100000.0, 0.0),
            Parameter::shape("duration", "s", 0.001, 1000.0, 0.5),
        ],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("voluntary burst");
    const PRIOR: Prior = Prior::FIRST
        .of_nature(Nature::Burst)
        .in_family(Family::Muscle);

    #[inline]
    fn torque<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> T {
        -p[0] * pulse(p, at).0
    }

    fn gradient<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        let (height, slope, s) = pulse(p, at);
        let by_start = p[0] * slope / p[2];
        leading([-height, by_start, by_start * s])
    }
}

/// Height of the pulse, its derivative to s, and s itself, which stays within 0 to 1.
#[inline]
fn pulse<T: Scalar>(p: &Parameters<T>, at: &Local<T>) -> (T, T, T) {
    let s = ((at.time - p[1]) / p[2]).max(T::ZERO).min(T::ONE);
    let hill = s * (T::ONE - s);
    let height = T::of(64.0) * hill * hill.squared();
    let slope = T::of(192.0) * hill.squared() * (T::ONE - s - s);
    (height, slope, s)
}
