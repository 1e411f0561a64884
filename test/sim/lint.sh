#!/bin/sh
# Lints every Verilog file of a directory (default build/matrix/verilog, written by `make matrix`).
# Any warning not waived in fpga/verilator.vlt fails its file. Exit code 0 if all passed.
# usage: test/sim/lint.sh [DIR]
root=$(cd "$(dirname "$0")/../.." && pwd) || exit 2
dir=${1:-$root/build/matrix/verilog}
command -v verilator >/dev/null || { echo "verilator is not installed." >&2; exit 2; }
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

find "$dir" -maxdepth 1 -name '*.v' -print0 | sort -z >"$work/list"
total=$(tr -dc '\0' <"$work/list" | wc -c)
[ "$total" -gt 0 ] || { echo "No Verilog file in $dir." >&2; exit 2; }

# Each job writes its whole message at once, so that two jobs do not mix; a passed file leaves a mark.
xargs -0 -n1 -P2 sh -c '
  message=$(verilator --lint-only -Wall --default-language 1364-2005 "$1/fpga/verilator.vlt" "$3" 2>&1)
  code=$?
  if [ $code -eq 0 ] && [ -z "$message" ]; then : >"$2/$(basename "$3").passed"
  else printf "FAILED %s (verilator exit code %s)\n%s\n" "$3" "$code" "$message"; fi
' lint "$root" "$work" <"$work/list"

passed=$(find "$work" -name '*.passed' | wc -l)
echo "$passed passed, $((total - passed)) failed"
[ "$passed" -eq "$total" ]
