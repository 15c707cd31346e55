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
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0, 1]).varying(&[2, 3]).small(1e-4)])
        .of_nature(Nature::Periodic);

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, _index: usize, setup: &mut Setup<T, N>) {
        add_wave(p, &mut setup.heave);
    }
}
