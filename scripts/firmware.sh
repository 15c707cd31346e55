#!/usr/bin/env bash
# Builds the firmware example for m4 (Cortex-M4F, single precision), m7 (Cortex-M7, double precision), host-single or
# host-double, and runs it (in QEMU); prints what it prints. Exits with 77 and the reason where a tool is missing.
#   scripts/firmware.sh TARGET [size]
set -euo pipefail
cd "$(dirname "$0")/.."
top=$PWD target=$1
work=$top/target/crosscheck
mkdir -p "$work"

need() { command -v "$1" >/dev/null || { echo "firmware: skipped, $1 is missing (Debian: $2)" >&2; exit 77; }; }
library() { # features, then cargo arguments
  local features=$1
  shift
  cargo rustc --quiet --profile firmware -p arm-capi --features "$features" --target-dir "$work/$target" --crate-type staticlib "$@"
}

[ -f "$work/stream.bin" ] && [ -z "$(find crates/arm-core/src crates/arm-sim -newer "$work/stream.bin" -name '*.rs' -print -quit)" ] ||
  cargo run --quiet --release -p arm-sim --no-default-features --example stream -- "$work/stream.bin" >&2

case $target in
m4 | m7)
  need /usr/bin/rustc rustc-web
  [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library" ] || { echo "firmware: skipped, no source of Rust's core (Debian: rust-web-src)" >&2; exit 77; }
  need arm-none-eabi-gcc gcc-arm-none-eabi
  need qemu-system-arm qemu-system-arm
  cpu=cortex-$target features=
  [ "$target" = m4 ] && features=single
  scripts/sysroot.sh thumbv7em-none-eabihf "$work/sysroot-$target" -C target-cpu="$cpu"
  RUSTC=/usr/bin/rustc RUSTFLAGS="--sysroot $work/sysroot-$target -C target-cpu=$cpu" \
    library "$features${ARMRS_CONTROL:+,panic-control}" --target thumbv7em-none-eabihf
  lib=$work/$target/thumbv7em-none-eabihf/firmware/libarmrs_c.a
  options=(TARGET="$target")
  ;;
host-single | host-double)
  need cc gcc
  features=
  options=(TARGET=host)
  [ "$target" = host-single ] && features=single && options+=(SINGLE=1)
  library "$features"
  lib=$work/$target/firmware/libarmrs_c.a
  ;;
*) echo "firmware: $target is none of m4, m7, host-single, host-double" >&2; exit 2 ;;
esac
make -s -C firmware "${options[@]}" BUILD="$work/firmware-$target" LIBRARY="$lib" STREAM="$work/stream.bin" >&2 \
  ${ARMRS_CONTROL:+CONTROL=1}
make -s -C firmware "${options[@]}" BUILD="$work/firmware-$target" LIBRARY="$lib" STREAM="$work/stream.bin" "${2:-run}"
