#!/usr/bin/env bash
# Trajectory errors and agreement of the merged sessions of the demonstration: tables of
# docs/results.md.
#
#   bench/merge/run.sh     four minutes; WRITE_DOCS=1 writes the tables there
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
  awk -F '  +' '
    /^session / { for (i = 1; i <= NF; ++i) if ($i == "ATE rmse m") column = i }
    column && NF >= column { ate[$1] = $column ($3 == "central" ? " (central)" : "") }
    END { printf "%s | %s | %s", ate["ouster"], ate["avia"], ate["velodyne"] }' "$out/$1.txt"
}

error_table() {
  echo "| ATE rmse, m | OS2-128, route A | Livox Avia, route B | VLP-16, route C |"
  rule 4
  row "400 scans each (\`./dev demo\`)" 3 error_cells demo
  row "200 scans each (\`./dev demo --quick\`)" 3 error_cells quick
}

# quality_cells SESSION SESSION: how the two agree in the demo's map, and where the truth puts them
quality_cells() {
  python3 - "$out/demo/map/quality.json" "$1" "$2" <<'PY'
import json, sys
pairs = json.load(open(sys.argv[1]))["pairs"]
pair = next(p for p in pairs if {p["first"], p["second"]} == set(sys.argv[2:4]))
def text(of):
    figures = [of["walls_median_m"], of["walls_p90_m"], of["AC_0.5m"], of["AC_5m"], of["CD_5m"]]
    return " / ".join("%.2f" % figure for figure in figures)
print(text(pair), text(pair["at_truth"]), "%.2f" % pair["MME_5m"], sep=" | ", end="")
PY
}

quality_table() {
  echo "| walls apart, median / nine in ten, m; AC within 0.5 m, AC within 5 m, m; CD within 5 m, m² | merged | at the truth | MME |"
  rule 4
  row "OS2-128 and Livox Avia" 3 quality_cells ouster avia
  row "OS2-128 and VLP-16" 3 quality_cells ouster velodyne
  row "Livox Avia and VLP-16" 3 quality_cells avia velodyne
}

if ! only_layout; then
  demo demo
  demo quick --quick
fi
table merge-ate error_table
table merge-quality quality_table
