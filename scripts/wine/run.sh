#!/usr/bin/env bash
# Runs a Windows program under Wine: scripts/wine/run.sh WORK PROGRAM.exe [arguments]. WORK keeps Wine's folder.
# What the program prints ends lines as on Unix. Exit status 77 where Wine or MinGW is missing.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(realpath -m "$1") program=$2
shift 2
wine=$(command -v wine64 || command -v wine || ls /usr/lib/wine/wine64 2>/dev/null)
[ -n "$wine" ] || { echo "wine: skipped, Debian: wine64" >&2; exit 77; }
folder=$(dirname "$program")
if [ ! -f "$folder/bcryptprimitives.dll" ]; then
  command -v x86_64-w64-mingw32-gcc >/dev/null || { echo "wine: skipped, Debian: gcc-mingw-w64-x86-64" >&2; exit 77; }
  x86_64-w64-mingw32-gcc -shared -o "$folder/bcryptprimitives.dll" "$here/bcryptprimitives.c" -ladvapi32 || exit
fi
mkdir -p "$work/wine"
WINEPREFIX=$work/wine WINEDEBUG=-all "$wine" "$program" "$@" | tr -d '\r'
