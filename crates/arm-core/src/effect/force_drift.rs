use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior};
use crate::{Reading, Scalar};

/// An offset of one channel of the force sensor that grows with time from zero at the start of the trial (N/s, for `Mx`
/// N m/s).
pub struct ForceDrift;

impl Law for ForceDrift {
    const INFO: Info = Info {
        kind: "force_drift",
        place: Place::ForceSensor,
        summary: "offset of a force channel that grows with time",
        formula: "F_read = F + rate · t",
        reference: "thermal drift of a strain-gauge sensor",
        parameters: &[Parameter::linear("rate", "N/s", -100.0, 100.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(0.02)]);

    #[inline]
    fn distort<T: Scalar, const N: usize>(
        p: &Parameters<T>,
        index: usize,
        reading: &mut Reading<T, N>,
    ) {
        let drift = p[0] * reading.time;
        if let Some(channel) = reading.channel_mut(index) {
            *channel += drift;
        }
    }
}
