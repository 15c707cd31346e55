//! The specification of the arm in the folder `resources` of an FMU.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use arm_cosim::{ArmSpec, Refused, Slave};

use crate::pointers::error;

/// Largest file that is read; an arm of six segments with a hundred effects has about 30 kB.
const MOST_BYTES: u64 = 4 << 20;

/// What is made of the arm in a folder, if it is the one that the token protects.
///
/// The token holds a digest of every value of the arm, and so a missing or edited file, and a description that belongs to
/// another arm, are refused instead of simulated.
pub fn open(
    folder: Option<PathBuf>,
    token: Option<String>,
    make: impl FnOnce(ArmSpec) -> Result<Slave, Refused>,
) -> Result<Slave, Refused> {
    let token = token.unwrap_or_default();
    let Some(folder) = folder else {
        return Err(error(
            "no path of the resources was given: the arm is in arm.json there",
        ));
    };
    let file = folder.join("arm.json");
    let text = read(&file).map_err(|why| error(format!("{}: {why}", file.display())))?;
    let spec = ArmSpec::from_json(&text)
        .map_err(|refused| error(format!("{}: {}", file.display(), refused.message)))?;
    let slave = make(spec)?;
    if slave.token() != token {
        return Err(error(format!(
            "the description has the token {token:?}, {} is the arm {:?}: one of them was edited, or belongs to another version",
            file.display(),
            slave.token()
        )));
    }
    Ok(slave)
}

fn read(file: &Path) -> Result<String, std::io::Error> {
    let mut text = String::new();
    File::open(file)?
        .take(MOST_BYTES)
        .read_to_string(&mut text)?;
    Ok(text)
}

/// The path that a URI of FMI 2.0 stands for: `file:///a%20b` or `file:/a`, on Windows `file:///C:/a`.
pub fn path_of_uri(uri: &str) -> Result<PathBuf, Refused> {
    let refused = || {
        error(format!(
            "{uri:?} is no URI of a local folder, which begins with file:/"
        ))
    };
    let rest = uri.strip_prefix("file:").ok_or_else(refused)?;
    let path = match rest.strip_prefix("//") {
        Some(with_host) => with_host.strip_prefix("localhost").unwrap_or(with_host),
        None => rest,
    };
    if !path.starts_with('/') {
        return Err(refused());
    }
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = || {
            std::str::from_utf8(tail.get(..2)?)
                .ok()
                .and_then(|h| u8::from_str_radix(h, 16).ok())
        };
        // A percent sign that begins no code stands for itself: some importers do not encode it.
        match (first, code()) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    let path = String::from_utf8(bytes).map_err(|_| refused())?;
    let drive = path.as_bytes().get(2) == Some(&b':') && path.as_bytes()[1].is_ascii_alphabetic();
    Ok(PathBuf::from(if drive { &path[1..] } else { &path }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_paths() {
        for (uri, path) in [
            ("file:///tmp/a/resources", "/tmp/a/resources"),
            ("file:/tmp/a/resources/", "/tmp/a/resources/"),
            ("file://localhost/tmp", "/tmp"),
            (
                "file:///dir%20with%20%C3%A4%20100%25%20space",
                "/dir with ä 100% space",
            ),
            ("file:///dir with ä 100% space", "/dir with ä 100% space"),
            ("file:///C:/Users/a", "C:/Users/a"),
        ] {
            assert_eq!(path_of_uri(uri).unwrap(), PathBuf::from(path));
        }
        for uri in ["", "/tmp", "http://a/b", "file:tmp", "file:///%ff"] {
            assert!(path_of_uri(uri).is_err(), "{uri}");
        }
    }
}
