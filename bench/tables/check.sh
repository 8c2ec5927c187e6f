#!/usr/bin/env bash
# Check that tables of figures in the documents are written by a command: check.sh [SOURCE_TREE]
#
# In README.md, docs/porting.md and docs/results.md, a table in which most cells are figures stands
# between `<!-- table NAME: COMMAND -->`, where COMMAND's script mentions NAME, and
# `<!-- end of table -->`; or under `<!-- measured once: WHAT -->`, if it compares with what is gone.
# Prints the others and ends with 1 if there are any.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${1:-$here/../..}"
faults=$(mktemp)
trap 'rm -f "$faults"' EXIT

documents=(README.md docs/porting.md docs/results.md)
awk '
  function finish() {
    if (rows > 2 && figures * 2 > cells && !written)
      printf "%s:%d: a table of figures that no command writes\n", name, first
    rows = cells = figures = 0
  }
  FNR == 1 { finish(); name = FILENAME; written = 0 }
  /^<!-- table [a-z0-9-]+: .+ -->$/ { written = 1; next }
  /^<!-- measured once: .+ -->$/ { written = 1; once = 1; next }
  /^<!-- end of table -->$/ { finish(); written = 0; next }
  /^\|/ {
    if (rows++ == 0) first = FNR
    if (rows <= 2) next
    n = split($0, cell, "|")
    for (i = 3; i < n; ++i) {
      if (cell[i] ~ /^ *$/) continue
      ++cells
      if (cell[i] ~ /[0-9]/ && cell[i] !~ /[a-z][a-z][a-z]/) ++figures
    }
    next
  }
  rows { finish(); if (once) written = once = 0 }
  END { finish() }
' "${documents[@]}" >"$faults"

# Every name is known to the script that is said to write it.
grep -hoE '^<!-- table [a-z0-9-]+: .+ -->$' "${documents[@]}" |
  sed -E 's/^<!-- table ([a-z0-9-]+): (.+) -->$/\1 \2/' | while read -r name command; do
  case "$command" in
    "./dev "*) folder=bench/$(cut -d' ' -f2 <<<"$command") ;;
    *) folder=$(dirname "$(tr ' ' '\n' <<<"$command" | grep -m1 '^bench/')") ;;
  esac
  grep -qE "table(\.sh)? ($name\b|${name%-*}-\"?\\$)" "$folder"/*.sh 2>/dev/null ||
    echo "$command does not write the table $name"
done >>"$faults"
cat "$faults"
echo "$(grep -hcE '^<!-- (table|measured once)' "${documents[@]}" | awk '{ n += $1 } END { print n + 0 }') tables with their source, $(wc -l <"$faults") faults"
[ ! -s "$faults" ]
