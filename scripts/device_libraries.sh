#!/usr/bin/env bash
# Builds the device library for the processors below as packages that CMake and pkg-config find, one archive each.
#   scripts/device_libraries.sh FOLDER [NAME…]     NAME such as cortex-m4-single-3
# Exits with 77 and the reason where a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "$1")
shift
target=thumbv7em-none-eabihf
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/device
unset CARGO_TARGET_DIR
command -v cmake >/dev/null || { echo "device_libraries: skipped, cmake is missing (Debian: cmake)" >&2; exit 77; }
[ -d "$(rustc --print sysroot)/lib/rustlib/$target" ] || { echo "device_libraries: skipped, rustup target add $target" >&2; exit 77; }

all=(cortex-m4-single-3 cortex-m4-single-2 cortex-m7-double-3 cortex-m7-double-2)
[ $# -gt 0 ] || set -- "${all[@]}"
mkdir -p "$out"
for name; do
  case " ${all[*]} " in *" $name "*) ;; *) echo "device_libraries: $name is none of ${all[*]}" >&2; exit 2 ;; esac
  IFS=- read -r family number precision joints <<<"$name"
  options=(-DARMRS_TARGET="$target" -DARMRS_CPU="$family-$number")
  options+=(-DARMRS_SINGLE="$([ "$precision" = single ] && echo ON || echo OFF)" -DARMRS_TWO_JOINTS="$([ "$joints" = 2 ] && echo ON || echo OFF)")
  package=armrs-$name
  cmake -S crates/arm-capi -B "$work/$name" "${options[@]}" >/dev/null
  cmake --build "$work/$name" >/dev/null
  rm -rf "${work:?}/$package"
  cmake --install "$work/$name" --prefix "$work/$package" >/dev/null
  cp LICENSE-APACHE LICENSE-MIT "$work/$package"
  rm -f "$out/$package.zip"
  (cd "$work" && python3 -m zipfile -c "$out/$package.zip" "$package")
  echo "$out/$package.zip"
done
