#!/usr/bin/env bash
# Trajectory errors of the merged sessions of the demonstration: a table of docs/results.md.
#
#   bench/merge/run.sh     four minutes; WRITE_DOCS=1 writes the table there
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/merge

demo() {  # demo NAME [ARGS]
  mkdir -p "$out"
  bench/demo/run.sh "${@:2}" --out="$out/$1" >"$out/$1.txt"
}

# error_cells NAME: ATE of every session, out of what the merger printed
error_cells() {
  local session separator=
  for session in ouster avia velodyne; do
    printf '%s%s' "$separator" "$(awk -F '  +' -v session=$session '
      /^session / { for (i = 1; i <= NF; ++i) if ($i == "ATE rmse m") column = i }
      $1 == session && column { print $column ($3 == "central" ? " (central)" : "") }' "$out/$1.txt")"
    separator=" | "
  done
}

error_table() {
  echo "| ATE rmse, m | OS2-128, route A | Livox Avia, route B | VLP-16, route C |"
  rule 4
  row "400 scans each (\`./dev demo\`)" 3 error_cells demo
  row "200 scans each (\`./dev demo --quick\`)" 3 error_cells quick
}

if ! only_layout; then
  demo demo
  demo quick --quick
fi
table merge-ate error_table
