//! The specification of a simulated arm as it is stored in an FMU.

use arm_core::effect::{Effect, KINDS, Kind, Place};
use arm_core::{Chain, Contact, Invalid, Joints, Segment, Setup, sample_arms};
use arm_sim::{Port, SimulationError};
use serde::{Deserialize, Serialize};

use crate::status::Refused;

/// Longest arm that is compiled in.
pub(crate) const MOST_SEGMENTS: usize = 6;

/// An arm with what acts in it, the port through which it is coupled, and where it starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSpec {
    /// Name of the model, on one line.
    pub name: String,
    /// Where it is cut off from what it is coupled to.
    #[serde(with = "port")]
    pub port: Port,
    /// Inner step \[s\].
    pub step: f64,
    /// Along −z \[m/s²\].
    pub gravity: f64,
    /// First joint, y and z \[m\].
    pub base: [f64; 2],
    /// Proximal first.
    pub segments: Vec<SegmentSpec>,
    /// Stiffness of the contact \[N/m\].
    pub contact_stiffness: [f64; 2],
    /// Damping of the contact \[N s/m\].
    pub contact_damping: [f64; 2],
    /// What acts in it.
    pub effects: Vec<EffectSpec>,
    /// Where it starts.
    pub start: StartSpec,
}

/// One rigid segment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentSpec {
    /// \[m\]
    pub length: f64,
    /// \[kg\]
    pub mass: f64,
    /// Centre of mass from the proximal joint: along the segment, and normal to it \[m\].
    pub com: [f64; 2],
    /// About the centre of mass \[kg m²\].
    pub inertia: f64,
}

/// One effect of the catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectSpec {
    /// Name in the catalogue.
    pub kind: String,
    /// Zero-based joint or segment.
    pub index: usize,
    /// Values in the order of the catalogue.
    pub values: Vec<f64>,
}

/// The state at the start, and where the handle is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartSpec {
    /// Joint angles \[rad\].
    pub q: Vec<f64>,
    /// Joint speeds \[rad/s\].
    pub qd: Vec<f64>,
    /// Motion port: the handle \[m\].
    pub handle: [f64; 2],
}

impl ArmSpec {
    /// The mechanical arm of thesis table 4.9 behind its force port, at (−60, 50)°.
    pub fn sample() -> Self {
        let arm = sample_arms::mechanical_arm();
        let effect = |index, torque| Effect::new(Kind::Coulomb, index).with(&[torque]);
        let setup = Setup::new(&arm, Contact::new([10_000.0; 2], [25.0; 2]));
        let q = [-60.0, 50.0].map(f64::to_radians).to_vec();
        let start = StartSpec {
            q,
            qd: vec![0.0; 2],
            handle: [0.0; 2],
        };
        Self::new(
            "mechanical arm",
            Port::Force,
            &setup,
            &[effect(0, 0.05), effect(1, 0.16)],
        )
        .starting(start)
    }

    /// An arm from its rig, at rest at the zero angles; effects in sensors do not belong to it, nor, behind the force port,
    /// those in the contact.
    pub fn new<const N: usize>(
        name: &str,
        port: Port,
        setup: &Setup<f64, N>,
        effects: &[Effect<f64>],
    ) -> Self {
        let ours = |e: &&Effect<f64>| match e.kind.info().place {
            Place::Joint | Place::Segment | Place::Frame | Place::Base | Place::Hand => e.on,
            Place::Contact => e.on && port == Port::Motion,
            Place::AngleSensor | Place::ForceSensor | Place::Sensors => false,
        };
        Self {
            name: name.to_owned(),
            port,
            step: 0.25e-3,
            gravity: -setup.gravity[1],
            base: setup.base,
            segments: setup
                .segments
                .iter()
                .map(|s| SegmentSpec {
                    length: s.length,
                    mass: s.mass,
                    com: s.com,
                    inertia: s.inertia,
                })
                .collect(),
            contact_stiffness: setup.contact.stiffness,
            contact_damping: setup.contact.damping,
            effects: effects
                .iter()
                .filter(ours)
                .map(|e| EffectSpec {
                    kind: e.kind.info().kind.to_owned(),
                    index: e.index,
                    values: e.parameters[..e.kind.info().parameters.len()].to_vec(),
                })
                .collect(),
            start: StartSpec {
                q: vec![0.0; N],
                qd: vec![0.0; N],
                handle: [0.0; 2],
            },
        }
    }

    /// The same arm with another start.
    pub fn starting(self, start: StartSpec) -> Self {
        Self { start, ..self }
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.segments.len()
    }

    /// Why the arm is not offered for Model Exchange, where the importer integrates it; nothing where it is.
    ///
    /// The states of effects that carry one are not among those that an importer would integrate.
    pub fn no_exchange(&self) -> Option<String> {
        let carries =
            |effect: &&EffectSpec| core_effect(effect).is_ok_and(|effect| effect.remembers());
        let effect = self.effects.iter().find(carries)?;
        Some(format!(
            "the effect {} carries a state of its own: co-simulation alone",
            effect.kind
        ))
    }

    /// Reads what [`ArmSpec::to_json`] has written, and checks it as far as its shape goes.
    ///
    /// # Errors
    /// [`Refused`] names what is wrong, and where.
    pub fn from_json(text: &str) -> Result<Self, Refused> {
        let spec: Self = serde_json::from_str(text).map_err(|e| Refused::error(e.to_string()))?;
        spec.check()?;
        Ok(spec)
    }

    /// The arm as JSON; reading it back gives every value to the last bit.
    ///
    /// # Errors
    /// [`Refused`] for a value that is not finite, which JSON cannot hold.
    pub fn to_json(&self) -> Result<String, Refused> {
        self.check()?;
        let text = serde_json::to_string_pretty(self).map_err(|e| Refused::error(e.to_string()))?;
        Ok(text + "\n")
    }

    pub(crate) fn check(&self) -> Result<(), Refused> {
        let joints = self.joints();
        let refuse = |what: String| Err(Refused::error(what));
        if !(1..=MOST_SEGMENTS).contains(&joints) {
            return refuse(format!(
                "{joints} segments, allowed are 1 to {MOST_SEGMENTS}"
            ));
        }
        for (name, values) in [("q", &self.start.q), ("qd", &self.start.qd)] {
            if values.len() != joints {
                return refuse(format!(
                    "{} start values {name}, allowed is one a joint, {joints}",
                    values.len()
                ));
            }
        }
        for (k, effect) in self.effects.iter().enumerate() {
            let Some(kind) = KINDS.iter().find(|kind| kind.info().kind == effect.kind) else {
                return refuse(format!("effect {}: unknown kind {:?}", k + 1, effect.kind));
            };
            let (found, allowed) = (effect.values.len(), kind.info().parameters.len());
            if found != allowed {
                return refuse(format!(
                    "effect {}: {found} values, {} has {allowed}",
                    k + 1,
                    effect.kind
                ));
            }
        }
        let segments = self
            .segments
            .iter()
            .flat_map(|s| [s.length, s.mass, s.com[0], s.com[1], s.inertia]);
        let effects = self.effects.iter().flat_map(|e| e.values.iter().copied());
        let start = self
            .start
            .q
            .iter()
            .chain(&self.start.qd)
            .chain(&self.start.handle);
        let rest = [self.step, self.gravity]
            .into_iter()
            .chain(self.base)
            .chain(self.contact_stiffness)
            .chain(self.contact_damping);
        match segments
            .chain(effects)
            .chain(start.copied())
            .chain(rest)
            .find(|v| !v.is_finite())
        {
            Some(value) => refuse(format!(
                "a value of the arm is {value}, allowed is a finite number"
            )),
            None => Ok(()),
        }
    }

    /// The rig without its effects. The number of segments is `N`.
    pub(crate) fn setup<const N: usize>(&self) -> Result<Setup<f64, N>, SimulationError> {
        let segments = core::array::from_fn(|i| {
            let s = self.segments[i];
            Segment {
                length: s.length,
                mass: s.mass,
                com: s.com,
                inertia: s.inertia,
            }
        });
        let chain = Chain::new(segments, self.base, [0.0, -self.gravity])?;
        let contact = Contact::new(self.contact_stiffness, self.contact_damping);
        Ok(Setup::new(&chain, contact))
    }

    /// The effects as the core computes with them.
    pub(crate) fn core_effects(&self) -> Result<Vec<Effect<f64>>, SimulationError> {
        self.effects
            .iter()
            .map(|effect| Ok(core_effect(effect)?))
            .collect()
    }

    /// Angles and speeds at the start.
    pub(crate) fn start_state<const N: usize>(&self) -> (Joints<f64, N>, Joints<f64, N>) {
        let of = |values: &[f64]| Joints::from_fn(|i, _| values[i]);
        (of(&self.start.q), of(&self.start.qd))
    }
}

fn core_effect(effect: &EffectSpec) -> Result<Effect<f64>, Invalid> {
    Ok(Effect::new(Kind::named(&effect.kind)?, effect.index).with(&effect.values))
}

mod port {
    use arm_sim::Port;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(port: &Port, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(super::port_name(*port))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Port, D::Error> {
        match String::deserialize(from)?.as_str() {
            "force" => Ok(Port::Force),
            "motion" => Ok(Port::Motion),
            other => Err(D::Error::unknown_variant(other, &["force", "motion"])),
        }
    }
}

/// The word for a port in files.
pub(crate) const fn port_name(port: Port) -> &'static str {
    match port {
        Port::Force => "force",
        Port::Motion => "motion",
    }
}
