//! The digests of this build, which is one with debug assertions where tests are built as usual.

use crate::digests::digests;

#[test]
fn bits_are_those_that_every_target_comes_to() {
    let found = digests().expect("what can be simulated and identified");
    let found = found.map(|(name, value)| format!("{name} {value:016x}"));
    let expected: Vec<&str> = include_str!("../../../../scripts/digests.txt")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert_eq!(found.to_vec(), expected);
}
