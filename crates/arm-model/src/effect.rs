use arm_core::effect::{Kind, Parameters};

use crate::fields::{Bounds, Fields};
use crate::number::shortened;
use crate::value::by_value;
use crate::{Refused, Table, Value, kind, kinds, unknown};

/// A channel of the force sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ForceChannel {
    /// Force along y.
    Fy,
    /// Force along z.
    Fz,
    /// Moment about x.
    Mx,
}

impl ForceChannel {
    /// All channels, in the order of the core.
    pub const ALL: [Self; 3] = [Self::Fy, Self::Fz, Self::Mx];
    const NAMED: [(&'static str, Self); 3] = [("Fy", Self::Fy), ("Fz", Self::Fz), ("Mx", Self::Mx)];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }
}

/// At which joint, segment or channel an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Site {
    /// The arm, contact, robot or sensors as a whole.
    Whole,
    /// A joint, or for an effect on segments a segment; from 0.
    Joint(usize),
    /// A channel of the force sensor.
    Channel(ForceChannel),
}

impl Site {
    /// Its index in the core.
    pub fn index(self) -> usize {
        match self {
            Self::Whole => 0,
            Self::Joint(joint) => joint,
            Self::Channel(channel) => channel as usize,
        }
    }

    /// Where an effect of a kind acts whose index in the core is given.
    pub fn of(kind: Kind, index: usize) -> Self {
        match kind.info().place.address() {
            Some("joint") => Self::Joint(index),
            Some(_) => Self::Channel(ForceChannel::ALL[index.min(2)]),
            None => Self::Whole,
        }
    }
}

/// One effect of the catalogue, with values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    kind: Kind,
    site: Site,
    values: Parameters<f64>,
}

impl Effect {
    /// An effect with the default values of its kind.
    ///
    /// # Errors
    /// [`Refused`] for a site that the kind does not have.
    pub fn new(kind: Kind, site: Site) -> Result<Self, Refused> {
        let info = kind.info();
        let address = info.place.address();
        let refuse = |key: &str, found: String| {
            let allowed = format!(
                "no key {key}: {} acts on the {}",
                info.kind,
                info.place.name()
            );
            Err(Refused::new(key, found, allowed))
        };
        match (address, site) {
            (Some("joint"), Site::Joint(_)) | (Some("channel"), Site::Channel(_)) => {}
            (None, Site::Whole) => {}
            (_, Site::Joint(joint)) => return refuse("joint", (joint + 1).to_string()),
            (_, Site::Channel(c)) => return refuse("channel", crate::number::quoted(c.name())),
            (Some("joint"), Site::Whole) => {
                let allowed = "the number of the joint or segment, from 1";
                return Err(Refused::new("joint", "nothing", allowed));
            }
            (Some(key), Site::Whole) => {
                return Err(Refused::new(key, "nothing", "Fy or Fz or Mx"));
            }
        }
        let core = arm_core::effect::Effect::<f64>::new(kind, site.index());
        Ok(Self {
            kind,
            site,
            values: core.parameters,
        })
    }

    /// The same effect with one parameter changed.
    ///
    /// # Errors
    /// [`Refused`] for a parameter that the kind does not have, and for a value outside of its bounds.
    pub fn with(mut self, name: &str, value: f64) -> Result<Self, Refused> {
        let Some(at) = self.position(name) else {
            return Err(self.unknown_parameter(name));
        };
        self.values[at] = Bounds::of(&self.kind.info().parameters[at]).check(name, value)?;
        Ok(self)
    }

    fn position(&self, name: &str) -> Option<usize> {
        let parameters = self.kind.info().parameters;
        parameters.iter().position(|p| p.name == name)
    }

    fn unknown_parameter(&self, name: &str) -> Refused {
        let info = self.kind.info();
        let mut known: Vec<&str> = info.parameters.iter().map(|p| p.name).collect();
        known.extend(info.place.address());
        unknown("", name, "key", &known)
    }

    /// What it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }
    /// Name of the kind.
    pub fn name(&self) -> &'static str {
        self.kind.info().kind
    }
    /// Where it acts.
    pub fn site(&self) -> Site {
        self.site
    }
    /// The joint or segment it acts on, from 0.
    pub fn joint(&self) -> Option<usize> {
        match self.site {
            Site::Joint(joint) => Some(joint),
            _ => None,
        }
    }
    /// The channel it acts on.
    pub fn channel(&self) -> Option<ForceChannel> {
        match self.site {
            Site::Channel(channel) => Some(channel),
            _ => None,
        }
    }
    /// Names and values of the parameters, in the order of the catalogue.
    pub fn parameters(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let names = self.kind.info().parameters.iter().map(|p| p.name);
        names.zip(self.values)
    }
    /// The value of a parameter.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.position(name).map(|at| self.values[at])
    }

    /// The effect as the core computes with it. A kind of a user's own that was declared anew has its new law.
    pub fn core(&self) -> arm_core::effect::Effect<f64> {
        let kind = kind(self.name()).unwrap_or(self.kind);
        let mut core = arm_core::effect::Effect::new(kind, self.site.index());
        for (value, parameter) in core.parameters.iter_mut().zip(kind.info().parameters) {
            *value = self.value(parameter.name).unwrap_or(*value);
        }
        core
    }

    /// An effect as a fit leaves it: what rounding has put beyond a bound is at the bound.
    pub fn from_core(core: &arm_core::effect::Effect<f64>) -> Self {
        let mut values = [0.0; arm_core::effect::MAX_PARAMETERS];
        let parameters = core.kind.info().parameters.iter();
        for ((value, found), parameter) in values.iter_mut().zip(core.parameters).zip(parameters) {
            let at_bound = found.clamp(parameter.min, parameter.max);
            *value = if parameter.allows(found) {
                found
            } else {
                at_bound
            } + 0.0;
        }
        Self {
            kind: core.kind,
            site: Site::of(core.kind, core.index),
            values,
        }
    }

    /// Reads a table `[[effect]]`; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown kind, an unknown or missing key and a value out of bounds.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        Self::from_value_on(&[], place, value)
    }

    /// Reads a table `[[effect]]` of an arm with joints of these names, which may give the number of a joint or its name.
    pub(crate) fn from_value_on(
        joints: &[&str],
        place: &str,
        value: Value,
    ) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        let name = fields.required_text("kind")?;
        let named = if place.is_empty() {
            String::new()
        } else {
            format!("{place} ({})", shortened(&name))
        };
        let joint = fields.take("joint").map(|value| numbered(value, joints));
        let channel = fields.take("channel");
        joint
            .transpose()
            .and_then(|joint| Self::of_kind(&name, [joint, channel], fields.rest()))
            .map_err(|refused| refused.within(&named))
    }

    /// Reads an effect whose kind is named, from joint, channel and the table of its parameters.
    ///
    /// # Errors
    /// [`Refused`] as of [`Effect::from_value`], with places inside the table.
    pub fn of_kind(
        name: &str,
        [joint, channel]: [Option<Value>; 2],
        parameters: Table,
    ) -> Result<Self, Refused> {
        let Some(kind) = kind(name) else {
            let known: Vec<&str> = kinds().iter().map(|k| k.info().kind).collect();
            return Err(unknown("kind", name, "kind of effect", &known));
        };
        let mut site = Table::new();
        site.push("joint", joint);
        site.push("channel", channel);
        let mut site = Fields::new("", Value::Table(site))?;
        let joint = site.whole("joint", 1)?;
        let channel = site.choice("channel", &ForceChannel::NAMED)?;
        let mut effect = Self {
            kind,
            site: Site::Whole,
            values: arm_core::effect::Effect::<f64>::new(kind, 0).parameters,
        };
        for (name, value) in parameters.0 {
            let at = effect.position(&name);
            let at = at.ok_or_else(|| effect.unknown_parameter(&name))?;
            effect.values[at] = Bounds::of(&kind.info().parameters[at]).read(&name, &value)?;
        }
        let joint = joint.map(|number| Site::Joint(index(number)));
        let channel = channel.map(Site::Channel);
        let sites = [joint, channel];
        // Of a joint and a channel at least one is wrong, and is named.
        let given = match kind.info().place.address() {
            Some("channel") => sites,
            _ => [channel, joint],
        };
        for site in given.into_iter().flatten() {
            effect.site = Self::new(kind, site)?.site;
        }
        Self::new(kind, effect.site)?;
        Ok(effect)
    }

    /// Checks the site against the number of joints.
    pub(crate) fn check_joint(&self, joints: usize) -> Result<(), Refused> {
        let first = usize::from(self.kind.crosses());
        match self.joint() {
            Some(joint) if joint < first || joint >= joints => Err(Refused::new(
                "joint",
                (joint + 1).to_string(),
                if first < joints {
                    format!("{} to {joints}", first + 1)
                } else {
                    format!("no {} on an arm of {joints} joint", self.name())
                },
            )),
            _ => Ok(()),
        }
    }

    /// The effect as it stands in a file.
    pub fn to_table(&self) -> Table {
        let mut table = Table::new().with("kind", self.name());
        table.push("joint", self.joint().map(|joint| joint as i64 + 1));
        table.push("channel", self.channel().map(ForceChannel::name));
        for (name, value) in self.parameters() {
            table.push(name, value);
        }
        table
    }
}

fn index(number: i64) -> usize {
    usize::try_from(number - 1).unwrap_or(usize::MAX)
}

/// The number of a joint that is called by its name; any other value as it is, and a name where there are no joints.
fn numbered(value: Value, joints: &[&str]) -> Result<Value, Refused> {
    let name = match &value {
        Value::Text(name) if !joints.is_empty() => name,
        _ => return Ok(value),
    };
    let mut called = (1_i64..).zip(joints).filter(|(_, joint)| *joint == name);
    match (called.next(), called.next()) {
        (Some((number, _)), None) => Ok(Value::Integer(number)),
        (Some(_), Some(_)) => {
            let allowed = "the number of the joint: several have this name";
            Err(Refused::new("joint", value.shown(), allowed))
        }
        (None, _) => Err(unknown("joint", name, "joint", joints)),
    }
}

by_value!(Effect);
