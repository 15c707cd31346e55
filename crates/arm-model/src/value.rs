use std::fmt;

use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::number::{quoted, shortened, shortest};

/// A value as a file or a program hands it over, before it is known what it should be.
///
/// Every format is read into this and checked once, so that TOML, JSON and Python are refused in the same words.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// An explicit nothing: `null`, `None`.
    Nothing,
    /// True or false.
    Flag(bool),
    /// A whole number.
    Integer(i64),
    /// A whole number beyond 64 bits, by its digits.
    Long(String),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// A list.
    List(Vec<Value>),
    /// A table.
    Table(Table),
    /// What no file can hold, as it is shown.
    Other(String),
}

/// A table: keys and values in the order in which they stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table(pub Vec<(String, Value)>);

impl Table {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with a further key.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.push(key, value);
        self
    }

    /// Adds a key; nothing is left out.
    pub fn push(&mut self, key: &str, value: impl Into<Value>) {
        match value.into() {
            Value::Nothing => {}
            value => self.0.push((key.to_owned(), value)),
        }
    }
}

impl Value {
    /// The value as messages show it.
    pub fn shown(&self) -> String {
        shortened(&self.plain())
    }

    fn plain(&self) -> String {
        match self {
            Self::Nothing => "None".to_owned(),
            Self::Flag(value) => value.to_string(),
            Self::Integer(value) => value.to_string(),
            Self::Long(digits) => digits.clone(),
            Self::Number(value) => shortest(*value),
            Self::Text(text) => quoted(text),
            // No more of them than a message has room for.
            Self::List(items) => {
                let items: Vec<String> = items.iter().take(50).map(Self::shown).collect();
                format!("[{}]", items.join(", "))
            }
            Self::Table(table) => {
                let items: Vec<String> = table
                    .0
                    .iter()
                    .take(50)
                    .map(|(key, value)| format!("{}: {}", quoted(key), value.shown()))
                    .collect();
                format!("{{{}}}", items.join(", "))
            }
            Self::Other(text) => text.clone(),
        }
    }

    /// The number, where it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            Self::Integer(value) => Some(*value as f64),
            Self::Long(digits) => digits.parse().ok(),
            _ => None,
        }
    }
}

macro_rules! made_of {
    ($($kind:ty => $variant:ident),*) => {
        $(impl From<$kind> for Value {
            fn from(value: $kind) -> Self {
                Self::$variant(value.into())
            }
        })*
    };
}

made_of!(bool => Flag, i64 => Integer, f64 => Number, &str => Text, String => Text, Vec<Value> => List, Table => Table);

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Nothing, Into::into)
    }
}

impl From<[f64; 2]> for Value {
    fn from(pair: [f64; 2]) -> Self {
        Self::List(pair.map(Self::Number).to_vec())
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Nothing => to.serialize_none(),
            Self::Flag(value) => to.serialize_bool(*value),
            Self::Integer(value) => to.serialize_i64(*value),
            Self::Number(value) => to.serialize_f64(*value),
            Self::Text(text) | Self::Long(text) | Self::Other(text) => to.serialize_str(text),
            Self::List(items) => to.collect_seq(items),
            Self::Table(table) => table.serialize(to),
        }
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(Some(self.0.len()))?;
        for (key, value) in &self.0 {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Value;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value")
            }
            fn visit_unit<E>(self) -> Result<Value, E> {
                Ok(Value::Nothing)
            }
            fn visit_none<E>(self) -> Result<Value, E> {
                Ok(Value::Nothing)
            }
            fn visit_some<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
                Value::deserialize(from)
            }
            fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
                Ok(Value::Flag(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
                Ok(Value::Integer(value))
            }
            fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
                Ok(i64::try_from(value)
                    .map_or_else(|_| Value::Long(value.to_string()), Value::Integer))
            }
            fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
                Ok(Value::Number(value))
            }
            fn visit_str<E>(self, text: &str) -> Result<Value, E> {
                Ok(Value::Text(text.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Value, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = from.next_element()? {
                    items.push(item);
                }
                Ok(Value::List(items))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut from: A) -> Result<Value, A::Error> {
                let mut table = Table::new();
                let mut seen = std::collections::BTreeSet::new();
                while let Some((key, value)) = from.next_entry::<String, Value>()? {
                    if !seen.insert(key.clone()) {
                        return Err(de::Error::custom(format!("key {} twice", quoted(&key))));
                    }
                    table.0.push((key, value));
                }
                Ok(Value::Table(table))
            }
        }
        from.deserialize_any(Any)
    }
}

/// Serde for a type that is written as a table and read, checked, from a value.
macro_rules! by_value {
    ($($kind:ty),* $(,)?) => {
        $(impl serde::Serialize for $kind {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                self.to_table().serialize(to)
            }
        }
        impl<'de> serde::Deserialize<'de> for $kind {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let value = <$crate::Value as serde::Deserialize>::deserialize(from)?;
                Self::from_value("", value).map_err(serde::de::Error::custom)
            }
        })*
    };
}

pub(crate) use by_value;
