//! The digests of this build, which is one with debug assertions where tests are built as usual.

use std::process::Command;

#[test]
fn bits_are_those_that_every_target_comes_to() {
    let program = env!("CARGO_BIN_EXE_crosscheck");
    let done = Command::new(program).output().expect("the program starts");
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let printed = String::from_utf8(done.stdout).expect("text");
    let found: Vec<&str> = printed
        .lines()
        .filter(|line| !line.starts_with("control"))
        .collect();
    let expected: Vec<&str> = include_str!("../../../scripts/digests.txt")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert!(expected.len() > 5);
    assert_eq!(found, expected);
}
