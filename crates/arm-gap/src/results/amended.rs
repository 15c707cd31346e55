//! The model with its fitted changes.

use arm_model::{Contact, Effect, Joint, Model, Refused, Robot, Segment};
use serde::Serialize;

use crate::hypothesis::Hypothesis;

/// What was fitted of a model, in the terms of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Fitted {
    /// Relative changes of mass, centre of mass and inertia of each segment.
    pub segments: Vec<[f64; 3]>,
    /// Relative changes of compliance and damping of the contact, y and z.
    pub contact: [[f64; 2]; 2],
    /// Shift of the robot's base, y and z \[m\].
    pub shift: [f64; 2],
    /// Effects of the model, with what was refitted of them.
    pub known: Vec<Effect>,
    /// Imperfections of the sensors.
    pub calibration: Vec<Effect>,
    /// Effects that the model lacks.
    pub named: Vec<Effect>,
}

impl Fitted {
    pub(super) fn of<const N: usize>(hypothesis: &Hypothesis<N>) -> Self {
        let effects = |list: &[_]| list.iter().map(Effect::from_core).collect();
        Self {
            segments: hypothesis.segments.to_vec(),
            contact: hypothesis.contact,
            shift: hypothesis.shift,
            known: effects(&hypothesis.known),
            calibration: effects(&hypothesis.calibration),
            named: effects(&hypothesis.named),
        }
    }

    fn segments(&self, model: &Model) -> Vec<Segment> {
        let each = model.segments.iter().zip(&self.segments);
        each.map(|(old, [mass, com, inertia])| Segment {
            mass: old.mass * (1.0 + mass),
            com: (old.com * (1.0 + com)).clamp(0.0, old.length),
            inertia: old.inertia * (1.0 + inertia),
            com_normal: old.com_normal * (1.0 + com),
            ..old.clone()
        })
        .collect()
    }

    fn contact(&self, of: &Contact) -> Contact {
        let [compliance, damping] = self.contact;
        Contact {
            stiffness: [0, 1].map(|a| of.stiffness[a] / (1.0 + compliance[a])),
            damping: [0, 1].map(|a| of.damping[a] * (1.0 + damping[a])),
        }
    }

    /// The model with refitted segments, contact and known effects, and the named effects and rhythms added.
    ///
    /// # Errors
    /// [`Refused`] where a refitted value is none that a model may have.
    pub fn amended(&self, model: &Model, rhythms: &[Effect]) -> Result<Model, Refused> {
        let mut rest = self.known.iter().copied();
        let joints: Vec<Joint> = model
            .joints
            .iter()
            .map(|joint| joint.with_sizes(|| rest.next()))
            .collect();
        model.change(|parts| {
            parts.segments = self.segments(model);
            parts.contact = model.contact.map(|contact| self.contact(&contact));
            parts.joints = joints;
            parts.effects = rest
                .chain(self.named.iter().chain(rhythms).copied())
                .collect();
        })
    }

    /// The model with everything that was fitted as effects, the imperfections of its sensors included, and these effects: a rig that shows
    /// what the fit shows.
    ///
    /// # Errors
    /// [`Refused`] where a refitted value is none that a model may have.
    pub fn as_fitted(
        &self,
        model: &Model,
        rhythms: &[Effect],
    ) -> Result<(Model, Vec<Effect>), Refused> {
        let bare = model.change(|parts| {
            parts.segments = self.segments(model);
            parts.contact = Some(self.contact(&model.contact.unwrap_or(Contact::ASSUMED)));
            parts.joints = model
                .joints
                .iter()
                .map(|j| Joint::named(j.name.as_str()))
                .collect();
            parts.effects.clear();
            parts.robot = model.robot.map(|robot| Robot {
                base: [0, 1].map(|a| robot.base[a] + self.shift[a]),
                ..robot
            });
        })?;
        let lists = [&self.known[..], &self.named, rhythms, &self.calibration];
        Ok((bare, lists.concat()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = r#"
        [[arm.segment]]
        length = 0.5
        mass = 2.0
        com = 0.2
        inertia = 0.02
        [[arm.joint]]
        viscosity = 0.1
        coulomb = 0.2
        [robot]
        lengths = [0.4, 0.4]
        base = [1.0, 0.0]
        [contact]
        stiffness = [10000.0, 10000.0]
        damping = [20.0, 20.0]
        [[effect]]
        kind = "force_gain"
        channel = "Fy"
        gain = 0.05
    "#;

    fn effect(kind: &str, site: arm_model::Site, (name, value): (&str, f64)) -> Effect {
        let kind = arm_model::kind(kind).expect("a kind");
        let effect = Effect::new(kind, site).and_then(|e| e.with(name, value));
        effect.expect("an effect")
    }

    /// Ten per cent more mass, a contact half as stiff, a joint half as viscous.
    #[test]
    fn what_was_fitted_changes_the_model_that_was_given() {
        use arm_model::{ForceChannel, Site};
        let model = Model::from_toml(MODEL).expect("a model");
        let (joint, channel) = (Site::Joint(0), Site::Channel(ForceChannel::Fy));
        let fitted = Fitted {
            segments: vec![[0.1, 10.0, 0.0]],
            contact: [[1.0, 1.0], [0.5, 0.0]],
            shift: [0.01, 0.0],
            known: vec![
                effect("viscous", joint, ("viscosity", 0.05)),
                effect("coulomb", joint, ("torque", 0.3)),
                effect("force_gain", channel, ("gain", 0.06)),
            ],
            calibration: vec![effect("force_bias", channel, ("bias", 0.2))],
            named: vec![effect("elastic", joint, ("stiffness", 1.0))],
        };
        let amended = fitted.amended(&model, &[]).expect("a model");
        let segment = &amended.segments[0];
        assert_eq!([segment.mass, segment.com], [2.0 * 1.1, 0.5]);
        let contact = amended.contact.expect("a contact");
        assert_eq!(
            (contact.stiffness, contact.damping),
            ([5000.0; 2], [30.0, 20.0])
        );
        let own = &amended.joints[0];
        assert_eq!([own.viscosity, own.coulomb], [0.05, 0.3]);
        let kinds: Vec<_> = amended.effects.iter().map(Effect::name).collect();
        assert_eq!(kinds, ["force_gain", "elastic"]);
        let (bare, effects) = fitted.as_fitted(&model, &[]).expect("a rig");
        assert_eq!(bare.robot.map(|robot| robot.base), Some([1.01, 0.0]));
        assert!(bare.joints[0].viscosity == 0.0 && bare.effects.is_empty());
        assert_eq!(effects.len(), 5);
    }
}
