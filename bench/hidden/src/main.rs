//! `hidden-world generate`: sessions with hidden effects, each with its truth beside it.

use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use hidden_world::cast::Strength;
use hidden_world::output;
use hidden_world::session::{Case, Session, case};
use serde_json::{Value, json};

const USAGE: &str = "\
hidden-world generate --family null|single|double|triple|outside|little_known|all --seed S --count N -o DIR
                      [--strength strong|medium] [--from K] [--threads T]

Writes N sessions: DIR/sS/data for the workflow, DIR/sS/truth.json, and DIR/manifest.json.
Seeds 1 to 99999 are for development, those from 100000 on are scored.
--from K starts with the K-th case of the family instead of its first.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("--help" | "-h") | None => {
            println!("{USAGE}");
            ExitCode::SUCCESS
        }
        Some("generate") => match Order::read(&arguments[1..]).and_then(|order| order.fill()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(why) => {
                eprintln!("hidden-world: {why}");
                ExitCode::from(2)
            }
        },
        Some(other) => {
            eprintln!("hidden-world: found {other}; allowed: generate");
            ExitCode::from(2)
        }
    }
}

/// What is to be made.
struct Order {
    family: String,
    strength: Option<Strength>,
    seed: u64,
    count: usize,
    from: usize,
    threads: usize,
    folder: PathBuf,
}

impl Order {
    fn read(arguments: &[String]) -> Result<Self, String> {
        let mut order = Self {
            family: String::new(),
            strength: None,
            seed: 0,
            count: 0,
            from: 0,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            folder: PathBuf::new(),
        };
        let mut given = arguments.iter();
        while let Some(name) = given.next() {
            let value = given.next().ok_or_else(|| format!("{name}: no value"))?;
            let whole = || {
                let number = value.parse::<u64>();
                number.map_err(|_| format!("{name}: found {value}; allowed: a whole number"))
            };
            match name.as_str() {
                "--family" => order.family.clone_from(value),
                "--seed" => order.seed = whole()?,
                "--count" => order.count = whole()? as usize,
                "--from" => order.from = whole()? as usize,
                "--threads" => order.threads = whole()?.max(1) as usize,
                "-o" => order.folder = PathBuf::from(value),
                "--strength" => {
                    order.strength = Some(match value.as_str() {
                        "strong" => Strength::Strong,
                        "medium" => Strength::Medium,
                        _ => {
                            return Err(format!(
                                "--strength: found {value}; allowed: strong, medium"
                            ));
                        }
                    });
                }
                _ => return Err(format!("found {name}; see --help")),
            }
        }
        if order.folder.as_os_str().is_empty() || order.count == 0 || order.seed == 0 {
            return Err("--family, --seed, --count and -o are needed; see --help".to_owned());
        }
        case(&order.family, order.strength, 0)?;
        Ok(order)
    }

    /// Makes the sessions, each thread the next that is free. What one thread writes no other touches.
    ///
    /// A seed of which no session can be made is said and left out.
    fn fill(&self) -> Result<(), String> {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let worker = || {
            let mut made = Vec::new();
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                if k >= self.count {
                    return made;
                }
                made.push((k, self.make(k)));
                self.progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        let mut made: Vec<_> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..self.threads).map(|_| scope.spawn(worker)).collect();
            let joined = workers.into_iter().map(|worker| worker.join());
            joined
                .flat_map(|made| made.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect()
        });
        made.sort_by_key(|(k, _)| *k);
        let mut entries = Vec::new();
        for (k, session) in made {
            match session {
                Ok(entry) => entries.push(entry),
                Err(why) if self.count == 1 => return Err(why),
                Err(why) => eprintln!(
                    "hidden-world: seed {} is left out: {why}",
                    self.seed + k as u64
                ),
            }
        }
        if entries.is_empty() {
            return Err("no session could be made".to_owned());
        }
        self.add_to_manifest(entries)
    }

    fn make(&self, k: usize) -> Result<Value, String> {
        let seed = self.seed + k as u64;
        let case: Case = case(&self.family, self.strength, self.from + k)?;
        let session = Session::new(seed, case)?;
        let name = format!("s{seed:06}");
        output::write(&session, &self.folder.join(&name))?;
        Ok(json!({"folder": name, "seed": seed, "family": session.case.family()}))
    }

    /// A folder can hold several orders; the manifest lists what all of them made.
    fn add_to_manifest(&self, entries: Vec<Value>) -> Result<(), String> {
        let path = self.folder.join("manifest.json");
        let mut listed = known(&path)?;
        listed.retain(|old| !entries.iter().any(|new| new["folder"] == old["folder"]));
        listed.extend(entries);
        listed.sort_by_key(|entry| entry["seed"].as_u64());
        let text = format!("{:#}\n", json!({"sessions": listed}));
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn progress(&self, done: usize) {
        let mut screen = std::io::stderr();
        if screen.is_terminal() {
            let _ = write!(screen, "\r{done} of {} sessions", self.count);
            if done == self.count {
                let _ = writeln!(screen);
            }
        }
    }
}

fn known(path: &Path) -> Result<Vec<Value>, String> {
    let Ok(text) = std::fs::read_to_string(path) else {
        return Ok(Vec::new());
    };
    let manifest: Value =
        serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(manifest["sessions"].as_array().cloned().unwrap_or_default())
}
