use arm_core::effect::Kind;

use crate::fields::{Bounds, Fields, check_text};
use crate::value::by_value;
use crate::{Effect, Refused, Site, Table, Value};

/// The passive properties of one joint that belong to the model itself. Each is an effect of the catalogue, and zero means
/// that there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// \[N m/rad\] about `rest`.
    pub stiffness: f64,
    /// Angle at which the elastic moment is zero \[rad\].
    pub rest: f64,
    /// \[N m s/rad\]
    pub viscosity: f64,
    /// Dry friction \[N m\].
    pub coulomb: f64,
}

/// A key of a joint: the effect and the parameter that it states.
struct Key {
    name: &'static str,
    kind: Kind,
    parameter: &'static str,
    of: fn(&mut Joint) -> &mut f64,
    /// Whether it is the size of its effect: zero where there is none, and never negative.
    size: bool,
}

/// The keys, grouped by effect, the size first. What else the effects have is at its default.
const KEYS: [Key; 4] = [
    Key {
        name: "stiffness",
        kind: Kind::Elastic,
        parameter: "stiffness",
        of: |joint| &mut joint.stiffness,
        size: true,
    },
    Key {
        name: "rest",
        kind: Kind::Elastic,
        parameter: "rest",
        of: |joint| &mut joint.rest,
        size: false,
    },
    Key {
        name: "viscosity",
        kind: Kind::Viscous,
        parameter: "viscosity",
        of: |joint| &mut joint.viscosity,
        size: true,
    },
    Key {
        name: "coulomb",
        kind: Kind::Coulomb,
        parameter: "torque",
        of: |joint| &mut joint.coulomb,
        size: true,
    },
];

/// The laws that a joint states: the key of the size of each, its kind, and the parameter that the size is, in the order of the keys.
pub fn joint_laws() -> impl Iterator<Item = (&'static str, Kind, &'static str)> {
    let sizes = KEYS.iter().filter(|key| key.size);
    sizes.map(|key| (key.name, key.kind, key.parameter))
}

impl Key {
    /// The bounds of the catalogue.
    fn bounds(&self) -> Bounds {
        let parameters = self.kind.info().parameters;
        let Some(parameter) = parameters.iter().find(|p| p.name == self.parameter) else {
            return Bounds::finite("");
        };
        let bounds = Bounds::of(parameter);
        if self.size {
            bounds.least(bounds.lower().max(0.0))
        } else {
            bounds.hint("degrees?")
        }
    }

    fn value(&self, joint: &Joint) -> f64 {
        *(self.of)(&mut joint.clone())
    }
}

impl Joint {
    /// A joint of which nothing is known but its name.
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Reads a table; `place` names it in refusals.
    ///
    /// # Errors
    /// [`Refused`] for an unknown or missing key and for a value out of the bounds of the catalogue.
    pub fn from_value(place: &str, value: Value) -> Result<Self, Refused> {
        let mut fields = Fields::new(place, value)?;
        fields.only(&["name"], &KEYS.each_ref().map(|key| key.name))?;
        let mut joint = Self::named(fields.required_text("name")?);
        for key in &KEYS {
            *(key.of)(&mut joint) = fields.number_or(key.name, 0.0, &key.bounds())?;
        }
        Ok(joint)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`Refused`] names the first that is out of bounds.
    pub fn check(&self) -> Result<(), Refused> {
        check_text("name", &self.name)?;
        for key in &KEYS {
            key.bounds().check(key.name, key.value(self))?;
        }
        Ok(())
    }

    /// The joint as it stands in a file.
    pub fn to_table(&self) -> Table {
        let table = Table::new().with("name", self.name.as_str());
        KEYS.iter()
            .fold(table, |table, key| table.with(key.name, key.value(self)))
    }

    /// What the joint states, as effects at the joint of an index from 0.
    pub fn effects(&self, index: usize) -> Vec<Effect> {
        let sizes = KEYS.iter().filter(|key| key.size && self.states(key.kind));
        sizes
            .filter_map(|size| {
                let own = KEYS.iter().filter(|key| key.kind == size.kind);
                own.fold(Effect::new(size.kind, Site::Joint(index)), |effect, key| {
                    effect?.with(key.parameter, key.value(self))
                })
                .ok()
            })
            .collect()
    }

    /// Whether the joint states an effect of a kind.
    pub fn states(&self, kind: Kind) -> bool {
        let mut sizes = KEYS.iter().filter(|key| key.kind == kind && key.size);
        sizes.any(|key| key.value(self) != 0.0)
    }

    /// The value that the joint gives to a parameter of a kind, where it has a key for it.
    pub(crate) fn value(&self, kind: Kind, parameter: &str) -> Option<f64> {
        key_of(kind, parameter).map(|key| key.value(self))
    }

    /// The name and bounds of the key for a parameter of a kind.
    pub(crate) fn key(kind: Kind, parameter: &str) -> Option<(&'static str, Bounds)> {
        key_of(kind, parameter).map(|key| (key.name, key.bounds()))
    }

    /// The same joint with a parameter of a kind changed, where it has a key for it.
    pub(crate) fn with(&self, kind: Kind, parameter: &str, value: f64) -> Option<Self> {
        let key = key_of(kind, parameter)?;
        let mut joint = self.clone();
        *(key.of)(&mut joint) = value;
        Some(joint)
    }

    /// The same joint with the sizes of the effects that it states taken from fitted ones, in the order of [`Joint::effects`].
    #[must_use]
    pub fn with_sizes(&self, mut next: impl FnMut() -> Option<Effect>) -> Self {
        let mut joint = self.clone();
        for key in KEYS.iter().filter(|key| key.size && self.states(key.kind)) {
            if let Some(size) = next().and_then(|fitted| fitted.value(key.parameter)) {
                *(key.of)(&mut joint) = size;
            }
        }
        joint
    }

    /// The same joint without an effect.
    pub(crate) fn without(&self, kind: Kind) -> Self {
        let mut joint = self.clone();
        for key in KEYS.iter().filter(|key| key.kind == kind) {
            *(key.of)(&mut joint) = 0.0;
        }
        joint
    }

    /// The same joint stating an effect as well; none where its keys cannot express all of it, or are taken.
    #[must_use]
    pub fn stating(&self, effect: &Effect) -> Option<Self> {
        if self.states(effect.kind()) {
            return None;
        }
        let mut joint = self.clone();
        let defaults = effect.kind().info().parameters.iter().map(|p| p.default);
        for ((name, value), default) in effect.parameters().zip(defaults) {
            match key_of(effect.kind(), name) {
                // A joint has no negative spring; a fit may find one, and an effect may state it.
                Some(key) => *(key.of)(&mut joint) = key.bounds().check(key.name, value).ok()?,
                None if value == default => {}
                None => return None,
            }
        }
        key_of(effect.kind(), effect.parameters().next()?.0).map(|_| joint)
    }
}

fn key_of(kind: Kind, parameter: &str) -> Option<&'static Key> {
    KEYS.iter()
        .find(|key| key.kind == kind && key.parameter == parameter)
}

by_value!(Joint);
