#!/usr/bin/env bash
# Writes the header of the C interface, or with --check says whether the one in the repository is current.
# Needs cbindgen 0.27 or newer (Debian: cbindgen-web); without it --check skips and says so.
set -euo pipefail
cd "$(dirname "$0")/../crates/arm-capi"

if ! command -v cbindgen >/dev/null; then
  [ "${1:-}" = --check ] && { echo "capi_header: skipped, no cbindgen here (Debian: cbindgen-web)"; exit 0; }
  echo "capi_header: cbindgen is missing (Debian: cbindgen-web)" >&2
  exit 1
fi
if [ "${1:-}" = --check ]; then
  cbindgen --quiet --config cbindgen.toml --output include/armrs.h --verify . ||
    { echo "capi_header: include/armrs.h is not current; run scripts/capi_header.sh" >&2; exit 1; }
else
  cbindgen --quiet --config cbindgen.toml --output include/armrs.h .
fi
