use crate::number::rounded;
use crate::refused::join;
use crate::{RefusalKind, Refused, Table, Value, unknown};

/// What a number may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    above: Option<f64>,
    least: Option<f64>,
    most: Option<f64>,
    unit: &'static str,
    or_zero: bool,
    hint: &'static str,
}

impl Bounds {
    /// Any finite number of a unit.
    pub const fn finite(unit: &'static str) -> Self {
        Self {
            above: None,
            least: None,
            most: None,
            unit,
            or_zero: false,
            hint: "",
        }
    }
    /// The same, greater than a limit.
    #[must_use]
    pub const fn above(mut self, limit: f64) -> Self {
        self.above = Some(limit);
        self
    }
    /// The same, at least a limit.
    #[must_use]
    pub const fn least(mut self, limit: f64) -> Self {
        self.least = Some(limit);
        self
    }
    /// The same, at most a limit.
    #[must_use]
    pub const fn most(mut self, limit: f64) -> Self {
        self.most = Some(limit);
        self
    }
    /// The same with what a number outside of them probably means.
    #[must_use]
    pub const fn hint(mut self, hint: &'static str) -> Self {
        self.hint = hint;
        self
    }
    /// The bounds of a parameter of the catalogue.
    pub fn of(parameter: &arm_core::effect::Parameter) -> Self {
        let mut bounds = Self::finite(parameter.unit);
        bounds.least = parameter.min.is_finite().then_some(parameter.min);
        bounds.most = parameter.max.is_finite().then_some(parameter.max);
        bounds.or_zero = parameter.or_zero;
        bounds
    }

    /// SI unit.
    pub const fn unit(&self) -> &'static str {
        self.unit
    }
    /// Lower limit, minus infinity where there is none.
    pub fn lower(&self) -> f64 {
        self.least.or(self.above).unwrap_or(f64::NEG_INFINITY)
    }
    /// Upper limit, infinity where there is none.
    pub fn upper(&self) -> f64 {
        self.most.unwrap_or(f64::INFINITY)
    }

    /// Reads a number.
    ///
    /// # Errors
    /// [`Refused`] for what is no number, not finite or outside.
    pub fn read(&self, place: &str, value: &Value) -> Result<f64, Refused> {
        match value.number() {
            // Digits beyond all floats are shown as they stand.
            Some(number) if number.is_finite() || matches!(value, Value::Number(_)) => {
                self.check(place, number)
            }
            _ => Err(Refused::new(place, value.shown(), self.words())),
        }
    }

    /// Checks a number.
    ///
    /// # Errors
    /// [`Refused`] for one that is not finite or outside.
    pub fn check(&self, place: &str, number: f64) -> Result<f64, Refused> {
        let inside = number.is_finite()
            && self.above.is_none_or(|limit| number > limit)
            && self.least.is_none_or(|limit| number >= limit)
            && self.most.is_none_or(|limit| number <= limit);
        if inside || (self.or_zero && number == 0.0) {
            // One zero, so that equal models are equal texts.
            return Ok(number + 0.0);
        }
        let refused = Refused::new(place, Value::Number(number).shown(), self.words());
        Err(if self.hint.is_empty() {
            refused
        } else {
            refused.hint(self.hint)
        })
    }

    fn words(&self) -> String {
        let g = |limit: f64| rounded(limit, 6);
        let above = self.above.map(|limit| format!("> {}", g(limit)));
        let range = match (self.least, self.most) {
            (Some(least), Some(most)) if self.or_zero => {
                Some(format!("0 or {} to {}", g(least), g(most)))
            }
            (Some(least), Some(most)) => Some(format!("{} to {}", g(least), g(most))),
            (Some(least), None) => Some(format!(">= {}", g(least))),
            (None, Some(most)) => Some(format!("<= {}", g(most))),
            (None, None) => None,
        };
        let limits: Vec<String> = above.into_iter().chain(range).collect();
        ["a finite number", &limits.join(" and "), self.unit]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(" ")
    }
}

/// Reads a pair of numbers.
pub(crate) fn pair(place: &str, value: &Value, bounds: &Bounds) -> Result<[f64; 2], Refused> {
    match value {
        Value::List(items) => match items.as_slice() {
            [first, second] => Ok([
                bounds.read(&format!("{place}[0]"), first)?,
                bounds.read(&format!("{place}[1]"), second)?,
            ]),
            _ => Err(Refused::new(
                place,
                value.shown(),
                format!("two numbers, not {}", items.len()),
            )),
        },
        _ => Err(Refused::new(place, value.shown(), "two numbers")),
    }
}

/// Checks a text: at least one visible character, on one line.
pub(crate) fn check_text(place: &str, text: &str) -> Result<(), Refused> {
    let printable = |c: char| !c.is_control() && !matches!(c, '\u{2028}' | '\u{2029}');
    if text.trim().is_empty() || !text.chars().all(printable) {
        let found = Value::Text(text.to_owned()).shown();
        return Err(Refused::new(place, found, "a text on one line"));
    }
    Ok(())
}

/// The keys of one table as they are taken out of it, each by what it must be.
#[derive(Debug)]
pub struct Fields {
    place: String,
    table: Table,
}

impl Fields {
    /// A table at a place, such as `[[arm.segment]] 1`.
    ///
    /// # Errors
    /// [`Refused`] for a value that is no table.
    pub fn new(place: &str, value: Value) -> Result<Self, Refused> {
        match value {
            Value::Table(table) => Ok(Self {
                place: place.to_owned(),
                table,
            }),
            other => Err(Refused::new(place, other.shown(), "a table")),
        }
    }

    /// Refuses every key that is not known, and the absence of one that is required.
    ///
    /// # Errors
    /// [`Refused`] with the nearest known key.
    pub fn only(&self, required: &[&str], optional: &[&str]) -> Result<(), Refused> {
        for (key, _) in &self.table.0 {
            if !required.contains(&key.as_str()) && !optional.contains(&key.as_str()) {
                let known: Vec<&str> = required.iter().chain(optional).copied().collect();
                return Err(unknown(&self.place, key, "key", &known));
            }
        }
        required.iter().try_for_each(|key| self.require(key))
    }

    fn require(&self, key: &str) -> Result<(), Refused> {
        if self.table.0.iter().any(|(name, _)| name == key) {
            return Ok(());
        }
        let allowed = format!("key {key} is required");
        Err(Refused::new(self.at(key), "nothing", allowed).of_kind(RefusalKind::MissingKey))
    }

    pub(crate) fn at(&self, key: &str) -> String {
        join(&self.place, key)
    }

    /// Takes out a value; nothing where there is none.
    pub fn take(&mut self, key: &str) -> Option<Value> {
        let at = self.table.0.iter().position(|(name, _)| name == key)?;
        Some(self.table.0.remove(at).1)
    }

    fn given(&mut self, key: &str) -> Option<Value> {
        self.take(key).filter(|value| *value != Value::Nothing)
    }

    /// What has not been taken out.
    pub fn rest(self) -> Table {
        self.table
    }

    /// A number that is required.
    pub(crate) fn number(&mut self, key: &str, bounds: &Bounds) -> Result<f64, Refused> {
        self.require(key)?;
        let value = self.take(key).unwrap_or(Value::Nothing);
        bounds.read(&self.at(key), &value)
    }

    /// A number, or its default.
    pub(crate) fn number_or(
        &mut self,
        key: &str,
        default: f64,
        bounds: &Bounds,
    ) -> Result<f64, Refused> {
        match self.take(key) {
            Some(value) => bounds.read(&self.at(key), &value),
            None => Ok(default),
        }
    }

    /// A number, or none.
    pub(crate) fn maybe_number(
        &mut self,
        key: &str,
        bounds: &Bounds,
    ) -> Result<Option<f64>, Refused> {
        let at = self.at(key);
        self.given(key)
            .map(|value| bounds.read(&at, &value))
            .transpose()
    }

    /// A list of numbers, empty when absent.
    pub(crate) fn list(&mut self, key: &str, bounds: &Bounds) -> Result<Vec<f64>, Refused> {
        let at = self.at(key);
        match self.given(key) {
            None => Ok(Vec::new()),
            Some(Value::List(items)) => (items.iter().enumerate())
                .map(|(k, item)| bounds.read(&format!("{at}, {}", k + 1), item))
                .collect(),
            Some(other) => Err(Refused::new(at, other.shown(), "a list of numbers")),
        }
    }

    /// Two numbers that are required.
    pub(crate) fn pair(&mut self, key: &str, bounds: &Bounds) -> Result<[f64; 2], Refused> {
        self.require(key)?;
        let value = self.take(key).unwrap_or(Value::Nothing);
        pair(&self.at(key), &value, bounds)
    }

    /// Two numbers, or their default.
    pub(crate) fn pair_or(
        &mut self,
        key: &str,
        default: [f64; 2],
        bounds: &Bounds,
    ) -> Result<[f64; 2], Refused> {
        match self.take(key) {
            Some(value) => pair(&self.at(key), &value, bounds),
            None => Ok(default),
        }
    }

    /// A whole number.
    pub(crate) fn whole(&mut self, key: &str, least: i64) -> Result<Option<i64>, Refused> {
        let at = self.at(key);
        match self.given(key) {
            None => Ok(None),
            Some(Value::Integer(value)) if value >= least => Ok(Some(value)),
            Some(other) => Err(Refused::new(
                at,
                other.shown(),
                format!("a whole number >= {least}"),
            )),
        }
    }

    /// A text of one line.
    pub(crate) fn text(&mut self, key: &str) -> Result<Option<String>, Refused> {
        let at = self.at(key);
        match self.take(key) {
            None => Ok(None),
            Some(Value::Text(text)) => check_text(&at, &text).map(|()| Some(text)),
            Some(other) => Err(Refused::new(at, other.shown(), "a text on one line")),
        }
    }

    /// A text of one line, or none.
    pub(crate) fn maybe_text(&mut self, key: &str) -> Result<Option<String>, Refused> {
        if self
            .table
            .0
            .iter()
            .any(|(name, value)| name == key && *value == Value::Nothing)
        {
            self.take(key);
        }
        self.text(key)
    }

    /// A list of texts, empty when absent.
    pub(crate) fn names(&mut self, key: &str) -> Result<Vec<String>, Refused> {
        let Some(value) = self.take(key) else {
            return Ok(Vec::new());
        };
        let names = match &value {
            Value::List(items) => items
                .iter()
                .map(|item| match item {
                    Value::Text(text) => Some(text.clone()),
                    _ => None,
                })
                .collect(),
            _ => None,
        };
        names.ok_or_else(|| Refused::new(self.at(key), value.shown(), "a list of names"))
    }

    /// A text that is required.
    pub(crate) fn required_text(&mut self, key: &str) -> Result<String, Refused> {
        self.require(key)?;
        Ok(self.text(key)?.unwrap_or_default())
    }

    /// One of several words.
    pub(crate) fn choice<T: Copy>(
        &mut self,
        key: &str,
        options: &[(&str, T)],
    ) -> Result<Option<T>, Refused> {
        let at = self.at(key);
        let Some(value) = self.given(key) else {
            return Ok(None);
        };
        let found = match &value {
            Value::Text(text) => options.iter().find(|(name, _)| name == text),
            _ => None,
        };
        let allowed = || {
            let names: Vec<String> = options.iter().map(|(n, _)| format!("\"{n}\"")).collect();
            names.join(" or ")
        };
        found
            .map(|&(_, option)| Some(option))
            .ok_or_else(|| Refused::new(at, value.shown(), allowed()))
    }

    /// True or false, false when absent.
    pub(crate) fn flag(&mut self, key: &str) -> Result<bool, Refused> {
        match self.take(key) {
            None => Ok(false),
            Some(Value::Flag(value)) => Ok(value),
            Some(other) => Err(Refused::new(self.at(key), other.shown(), "true or false")),
        }
    }

    /// The tables of a list `[[name]]`, none when absent.
    pub(crate) fn tables(&mut self, key: &str, name: &str) -> Result<Vec<Value>, Refused> {
        let allowed = || format!("a list of tables, written [[{name}]]");
        match self.take(key) {
            None => Ok(Vec::new()),
            Some(Value::Table(_)) => Err(Refused::new(name, "one table", allowed())),
            Some(Value::List(items)) if items.iter().all(|i| matches!(i, Value::Table(_))) => {
                Ok(items)
            }
            Some(other) => Err(Refused::new(name, other.shown(), allowed())),
        }
    }
}
