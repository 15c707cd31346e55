//! User-defined laws in the equation of motion, against laws of the catalogue with the same formula.

use arm_core::effect::{
    CustomEffect, CustomLaw, Effect, Info, Kind, Local, Parameter, Parameters, Place,
};
use arm_core::{Equation, Measured};

use crate::common::Random;

/// A law of the catalogue under another name.
struct Renamed;

const VISCOUS: Parameter = Parameter::linear("viscosity", "N m s", 0.0, 10.0, 0.0);

impl CustomLaw for Renamed {
    fn info(&self) -> &'static Info {
        const INFO: Info = Info {
            kind: "thick_oil",
            place: Place::Joint,
            summary: "viscous friction",
            formula: "R = viscosity · q̇",
            reference: "none",
            parameters: &[VISCOUS],
            states: 0,
        };
        &INFO
    }
    fn torque(&self, p: &Parameters<f64>, at: &Local<f64>) -> f64 {
        p[0] * at.qd
    }
}

static RENAMED: Renamed = Renamed;

#[test]
fn a_law_of_ones_own_is_a_known_torque_of_the_equation() {
    let mut random = Random(81);
    let chain = random.arm::<3>();
    let viscous = Kind::named("viscous").unwrap();
    let with = |kind| {
        let effects = [0.4, 0.3, 0.2].map(|value| Effect::new(kind, 0).with(&[value]));
        let [a, b, c] = effects;
        let effects = [a, Effect { index: 1, ..b }, Effect { index: 2, ..c }];
        Equation::<f64, 3, 9, 3>::new(chain, effects).unwrap()
    };
    let (own, listed) = (
        with(Kind::Custom(CustomEffect::new(&RENAMED))),
        with(viscous),
    );
    // Nothing of it is fitted.
    assert_eq!((own.used(), listed.used()), (6, 9));
    let (memory, load) = ([[0.0; 3]; 3], Measured::none());
    for _ in 0..20 {
        let motion = random.motion::<3>();
        let expected = listed.demanded(&motion, &memory, &load);
        assert!((own.demanded(&motion, &memory, &load) - expected).amax() < 1e-12);
        let values = |equation: &Equation<f64, 3, 9, 3>| equation.priors(0.1).map(|p| p.mean);
        let pairs = [
            (
                own.needed(&motion, &memory, &load).0,
                listed.needed(&motion, &memory, &load).0,
            ),
            (
                own.carrying(&motion, &memory),
                listed.carrying(&motion, &memory),
            ),
        ];
        for (mine, theirs) in pairs {
            let difference = mine.torque(&values(&own)) - theirs.torque(&values(&listed));
            assert!(difference.amax() < 1e-12);
            // It stands in what is known, not in a column.
            assert!((mine.known - theirs.known).amax() > 1e-3);
        }
    }
}
