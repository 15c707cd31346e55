use super::law::{Info, Law, Parameter, Parameters, Place};
use super::prior::{Part, Prior, Promise};
use crate::{Reading, Scalar};

/// An offset of one channel of the force sensor (N, for `Mx` N m).
///
/// The channels read the force on the arm.
pub struct ForceBias;

impl Law for ForceBias {
    const INFO: Info = Info {
        kind: "force_bias",
        place: Place::ForceSensor,
        summary: "offset of a force channel",
        formula: "F_read = F + bias",
        reference: "zero error of a strain-gauge sensor; errors of calibration as in Kodek 2004, appendix A",
        parameters: &[Parameter::linear("bias", "N", -100.0, 100.0, 0.0)],
        states: 0,
    };
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(0.1)]).promised(Promise::ForceBias);

    #[inline]
    fn distort<T: Scalar, const N: usize>(
        p: &Parameters<T>,
        index: usize,
        reading: &mut Reading<T, N>,
    ) {
        if let Some(channel) = reading.channel_mut(index) {
            *channel += p[0];
        }
    }
}
