use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior, Promise};
use crate::{Reading, Scalar};

/// A wrong gain of one channel of the force sensor; −0.1 reads a tenth too little.
pub struct ForceGain;

impl Law for ForceGain {
    const INFO: Info = Info {
        kind: "force_gain",
        place: Place::ForceSensor,
        summary: "relative error of the gain of a force channel",
        formula: "F_read = (1 + gain) F",
        reference: "sensitivity error of a strain-gauge sensor",
        parameters: &[Parameter::linear("gain", "1", -0.9, 10.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(0.01)]).promised(Promise::ForceGain);

    #[inline]
    fn distort<T: Scalar, const N: usize>(
        p: &Parameters<T>,
        index: usize,
        reading: &mut Reading<T, N>,
    ) {
        if let Some(channel) = reading.channel_mut(index) {
            *channel = (T::ONE + p[0]) * *channel;
        }
    }
}
