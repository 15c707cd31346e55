use std::fmt;
use std::path::Path;

use crate::number::{quoted, shortened};

/// In which way an input cannot be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum RefusalKind {
    /// A value that is not allowed.
    #[default]
    Value,
    /// A required key is missing.
    MissingKey,
    /// A file does not exist.
    MissingFile,
}

impl RefusalKind {
    /// Its name in Python.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Value => "value",
            Self::MissingKey => "missing_key",
            Self::MissingFile => "missing_file",
        }
    }
}

/// An input that cannot be used: where, what was found and what is allowed, on one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// In which way it cannot be used.
    pub kind: RefusalKind,
    /// The file, as the caller named it.
    pub file: Option<Box<str>>,
    /// Table and key, or the name of an argument; empty for the whole.
    pub place: String,
    /// What was found there.
    pub found: String,
    /// What is allowed there, with its unit.
    pub allowed: String,
    /// What was probably meant.
    pub hint: Option<String>,
}

impl Refused {
    /// A refusal of what was found at a place.
    pub fn new(
        place: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            kind: RefusalKind::Value,
            file: None,
            place: place.into(),
            found: found.into(),
            allowed: allowed.into(),
            hint: None,
        }
    }

    /// The same of another kind.
    #[must_use]
    pub fn of_kind(mut self, kind: RefusalKind) -> Self {
        self.kind = kind;
        self
    }

    /// The same with what was probably meant.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same seen from the table that holds the place.
    #[must_use]
    pub fn within(mut self, place: &str) -> Self {
        self.place = join(place, &self.place);
        self
    }

    /// The same with the file, unless one is named already.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file
            .get_or_insert_with(|| file.to_string_lossy().into());
        self
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [self.file.as_deref().unwrap_or(""), &self.place];
        let place: Vec<String> = parts
            .iter()
            .filter(|part| !part.is_empty())
            .map(|part| one_line(part))
            .collect();
        write!(
            f,
            "{}: found {}, allowed {}",
            place.join(": "),
            one_line(&self.found),
            one_line(&self.allowed)
        )?;
        match &self.hint {
            Some(hint) => write!(f, " ({})", one_line(hint)),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Refused {}

/// A place inside a table.
pub(crate) fn join(table: &str, key: &str) -> String {
    if table.is_empty() || key.is_empty() {
        format!("{table}{key}")
    } else {
        format!("{table}, {key}")
    }
}

/// Control characters written out, so that a message stays one line.
fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') {
                c.escape_default().to_string()
            } else {
                c.to_string()
            }
        })
        .collect()
}

/// Least similarity at which one name is suggested for another.
const SIMILAR: f64 = 0.5;

/// The known name that is most like a given one, by edit distance relative to the longer of the two; none below one half.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // A name of a file's size would take long to compare, and is like none.
    if name.len() > 100 {
        return None;
    }
    let lower = name.to_lowercase();
    let mut best: Option<(f64, &str)> = None;
    for other in known {
        let like = strsim::normalized_damerau_levenshtein(&lower, &other.to_lowercase());
        if like >= SIMILAR && best.is_none_or(|(most, _)| like > most) {
            best = Some((like, other));
        }
    }
    best.map(|(_, other)| other)
}

/// The refusal of a name that is not known, with all that are and the nearest of them.
pub fn unknown(place: &str, name: &str, what: &str, known: &[&str]) -> Refused {
    let mut known = known.to_vec();
    known.sort_unstable();
    known.dedup();
    let allowed = if known.is_empty() {
        format!("no {what}")
    } else {
        known.join(", ")
    };
    let refused = Refused::new(
        place,
        format!("unknown {what} {}", shortened(&quoted(name))),
        allowed,
    );
    match nearest(name, known) {
        Some(near) => refused.hint(format!("nearest known: {near}")),
        None => refused,
    }
}
