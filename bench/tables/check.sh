#!/usr/bin/env bash
# Check that tables of figures in the documents are written by a command: check.sh [DOCUMENT...]
#
# A table in which most cells are figures stands between `<!-- table NAME: COMMAND -->` and
# `<!-- end of table -->`. LAYOUT=1 COMMAND prints the table without measuring, with `*` for every
# figure: the document has the same header, the same names of rows and as many columns. "measured at"
# and a commit instead of a command: its program has gone. Prints what is not so and ends with 1 if
# there is anything. BIN names the folder of programs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
if [ $# -gt 0 ]; then
  documents=("$@")
else
  cd "$root"
  documents=(README.md docs/base.md docs/changes.md docs/design/loop-acceptance.md
    docs/design/plausibility.md docs/fleet.md docs/localisation.md docs/odometry.md docs/porting.md docs/project.md docs/results.md
    docs/results-outside.md docs/security.md docs/shared-memory.md docs/wire-format.md)
fi
layouts=$(mktemp)
trap 'rm -f "$layouts"' EXIT

# What a command of ./dev runs after building and installing.
script_of() {
  case "$1" in
    "./dev tables") echo bench/tables/run.sh ;;
    "./dev arm --count") echo bench/arm/run.sh ;;
    *) echo "$1" ;;
  esac
}

# Layouts of all commands as lines "NAME: COMMAND, tab, line of the table". A script that does not
# know of layouts would measure: it is not run.
sed -nE 's/^<!-- table [a-z0-9-]+: (.+) -->$/\1/p' "${documents[@]}" | sort -u |
  while read -r command; do
    script=$(script_of "$command")
    file=$(tr ' ' '\n' <<<"$script" | grep -m1 '^bench/' || true)
    grep -qs 'LAYOUT=1\|only_layout' "$root/$file" || continue
    (cd "$root" && LAYOUT=1 bash -c "$script" </dev/null) | awk -v command="$command" '
      /^<!-- end of table -->$/ { name = "" }
      name != "" { print name " " command "\t" $0 }
      /^<!-- table / { name = $3 }'
  done >"$layouts"

awk -v layouts="$layouts" '
  BEGIN {
    while ((getline line <layouts) > 0) {
      split(line, part, "\t")
      layout[part[1], ++lines[part[1]]] = part[2]
    }
  }
  function fault(line, text) { printf "%s:%d: %s\n", name, line, text; failed = 1 }
  # Cell by cell, where `*` is any text.
  function same(line, pattern,   a, b, n, i) {
    n = split(line, a, "|")
    if (split(pattern, b, "|") != n) return 0
    for (i = 1; i <= n; ++i) if (a[i] != b[i] && b[i] != " * ") return 0
    return 1
  }
  function differs() {
    fault(FNR, at <= lines[source] ? "printed is: " layout[source, at] : "printed is no such line")
    source = ""
  }
  function finish() {
    if (rows > 2 && figures * 2 > cells && !written)
      fault(first, "a table of figures that no command writes")
    rows = cells = figures = 0
  }
  FNR == 1 { finish(); name = FILENAME; written = 0 }
  /^<!-- table [a-z0-9-]+: measured at [0-9a-f]+ -->$/ { written = 1; source = ""; next }
  /^<!-- table [a-z0-9-]+: .+ -->$/ {
    source = substr($0, 12, length($0) - 15)
    written = ++tables
    at = 0
    if (!(source in lines)) { fault(FNR, "the command does not print this table"); source = "" }
    next
  }
  /^<!-- end of table -->$/ {
    finish()
    ++at
    if (source != "" && at <= lines[source]) differs()
    written = 0
    source = ""
    next
  }
  /^\|/ {
    ++at
    if (source != "" && !same($0, layout[source, at])) differs()
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
  rows { finish() }
  END {
    finish()
    print tables + 0 " tables with a command"
    exit failed
  }' "${documents[@]}"
