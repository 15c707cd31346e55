use std::fmt;
use std::str::FromStr;

use arm_core::effect::{Kind, Place};

use crate::fields::Bounds;
use crate::{
    Contact, Effect, ForceChannel, Joint, Model, Parts, Refused, Robot, Segment, Site, Value, kind,
    kinds, unknown,
};

/// What a parameter belongs to. Indices are from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Object {
    /// The arm as a whole.
    Arm,
    /// A segment.
    Segment(usize),
    /// A joint, with its angle sensor.
    Joint(usize),
    /// The hand, at the tip of the last segment.
    Hand,
    /// Between hand and robot.
    Contact,
    /// The robot.
    Robot,
    /// A channel of the force sensor.
    Channel(ForceChannel),
    /// All channels of the sensors together.
    Sensors,
}

impl Object {
    /// Where an effect of a kind acts.
    fn of(kind: Kind, site: Site) -> Self {
        match (kind.info().place, site) {
            (Place::Segment, Site::Joint(k)) => Self::Segment(k),
            (_, Site::Joint(k)) => Self::Joint(k),
            (_, Site::Channel(channel)) => Self::Channel(channel),
            (Place::Hand, Site::Whole) => Self::Hand,
            (Place::Contact, Site::Whole) => Self::Contact,
            (Place::Sensors, Site::Whole) => Self::Sensors,
            (_, Site::Whole) => Self::Arm,
        }
    }

    fn site(self) -> Site {
        match self {
            Self::Segment(k) | Self::Joint(k) => Site::Joint(k),
            Self::Channel(channel) => Site::Channel(channel),
            Self::Arm | Self::Hand | Self::Contact | Self::Robot | Self::Sensors => Site::Whole,
        }
    }
}

impl fmt::Display for Object {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Arm => f.write_str("arm"),
            Self::Segment(k) => write!(f, "segment[{}]", k + 1),
            Self::Joint(k) => write!(f, "joint[{}]", k + 1),
            Self::Hand => f.write_str("hand"),
            Self::Contact => f.write_str("contact"),
            Self::Robot => f.write_str("robot"),
            Self::Channel(channel) => write!(f, "channel[{}]", channel.name()),
            Self::Sensors => f.write_str("sensors"),
        }
    }
}

/// A parameter of the object itself, and which of its two axes or links where it has two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Own {
    name: &'static str,
    axis: Option<usize>,
}

/// The identity of one parameter of a model: which object, which effect, which parameter.
///
/// It is the same wherever the parameter stands in a file: `joint[2].coulomb.torque` is the friction of the second joint, be it
/// stated by `[[arm.joint]]` or by `[[effect]]`. As text, positions count from 1: `segment[1].mass`, `arm.base[2]`,
/// `channel[Fy].force_bias.bias`; a second effect of a kind at one place is `joint[1].coulomb[2].torque`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterId {
    object: Object,
    which: Which,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Which {
    Own(Own),
    Effect {
        kind: Kind,
        /// Number among the effects of this kind at this place, from 0.
        nth: usize,
        parameter: &'static str,
    },
}

/// What is known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Its identity.
    pub id: ParameterId,
    /// Its value.
    pub value: f64,
    /// What it may be, with its unit.
    pub bounds: Bounds,
}

/// How a parameter of an object itself is reached.
struct Entry {
    object: fn(usize) -> Object,
    name: &'static str,
    paired: bool,
    bounds: fn(&Parts, usize) -> Bounds,
    of: fn(&mut Parts, usize, usize) -> Option<&mut f64>,
}

const OWN: [Entry; 11] = [
    Entry {
        object: |_| Object::Arm,
        name: "gravity",
        paired: false,
        bounds: |_, _| Model::GRAVITY,
        of: |parts, _, _| Some(&mut parts.gravity),
    },
    Entry {
        object: |_| Object::Arm,
        name: "base",
        paired: true,
        bounds: |_, _| Model::BASE,
        of: |parts, _, axis| Some(&mut parts.base[axis]),
    },
    Entry {
        object: Object::Segment,
        name: "length",
        paired: false,
        bounds: |_, _| Segment::LENGTH,
        of: |parts, k, _| Some(&mut parts.segments.get_mut(k)?.length),
    },
    Entry {
        object: Object::Segment,
        name: "mass",
        paired: false,
        bounds: |_, _| Segment::MASS,
        of: |parts, k, _| Some(&mut parts.segments.get_mut(k)?.mass),
    },
    Entry {
        object: Object::Segment,
        name: "com",
        paired: false,
        bounds: |parts, k| Segment::com_bounds(parts.segments[k].length),
        of: |parts, k, _| Some(&mut parts.segments.get_mut(k)?.com),
    },
    Entry {
        object: Object::Segment,
        name: "inertia",
        paired: false,
        bounds: |_, _| Segment::INERTIA,
        of: |parts, k, _| Some(&mut parts.segments.get_mut(k)?.inertia),
    },
    Entry {
        object: Object::Segment,
        name: "com_normal",
        paired: false,
        bounds: |parts, k| Segment::normal_bounds(parts.segments[k].length),
        of: |parts, k, _| Some(&mut parts.segments.get_mut(k)?.com_normal),
    },
    Entry {
        object: |_| Object::Contact,
        name: "stiffness",
        paired: true,
        bounds: |_, _| Contact::STIFFNESS,
        of: |parts, _, axis| Some(&mut parts.contact.as_mut()?.stiffness[axis]),
    },
    Entry {
        object: |_| Object::Contact,
        name: "damping",
        paired: true,
        bounds: |_, _| Contact::DAMPING,
        of: |parts, _, axis| Some(&mut parts.contact.as_mut()?.damping[axis]),
    },
    Entry {
        object: |_| Object::Robot,
        name: "lengths",
        paired: true,
        bounds: |_, _| Robot::LENGTHS,
        of: |parts, _, axis| Some(&mut parts.robot.as_mut()?.lengths[axis]),
    },
    Entry {
        object: |_| Object::Robot,
        name: "base",
        paired: true,
        bounds: |_, _| Robot::BASE,
        of: |parts, _, axis| Some(&mut parts.robot.as_mut()?.base[axis]),
    },
];

fn own(object: Object, name: &str) -> Option<&'static Entry> {
    let index = object.site().index();
    OWN.iter()
        .find(|place| (place.object)(index) == object && place.name == name)
}

impl ParameterId {
    fn in_effect(object: Object, kind: Kind, nth: usize, parameter: &str) -> Result<Self, Refused> {
        let known = kind.info().parameters;
        match known.iter().find(|p| p.name == parameter) {
            Some(found) => Ok(Self {
                object,
                which: Which::Effect {
                    kind,
                    nth,
                    parameter: found.name,
                },
            }),
            None => {
                let names: Vec<&str> = known.iter().map(|p| p.name).collect();
                Err(unknown("parameter", parameter, "parameter", &names))
            }
        }
    }

    /// What it belongs to.
    pub fn object(&self) -> Object {
        self.object
    }
    /// The kind of effect that has it; none for a parameter of the object itself.
    pub fn kind(&self) -> Option<Kind> {
        match self.which {
            Which::Own(_) => None,
            Which::Effect { kind, .. } => Some(kind),
        }
    }
    /// Its name, as it stands in files.
    pub fn name(&self) -> &'static str {
        match self.which {
            Which::Own(own) => own.name,
            Which::Effect { parameter, .. } => parameter,
        }
    }
}

impl fmt::Display for ParameterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.", self.object)?;
        match self.which {
            Which::Own(Own { name, axis: None }) => f.write_str(name),
            Which::Own(Own {
                name,
                axis: Some(axis),
            }) => write!(f, "{name}[{}]", axis + 1),
            Which::Effect {
                kind,
                nth,
                parameter,
            } => {
                f.write_str(kind.info().kind)?;
                if nth > 0 {
                    write!(f, "[{}]", nth + 1)?;
                }
                write!(f, ".{parameter}")
            }
        }
    }
}

/// A step of a path: a name, and what stands in brackets behind it.
fn step(text: &str) -> Option<(&str, Option<&str>)> {
    match text.split_once('[') {
        None => Some((text, None)),
        Some((name, rest)) => Some((name, Some(rest.strip_suffix(']')?))),
    }
}

fn position(text: Option<&str>) -> Option<usize> {
    let number: usize = text?.parse().ok()?;
    (1..=1_000_000).contains(&number).then(|| number - 1)
}

impl FromStr for ParameterId {
    type Err = Refused;

    fn from_str(text: &str) -> Result<Self, Refused> {
        let malformed = || {
            let found = Value::from(text).shown();
            let allowed = "object and parameter, or object, effect and parameter, as in segment[1].mass or joint[2].coulomb.torque";
            Refused::new("parameter", found, allowed)
        };
        let steps: Option<Vec<_>> = text.split('.').map(step).collect();
        let steps = steps.ok_or_else(malformed)?;
        let (first, rest) = steps.split_first().ok_or_else(malformed)?;
        let object = match *first {
            ("arm", None) => Object::Arm,
            ("hand", None) => Object::Hand,
            ("contact", None) => Object::Contact,
            ("robot", None) => Object::Robot,
            ("sensors", None) => Object::Sensors,
            ("segment", at) => Object::Segment(position(at).ok_or_else(malformed)?),
            ("joint", at) => Object::Joint(position(at).ok_or_else(malformed)?),
            ("channel", Some(name)) => {
                Object::Channel(ForceChannel::named(name).ok_or_else(malformed)?)
            }
            (name, _) => {
                let known = [
                    "arm", "segment", "joint", "hand", "contact", "robot", "channel", "sensors",
                ];
                return Err(unknown("parameter", name, "object", &known));
            }
        };
        match *rest {
            [(name, axis)] => own_id(object, name, axis, malformed),
            [(name, nth), (parameter, None)] => {
                let kind = kind(name).ok_or_else(|| {
                    let known: Vec<&str> = kinds().iter().map(|k| k.info().kind).collect();
                    unknown("parameter", name, "kind of effect", &known)
                })?;
                let nth = nth.map_or(Some(0), |nth| position(Some(nth)));
                let id = Self::in_effect(object, kind, nth.ok_or_else(malformed)?, parameter)?;
                let site = object.site();
                Effect::new(kind, site)?;
                if Object::of(kind, site) == object {
                    Ok(id)
                } else {
                    Err(malformed())
                }
            }
            _ => Err(malformed()),
        }
    }
}

fn own_id(
    object: Object,
    name: &str,
    axis: Option<&str>,
    malformed: impl Fn() -> Refused,
) -> Result<ParameterId, Refused> {
    let Some(place) = own(object, name) else {
        let index = object.site().index();
        let known: Vec<&str> = OWN
            .iter()
            .filter(|place| (place.object)(index) == object)
            .map(|place| place.name)
            .collect();
        return Err(unknown("parameter", name, "parameter", &known));
    };
    let at = position(axis).filter(|&axis| axis < 2);
    if place.paired != at.is_some() || axis.is_some() != at.is_some() {
        return Err(malformed());
    }
    Ok(ParameterId {
        object,
        which: Which::Own(Own {
            name: place.name,
            axis: at,
        }),
    })
}

/// Where the parameters of an effect stand in a model.
enum Stands {
    /// In the keys of a joint.
    InJoint(usize),
    /// In the list of effects.
    Listed(usize),
}

/// Where the n-th effect of a kind at a place stands.
fn find(parts: &Parts, object: Object, kind: Kind, nth: usize) -> Option<Stands> {
    let stated = object.site();
    let joint = match stated {
        Site::Joint(k) if parts.joints.get(k).is_some_and(|joint| joint.states(kind)) => {
            Some(Stands::InJoint(k))
        }
        _ => None,
    };
    let listed = parts.effects.iter().enumerate();
    let listed = listed.filter(|(_, e)| e.kind() == kind && e.site() == stated);
    joint
        .into_iter()
        .chain(listed.map(|(at, _)| Stands::Listed(at)))
        .nth(nth)
}

impl Model {
    /// Every parameter of the model, with value and bounds: of the arm, its segments, robot and contact, then of the effects
    /// in the order of [`Model::all_effects`].
    pub fn parameters(&self) -> Vec<ParameterInfo> {
        let mut parts = Parts::clone(self);
        let mut all = Vec::new();
        for place in &OWN {
            let objects = match (place.object)(0) {
                Object::Segment(_) => self.n_joints(),
                _ => 1,
            };
            for index in 0..objects {
                for axis in 0..1 + usize::from(place.paired) {
                    let Some(&mut value) = (place.of)(&mut parts, index, axis) else {
                        continue;
                    };
                    let id = ParameterId {
                        object: (place.object)(index),
                        which: Which::Own(Own {
                            name: place.name,
                            axis: place.paired.then_some(axis),
                        }),
                    };
                    let bounds = (place.bounds)(self, index);
                    all.push(ParameterInfo { id, value, bounds });
                }
            }
        }
        let effects = self.all_effects();
        for (at, effect) in effects.iter().enumerate() {
            let same = |e: &&Effect| e.kind() == effect.kind() && e.site() == effect.site();
            let nth = effects[..at].iter().filter(same).count();
            let object = Object::of(effect.kind(), effect.site());
            let known = effect.kind().info().parameters;
            all.extend(
                effect
                    .parameters()
                    .zip(known)
                    .map(|((_, value), p)| ParameterInfo {
                        id: ParameterId {
                            object,
                            which: Which::Effect {
                                kind: effect.kind(),
                                nth,
                                parameter: p.name,
                            },
                        },
                        value,
                        bounds: Bounds::of(p),
                    }),
            );
        }
        all
    }

    /// The value of a parameter; none where the model has no such object or effect.
    pub fn value(&self, id: ParameterId) -> Option<f64> {
        let index = id.object.site().index();
        match id.which {
            Which::Own(Own { name, axis }) => {
                let of = own(id.object, name)?.of;
                of(&mut Parts::clone(self), index, axis.unwrap_or(0)).copied()
            }
            Which::Effect {
                kind,
                nth,
                parameter,
            } => match find(self, id.object, kind, nth) {
                Some(Stands::Listed(at)) => self.effects[at].value(parameter),
                Some(Stands::InJoint(k)) => {
                    let effects = self.joints[k].effects(k);
                    effects.iter().find(|e| e.kind() == kind)?.value(parameter)
                }
                // A joint has its keys whether they are set or not.
                None if nth == 0 => self.joints.get(index)?.value(kind, parameter),
                None => None,
            },
        }
    }

    /// The same model with one parameter changed. An effect that the model does not have yet is added with its default values.
    ///
    /// # Errors
    /// [`Refused`] for an object that the model does not have, and for a value outside of its bounds.
    pub fn with(&self, id: ParameterId, value: f64) -> Result<Self, Refused> {
        let absent = || {
            let found = format!("no {id}");
            Refused::new(
                "parameter",
                found,
                "a parameter of an object that the model has",
            )
        };
        let index = id.object.site().index();
        let mut parts = Parts::clone(self);
        match id.which {
            Which::Own(Own { name, axis }) => {
                let of = own(id.object, name).ok_or_else(absent)?.of;
                *of(&mut parts, index, axis.unwrap_or(0)).ok_or_else(absent)? = value;
            }
            Which::Effect {
                kind,
                nth,
                parameter,
            } => match find(&parts, id.object, kind, nth) {
                Some(Stands::Listed(at)) => {
                    let place = format!("[[effect]] {} ({})", at + 1, kind.info().kind);
                    let changed = parts.effects[at].with(parameter, value);
                    parts.effects[at] = changed.map_err(|refused| refused.within(&place))?;
                }
                Some(Stands::InJoint(k)) => change_joint(&mut parts, k, kind, (parameter, value))?,
                None if nth > 0 => return Err(absent()),
                None if parts
                    .joints
                    .get(index)
                    .is_some_and(|j| j.value(kind, parameter).is_some())
                    && matches!(id.object, Object::Joint(_)) =>
                {
                    change_joint(&mut parts, index, kind, (parameter, value))?;
                }
                None => {
                    let effect = Effect::new(kind, id.object.site())?.with(parameter, value)?;
                    parts.effects.push(effect);
                }
            },
        }
        Self::new(parts)
    }

    /// The same model with other effects in its joints: those that a joint's keys can express stand there, the others are listed
    /// before `others`.
    ///
    /// # Errors
    /// [`Refused`] as of [`Model::new`].
    pub fn with_joint_effects(
        &self,
        fitted: &[Effect],
        others: &[Effect],
    ) -> Result<Self, Refused> {
        let mut parts = Parts::clone(self);
        for joint in &mut parts.joints {
            *joint = Joint::named(std::mem::take(&mut joint.name));
        }
        parts.effects.clear();
        for effect in fitted {
            let joint = effect.joint().and_then(|k| parts.joints.get_mut(k));
            match joint.and_then(|joint| Some((joint.stating(effect)?, joint))) {
                Some((stating, joint)) => *joint = stating,
                None => parts.effects.push(*effect),
            }
        }
        parts.effects.extend(others);
        Self::new(parts)
    }
}

/// Changes a parameter of an effect that a joint's keys state; a value that they cannot express moves the effect to the list.
fn change_joint(
    parts: &mut Parts,
    index: usize,
    kind: Kind,
    (parameter, value): (&str, f64),
) -> Result<(), Refused> {
    let joint = &parts.joints[index];
    let mut refused = None;
    if let Some((name, bounds)) = Joint::key(kind, parameter) {
        match bounds.check(name, value) {
            Ok(value) => {
                if let Some(changed) = joint.with(kind, parameter, value) {
                    parts.joints[index] = changed;
                }
                return Ok(());
            }
            Err(error) => refused = Some(error.within(&format!("[[arm.joint]] {}", index + 1))),
        }
    }
    let stated = joint.effects(index).into_iter().find(|e| e.kind() == kind);
    let effect = stated.map_or_else(|| Effect::new(kind, Site::Joint(index)), Ok)?;
    let listed = effect.with(parameter, value);
    let listed = listed.map_err(|error| refused.unwrap_or(error))?;
    parts.joints[index] = joint.without(kind);
    parts.effects.insert(0, listed);
    Ok(())
}
