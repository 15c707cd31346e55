#!/usr/bin/env bash
# Builds the firmware example for m4 (Cortex-M4F, single precision), m7 (Cortex-M7, double precision), host-single or
# host-double, and runs it (in QEMU); prints what it prints. Exits with 77 and the reason where a tool is missing.
#   scripts/firmware.sh TARGET [size]
#   MODEL=DIR [TWO_JOINTS=1] scripts/firmware.sh TARGET     the arm that armrs export-c wrote to DIR instead of the closed loop
# Variables: CARGO_TARGET_DIR as of cargo.
set -euo pipefail
cd "$(dirname "$0")/.."
top=$PWD target=$1
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/crosscheck
unset CARGO_TARGET_DIR
mkdir -p "$work"
name=$target${TWO_JOINTS:+-two}

need() { command -v "$1" >/dev/null || { echo "firmware: skipped, $1 is missing (Debian: $2)" >&2; exit 77; }; }
library() { # features, then cargo arguments
  local features=$1${TWO_JOINTS:+,two-joints}
  shift
  cargo rustc --quiet --profile firmware -p arm-capi --features "$features" --target-dir "$work/$name" --crate-type staticlib "$@"
}

[ -n "${MODEL:-}" ] || { [ -f "$work/stream.bin" ] && [ -z "$(find crates/arm-core/src crates/arm-sim -newer "$work/stream.bin" -name '*.rs' -print -quit)" ]; } ||
  cargo run --quiet --release -p arm-sim --no-default-features --example stream -- "$work/stream.bin" >&2

case $target in
m4 | m7)
  need arm-none-eabi-gcc gcc-arm-none-eabi
  need qemu-system-arm qemu-system-arm
  cpu=cortex-$target features= triple=thumbv7em-none-eabihf
  [ "$target" = m4 ] && features=single
  features=$features${ARMRS_CONTROL:+,panic-control}
  if [ -z "${SYSROOT:-}" ] && [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ]; then
    # As of `rustup target add`.
    RUSTFLAGS="-C target-cpu=$cpu" library "$features" --target $triple
  else
    need /usr/bin/rustc "rustc-web, or rustup target add $triple"
    [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library" ] || { echo "firmware: skipped, no source of Rust's core (Debian: rust-web-src)" >&2; exit 77; }
    scripts/sysroot.sh $triple "$work/sysroot-$target" -C target-cpu="$cpu"
    RUSTC=/usr/bin/rustc RUSTFLAGS="--sysroot $work/sysroot-$target -C target-cpu=$cpu" library "$features" --target $triple
  fi
  lib=$work/$name/$triple/firmware/libarmrs_c.a
  options=(TARGET="$target")
  ;;
host-single | host-double)
  need cc gcc
  features=
  options=(TARGET=host)
  [ "$target" = host-single ] && features=single && options+=(SINGLE=1)
  library "$features"
  lib=$work/$name/firmware/libarmrs_c.a
  ;;
*) echo "firmware: $target is none of m4, m7, host-single, host-double" >&2; exit 2 ;;
esac
options+=(LIBRARY="$lib" BUILD="$work/firmware-$name" ${TWO_JOINTS:+TWO_JOINTS=1} ${ARMRS_CONTROL:+CONTROL=1})
if [ -n "${MODEL:-}" ]; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  options+=(MODEL="$(realpath "$MODEL")" BUILD="$folder")
else
  options+=(STREAM="$work/stream.bin")
fi
make -s -C firmware "${options[@]}" >&2
make -s -C firmware "${options[@]}" "${2:-run}"
