use super::law::{ActsOn, Info, Law, Local, Parameter, Parameters, Place, leading};
use super::prior::{Family, Part, Prior};
use crate::{Scalar, Setup};

/// The rotor of a drive, reflected to the joint: its inertia times the square of the gear ratio.
///
/// It becomes part of the chain, so that forward and inverse dynamics hold it; as a torque it would be counted twice and
/// is therefore none. Its gradient is that of inverse dynamics.
pub struct MotorInertia;

impl Law for MotorInertia {
    const INFO: Info = Info {
        kind: "motor_inertia",
        place: Place::Joint,
        summary: "inertia of a drive's rotor, reflected to the joint",
        formula: "rotor inertia of the joint += inertia, which adds inertia · q̈",
        reference: "Spong 1987; Siciliano, Sciavicco, Villani, Oriolo 2009",
        parameters: &[Parameter::linear("inertia", "kg m²", 0.0, 10.0, 0.0)],
        states: 0,
    };
    const TITLE: Option<&'static str> = Some("rotor inertia");
    const ACTS_ON: ActsOn = ActsOn::Arm;
    const PRIOR: Prior = Prior::lasting(&[Part::of(&[0]).small(1e-3)]).in_family(Family::Segment);

    fn gradient<T: Scalar>(_p: &Parameters<T>, at: &Local<T>) -> Parameters<T> {
        leading([at.qdd])
    }

    fn alter<T: Scalar, const N: usize>(p: &Parameters<T>, index: usize, setup: &mut Setup<T, N>) {
        if let Some(rotor) = setup.rotor.get_mut(index) {
            *rotor += p[0];
        }
    }
}
