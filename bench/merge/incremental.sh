#!/usr/bin/env bash
# Cost of a ninth session in a stored project, and of a map as sessions are added.
#
#   bench/merge/incremental.sh [SEEDS]   "3"; two tables of docs/results.md, written there with WRITE_DOCS=1. Some
#                                        minutes a seed
#
# Nine drives of 200 scans through one town (VLP-16 with 512 columns, routes A to C on three days); the
# second table is of the last seed, and of three drives of an OS2-128 of 300 scans. OUT: folder of runs,
# kept; BIN: programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=${1:-3}
out=${OUT:-build/bench/incremental}
unimapper=${BIN:-build/release/bin}/unimapper

# timed NAME COMMAND...: its messages to NAME.txt; prints its processor time, s
timed() {
  local TIMEFORMAT='%U %S'
  { time "${@:2}" >"$out/$1.txt" 2>&1; } 2>&1 | awk '{ printf "%.1f", $1 + $2 }'
}

# loops NAME: verified and known ones of a merge
loops() { awk '/loops verified/ { print $2 " | " $5 }' "$out/$1.txt"; }

# cells NAME: of a merge of a project
cells() { printf '%s | %s' "$(loops "$1")" "${seconds[$1]}"; }

# whole_cells: of `unimapper merge`, which knows nothing
whole_cells() { printf -- '- | - | %s' "${seconds[merge]}"; }

declare -A seconds
runs=()

# make_runs SEED: `runs`
make_runs() {
  local route day
  runs=()
  for day in 0 1 2; do
    for route in A B C; do
      make_run "$1-$route-$day" --sensor vlp-16 --columns 512 --route "$route" --day "$day" \
        --seed "$1" --scans 200
      runs+=("$out/runs/$1-$route-$day")
    done
  done
}

# measure SEED: seconds of the ninth session's merge, of that of all nine, and of `unimapper merge`
measure() {
  local store
  make_runs "$1"
  rm -rf "$out/store" "$out/whole"
  for store in store whole; do "$unimapper" map create --store "$out/$store" >/dev/null; done
  "$unimapper" map add --store "$out/store" "${runs[@]:0:8}" >/dev/null 2>&1
  "$unimapper" map merge --store "$out/store" >/dev/null 2>&1
  "$unimapper" map add --store "$out/store" "${runs[8]}" >/dev/null 2>&1
  "$unimapper" map add --store "$out/whole" "${runs[@]}" >/dev/null 2>&1
  seconds[ninth]=$(timed ninth "$unimapper" map merge --store "$out/store")
  seconds[nine]=$(timed nine "$unimapper" map merge --store "$out/whole")
  seconds[merge]=$(timed merge "$unimapper" merge "${runs[@]}" --out "$out/map" --replace)
}

rows() {
  local seed
  echo "| processor time, s | loops verified | known | s |"
  rule 4
  for seed in $seeds; do
    if ! only_layout; then measure "$seed"; fi
    row "seed $seed: ninth added to eight (\`map merge\`)" 3 cells ninth
    row "seed $seed: all nine (\`map merge\`)" 3 cells nine
    row "seed $seed: all nine with labels, map and changes (\`unimapper merge\`)" 3 whole_cells
  done
}

# stage_cells SCANS RUN...: what follows from poses, milliseconds a keyframe of ten scans
stage_cells() {
  local keyframes=$((($# - 1) * $1 / 10))
  "$unimapper" merge "${@:2}" --threads 1 --out "$out/map" --replace >/dev/null 2>&1
  python3 - "$out/map/timing.json" "$keyframes" <<'PY'
import json, sys
seconds = json.load(open(sys.argv[1]))
stages = ["refinement of labels", "unified map", "changes between sessions"]
print(" | ".join("%.1f" % (1000 * seconds[stage] / int(sys.argv[2])) for stage in stages), end="")
PY
}

# dense_cells SEED: of an OS2-128
dense_cells() {
  local route dense=()
  for route in A B C; do
    make_run "os2-128-$1-$route" --sensor os2-128 --route "$route" --seed "$1" --scans 300
    dense+=("$out/runs/os2-128-$1-$route")
  done
  stage_cells 300 "${dense[@]}"
}

stage_rows() {
  local sessions last=${seeds##* }
  only_layout || make_runs "$last"
  echo "| one thread, ms per keyframe | refinement of labels | unified map | changes between sessions |"
  rule 4
  for sessions in 3 6 9; do
    row "VLP-16: $sessions sessions, $((sessions * 20)) keyframes" 3 stage_cells 200 "${runs[@]:0:sessions}"
  done
  row "OS2-128: 3 sessions, 90 keyframes" 3 dense_cells "$last"
}

table merge-incremental rows
table merge-stages stage_rows
