//! Reading of small text files that are not trusted.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::Path;

use crate::{RefusalKind, Refused};

/// Largest file that is read \[byte\]; a model takes some hundred.
const MAX_SIZE: u64 = 16 * 1024 * 1024;

/// The text of a UTF-8 file, without its byte order mark.
pub(crate) fn read(path: &Path, what: &str) -> Result<String, Refused> {
    raw(path, what)
        .and_then(text)
        .map_err(|refused| refused.in_file(path))
}

fn raw(path: &Path, what: &str) -> Result<Vec<u8>, Refused> {
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::InvalidInput => Refused::new("file", "a name no file can have", what),
        kind => {
            let text = error.to_string();
            let reason = text.split(" (os error").next().unwrap_or("unreadable");
            let refused = Refused::new("file", reason, format!("{what} that can be read"));
            match kind {
                ErrorKind::NotFound => refused.of_kind(RefusalKind::MissingFile),
                _ => refused,
            }
        }
    };
    let kind = fs::metadata(path).map_err(unreadable)?;
    if kind.is_dir() {
        return Err(Refused::new("file", "a folder", what));
    }
    // A device never ends, and a pipe may never begin.
    if !kind.is_file() {
        let allowed = format!("{what} on a disk");
        return Err(Refused::new("file", "a device or a pipe", allowed));
    }
    let mut bytes = Vec::new();
    // Not by the size that was stated: the file may grow meanwhile.
    let mut limited = File::open(path).map_err(unreadable)?.take(MAX_SIZE + 1);
    limited.read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_SIZE {
        let found = format!("more than {MAX_SIZE} bytes");
        let allowed = format!("{what} of at most {MAX_SIZE} bytes");
        return Err(Refused::new("file", found, allowed));
    }
    Ok(bytes)
}

fn text(bytes: Vec<u8>) -> Result<String, Refused> {
    let wide = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = bytes[..at].iter().filter(|&&b| b == b'\n').count() + 1;
        let guess = if wide {
            "UTF-16"
        } else {
            "Latin-1 or Windows-1252"
        };
        Refused::new(
            format!("line {line}"),
            format!("byte 0x{:02x}", bytes[at]),
            "UTF-8 text",
        )
        .hint(format!("{guess} text? Save it as UTF-8"))
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}
