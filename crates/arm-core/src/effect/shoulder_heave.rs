use super::law::{Info, Law, Parameters, Place, WAVE, add_wave};
use super::prior::{Nature, Part, Prior};
use crate::{Scalar, Setup};

/// A first joint that heaves, as the shoulder of a person who breathes or of a trunk that rocks.
///
/// The amplitudes of several add; the last one states frequency and phase.
pub struct ShoulderHeave;

impl Law for ShoulderHeave {
    const INFO: Info = Info {
        kind: "shoulder_heave",
        place: Place::Base,
        summary: "first joint that heaves periodically",
        formula: "base += (y, z) · sin(2π frequency t + phase)",
        reference: "motion of the chest wall in quiet breathing: De Groote, Wantier, Cheron, Estenne, Paiva 1997",
        parameters: &WAVE,
        states: 0,
    };
    // The trunk breathes at 0.2 to 0.5 Hz and sways below 1 Hz, the heart beats at 1 to 3 Hz.
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).varying(&[2, 3]).small(1e-4)])
        .of_nature(Nature::Periodic)
        .between(0.0, 3.0);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        add_wave(p, &mut setup.heave);
    }
}
