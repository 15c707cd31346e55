#!/usr/bin/env bash
# Builds for another system from Linux, with the distribution's compilers; the standard library is that of the toolchain (`rustup target
# add TARGET`), or is made from the distribution's source.
#   scripts/foreign.sh TARGET WORK [cargo arguments]    the results are in WORK/foreign/TARGET/release
# With ARMRS_GLIBC=2.17, for Linux, Zig's linker takes the place of the distribution's: the results, in WORK/portable, need no newer glibc.
# For musl and macOS there is no other linker; their results are in WORK/foreign.
# Exit status 77, and the last line names what to install, where something is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$1 work=$(realpath -m "$2")
shift 2
skip() { echo "foreign.sh: skipped, $1" >&2; exit 77; }
have() { command -v "$1" >/dev/null; }

case $target in
x86_64-unknown-linux-gnu) linker=cc packages=gcc ;;
aarch64-unknown-linux-gnu) linker=aarch64-linux-gnu-gcc packages="gcc-aarch64-linux-gnu libc6-dev-arm64-cross" ;;
armv7-unknown-linux-gnueabihf) linker=arm-linux-gnueabihf-gcc packages="gcc-arm-linux-gnueabihf libc6-dev-armhf-cross" ;;
i686-unknown-linux-gnu) linker=i686-linux-gnu-gcc packages="gcc-i686-linux-gnu libc6-dev-i386-cross" ;;
riscv64gc-unknown-linux-gnu) linker=riscv64-linux-gnu-gcc packages="gcc-riscv64-linux-gnu libc6-dev-riscv64-cross" ;;
s390x-unknown-linux-gnu) linker=s390x-linux-gnu-gcc packages="gcc-s390x-linux-gnu libc6-dev-s390x-cross" ;;
x86_64-pc-windows-gnu) linker=x86_64-w64-mingw32-gcc packages="gcc-mingw-w64-x86-64" ;;
x86_64-unknown-linux-musl | aarch64-apple-darwin) linker=zig ;;
*) skip "$target is not known here" ;;
esac
own=$(rustc --print target-libdir --target "$target" 2>/dev/null || true)
if ! compgen -G "$own/libstd-*.rlib" >/dev/null; then
  own=
  have /usr/bin/rustc || skip "Debian: rustc-web cargo-web rust-web-src"
  [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/vendor" ] || skip "Debian: rustc-web cargo-web rust-web-src"
fi
if [ -n "${ARMRS_GLIBC:-}" ]; then
  have cargo-zigbuild || skip "pip install ziglang cargo-zigbuild"
  build=(zigbuild --target "$target.$ARMRS_GLIBC" --target-dir "$work/portable") flags=
elif [ "$linker" = zig ]; then
  have cargo-zigbuild || skip "pip install ziglang cargo-zigbuild"
  build=(zigbuild --target "$target" --target-dir "$work/foreign") flags=
  # A shared library for musl needs its C library to be shared as well.
  [ "${target##*-}" = musl ] && flags="-C target-feature=-crt-static"
else
  have "$linker" || skip "Debian: $packages"
  build=(build --target "$target" --target-dir "$work/foreign") flags="-C linker=$linker"
fi
if [ -z "$own" ]; then
  scripts/sysroot.sh "$target" "$work/sysroot-$target" || skip "its standard library did not build"
  # It carries no bitcode for link-time optimisation.
  export CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_DEBUG=0 CARGO_PROFILE_RELEASE_CODEGEN_UNITS=4
  export RUSTC=/usr/bin/rustc
  flags+=" --sysroot $work/sysroot-$target"
fi
RUSTFLAGS="$flags" cargo "${build[@]}" --quiet --release "$@"
