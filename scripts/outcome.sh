# Sourced by crosscheck and foreign_wheels: what came out as it must, what did not, and what could not be tried here, with the reason.
# shellcheck shell=bash disable=SC2034 # the scripts add to the lists
strict=
[ "${1:-}" = --strict ] && strict=1 && shift
same=() differ=() absent=()

have() { command -v "$1" >/dev/null; }
skip() { absent+=("$1 ($2)"); return 1; } # name, reason
lacking() { tail -n 1 "$1" | sed 's/.*skipped, //'; } # what a script that ended with status 77 said to the log that it lacks

conclude() { # what the absent were not, such as checked: says it, and ends with the status
  [ ${#absent[@]} -gt 0 ] && echo "not $1 here: $(printf '%s; ' "${absent[@]}")"
  [ ${#differ[@]} -eq 0 ] || { echo "NOT as it must be: $(printf '%s; ' "${differ[@]}")" >&2; exit 1; }
  [ -z "$strict" ] || [ ${#absent[@]} -eq 0 ] || { echo "${0##*/} --strict: something was not $1" >&2; exit 1; }
  exit 0
}
