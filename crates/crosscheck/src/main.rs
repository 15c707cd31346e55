//! Prints the digests of this build, and compares them. `scripts/crosscheck` runs it on many targets.
//!
//! Where nothing can be printed, expected digests are compiled in as `ARMRS_DIGESTS="name=value …"`: then a difference ends
//! the program. The line `control` is the platform's own sine, which need not be the same.

mod digests;

use std::hint::black_box;

use digests::{Outcome, digests, of_values};

#[expect(
    clippy::disallowed_methods,
    reason = "the control is the platform's own"
)]
fn platform() -> u64 {
    of_values((0..20_000).map(|i| black_box(f64::from(i) * 1e-3).sin()))
}

fn main() -> Outcome<()> {
    let expected = option_env!("ARMRS_DIGESTS").unwrap_or_default();
    for (name, value) in digests()?.into_iter().chain([("control", platform())]) {
        println!("{name} {value:016x}");
        let mut same = expected.split(' ').filter_map(|e| e.split_once('='));
        if let Some((_, wanted)) = same.find(|(n, _)| *n == name) {
            assert_eq!(wanted, format!("{value:016x}"), "{name}");
        }
    }
    Ok(())
}
