#!/usr/bin/env bash
# The same run, built in three ways, alone and inside a batch: all digests must be equal.
set -euo pipefail
cd "$(dirname "$0")/.."
run() { # name, then the cargo arguments
  local name=$1; shift
  cargo run --quiet --example digest "$@" | sed "s/^/$name /"
}
# The first is the example as `cargo test` has built it. The others leave out the second engine, which takes no part.
alone=(--release -p arm-sim --no-default-features)
# How the third is optimised must not matter either: it is built quickly.
quick=(--config profile.release.lto=false --config profile.release.codegen-units=16 --config profile.release.debug=false)
found=$(run debug; run release "${alone[@]}"; RUSTFLAGS="-C target-cpu=native" run native "${alone[@]}" "${quick[@]}" --target-dir target/native)
echo "$found"
for kind in "rk4\|lane" euler; do
  [ "$(grep " \($kind\) " <<<"$found" | awk '{print $3}' | sort -u | wc -l)" = 1 ] || { echo "digests differ" >&2; exit 1; }
done
echo "check_bits: the same bits in debug, release, with target-cpu=native, alone and in a batch"
