#!/usr/bin/env bash
# Builds Rust's standard library (or core alone, for targets without an operating system) from Debian's rust-web-src into a
# private place, so that any cargo can build for a foreign target: RUSTC=/usr/bin/rustc RUSTFLAGS="--sysroot DIR".
#   scripts/sysroot.sh TARGET DIR [rustc flags for core, such as -C target-cpu=cortex-m7]
set -euo pipefail
target=$1 root=$2
shift 2
rustc=/usr/bin/rustc
source=$($rustc --print sysroot)/lib/rustlib/src/rust/library
out=$root/lib/rustlib/$target/lib
stamp=$root/made-by
crates=std,panic_abort made_by="$($rustc --version) $*"
# Programs of tests run there, too.
case $target in *-windows-*) crates+=,test made_by+=" with test" ;; esac
[ -f "$stamp" ] && [ "$(cat "$stamp")" = "$made_by" ] && exit 0
rm -rf "$root"
mkdir -p "$out"
export RUSTC_BOOTSTRAP=1

case $target in
*-none-*)
  flags=(--target "$target" --crate-type rlib --edition 2024 --cap-lints allow -Z force-unstable-if-unmarked -C opt-level=3
    -C panic=abort -C embed-bitcode=yes -C codegen-units=1 --sysroot "$root" --out-dir "$out")
  $rustc "${flags[@]}" --crate-name core "$@" "$source/core/src/lib.rs"
  $rustc "${flags[@]}" --crate-name compiler_builtins --cfg 'feature="mem"' --cfg 'feature="compiler-builtins"' \
    --cfg intrinsics_enabled --cfg arch_enabled "$@" "$source/compiler-builtins/compiler-builtins/src/lib.rs"
  ;;
*)
  # An empty crate, whose standard library is then kept. Its own dependencies come with the source, ours do not: hence apart.
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  mkdir "$work/src"
  printf '[package]\nname = "empty"\nversion = "0.0.0"\nedition = "2021"\n' >"$work/Cargo.toml"
  touch "$work/src/lib.rs"
  (cd "$work" && PATH=/usr/bin:/bin CARGO_HOME=$work/home CARGO_TARGET_DIR=$work/target cargo build --quiet --release --offline \
    -Zbuild-std=$crates --target "$target" \
    --config 'source.crates-io.replace-with="vendored"' --config "source.vendored.directory=\"$source/vendor\"")
  cp "$work/target/$target/release/deps/"*.rlib "$out/"
  case $target in
  *-windows-gnu)
    for part in rsbegin rsend; do $rustc --sysroot "$root" --target "$target" --emit obj -o "$out/$part.o" "$source/rtstartup/$part.rs"; done
    ;;
  esac
  ;;
esac
echo "$made_by" >"$stamp"
