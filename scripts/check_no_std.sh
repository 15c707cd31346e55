#!/usr/bin/env bash
# arm-core must build without the standard library and without allocation: it runs in firmware.
set -euo pipefail
cd "$(dirname "$0")/.."

core=crates/arm-core
fail() { echo "no_std check: $1" >&2; exit 1; }

grep -qE '^#!\[no_std\]' "$core/src/lib.rs" || fail "$core/src/lib.rs does not say #![no_std]"
if found=$(grep -rnE '(^|[^a-z_])(std|alloc)::|extern crate (std|alloc)' "$core/src" | grep -vE ':[0-9]+: *//'); then
  fail "the standard library or allocation is used:
$found"
fi

# A target without an operating system is the proof; where none is installed, a build for this machine has to do.
target=$(rustc --print target-list | grep -xE 'thumbv7em-none-eabi(hf)?|x86_64-unknown-none' | while read -r name; do
  [ -d "$(rustc --print sysroot)/lib/rustlib/$name/lib" ] && echo "$name"
done | head -n 1) || true
if [ -n "$target" ]; then
  cargo build --quiet -p arm-core --target "$target"
else
  cargo check --quiet -p arm-core
fi
