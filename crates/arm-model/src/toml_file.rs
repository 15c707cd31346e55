//! TOML: the parser of the `toml` crate gives values and places, the writer writes numbers as short as they read back.

use std::fmt::Write as _;

use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use crate::number::shortest;
use crate::{Refused, Table, Value};

/// The tables of a TOML document, in the order in which they stand.
///
/// # Errors
/// [`Refused`] with line and column.
pub fn read(text: &str) -> Result<Table, Refused> {
    let document = DeTable::parse(text).map_err(|error| {
        let place = error.span().map_or_else(
            || "TOML".to_owned(),
            |span| {
                let before = text.get(..span.start).unwrap_or(text);
                let line = before.matches('\n').count() + 1;
                let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
                format!("line {line}, column {column}")
            },
        );
        Refused::new(place, error.message(), "TOML")
    })?;
    Ok(table(document.into_inner()))
}

fn table(of: DeTable<'_>) -> Table {
    let mut entries: Vec<_> = of.into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let named = |(key, item): (Spanned<_>, Spanned<DeValue<'_>>)| {
        let key: std::borrow::Cow<'_, str> = key.into_inner();
        (key.into_owned(), value(item.into_inner()))
    };
    Table(entries.into_iter().map(named).collect())
}

fn value(of: DeValue<'_>) -> Value {
    match of {
        DeValue::String(text) => Value::Text(text.into_owned()),
        DeValue::Integer(digits) => integer(&digits),
        DeValue::Float(digits) => Value::Number(digits.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(flag) => Value::Flag(flag),
        DeValue::Datetime(date) => Value::Other(date.to_string()),
        DeValue::Array(items) => {
            Value::List(items.into_iter().map(|i| value(i.into_inner())).collect())
        }
        DeValue::Table(items) => Value::Table(table(items)),
    }
}

fn integer(of: &DeInteger<'_>) -> Value {
    match i64::from_str_radix(of.as_str(), of.radix()) {
        Ok(value) => Value::Integer(value),
        Err(_) if of.radix() == 10 => Value::Long(of.as_str().to_owned()),
        Err(_) => Value::Other(of.to_string()),
    }
}

/// A document as TOML text; reading it back gives every number to the last bit.
pub fn write(document: &Table) -> String {
    let mut blocks = Vec::new();
    block("", "", document, &mut blocks);
    blocks.join("\n")
}

fn block(head: &str, path: &str, of: &Table, blocks: &mut Vec<String>) {
    let mut lines = String::new();
    if !head.is_empty() {
        let _ = writeln!(lines, "{head}");
    }
    for (name, item) in &of.0 {
        if !is_tables(item) && !matches!(item, Value::Table(_)) {
            let _ = writeln!(lines, "{} = {}", key(name), plain(item));
        }
    }
    if !lines.is_empty() {
        blocks.push(lines);
    }
    for (name, item) in &of.0 {
        let path = if path.is_empty() {
            key(name)
        } else {
            format!("{path}.{}", key(name))
        };
        match item {
            Value::Table(inner) => block(&format!("[{path}]"), &path, inner, blocks),
            Value::List(items) if is_tables(item) => {
                for inner in items {
                    if let Value::Table(inner) = inner {
                        block(&format!("[[{path}]]"), &path, inner, blocks);
                    }
                }
            }
            _ => {}
        }
    }
}

fn is_tables(value: &Value) -> bool {
    matches!(value, Value::List(items) if !items.is_empty() && items.iter().all(|i| matches!(i, Value::Table(_))))
}

fn plain(value: &Value) -> String {
    match value {
        Value::Flag(flag) => flag.to_string(),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) => shortest(*number),
        Value::Long(digits) => digits.clone(),
        Value::Text(text) | Value::Other(text) => quoted(text),
        Value::List(items) => {
            let items: Vec<String> = items.iter().map(plain).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Table(inner) => {
            let items = inner.0.iter();
            let items: Vec<String> = items
                .map(|(name, item)| format!("{} = {}", key(name), plain(item)))
                .collect();
            format!("{{ {} }}", items.join(", "))
        }
        // A table leaves out what is nothing; in a list it cannot stand.
        Value::Nothing => quoted(""),
    }
}

fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        quoted(name)
    }
}

fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\0'..'\u{20}' | '\u{7f}' => {
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
