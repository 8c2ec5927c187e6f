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
# shellcheck source=bench/merge/project.sh
source bench/merge/project.sh

seeds=${1:-3}
out=${OUT:-build/bench/incremental}
unimapper=${BIN:-build/release/bin}/unimapper
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

# measure SEED: the ninth session's merge, that of all nine, and `unimapper merge`
measure() {
  make_runs "$1"
  project "$out/store" "${runs[@]:0:8}"
  map merge "$out/store"
  map add "$out/store" "${runs[8]}"
  measured ninth "$unimapper" map merge --store "$out/store"
  project "$out/store" "${runs[@]}"
  measured nine "$unimapper" map merge --store "$out/store"
  measured merge "$unimapper" merge "${runs[@]}" --out "$out/map" --replace
}

# cells NAME: verified and known loops of a merge of a project, and its processor time
cells() { printf '%s | %s' "$(awk '/loops verified/ { print $2 " | " $5 }' "$out/$1.txt")" "${seconds[$1]}"; }

# whole_cells: of `unimapper merge`, which knows nothing
whole_cells() { echo "- | - | ${seconds[merge]}"; }

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

# stage_cells KEYFRAMES RUN...: what follows from poses, milliseconds a keyframe
stage_cells() {
  local stage separator=
  "$unimapper" merge "${@:2}" --threads 1 --out "$out/map" --replace >/dev/null 2>&1
  for stage in "refinement of labels" "unified map" "changes between sessions"; do
    printf '%s%s' "$separator" "$(number "$out/map/timing.json" "$stage" | awk -v n="$1" '{ printf "%.1f", 1000 * $1 / n }')"
    separator=" | "
  done
}

# dense_cells SEED: of an OS2-128
dense_cells() {
  local route dense=()
  for route in A B C; do
    make_run "os2-128-$1-$route" --sensor os2-128 --route "$route" --seed "$1" --scans 300
    dense+=("$out/runs/os2-128-$1-$route")
  done
  stage_cells 90 "${dense[@]}"
}

stage_rows() {
  local sessions last=${seeds##* }
  only_layout || make_runs "$last"
  echo "| one thread, ms per keyframe | refinement of labels | unified map | changes between sessions |"
  rule 4
  for sessions in 3 6 9; do
    row "VLP-16: $sessions sessions, $((sessions * 20)) keyframes" 3 stage_cells $((sessions * 20)) \
      "${runs[@]:0:sessions}"
  done
  row "OS2-128: 3 sessions, 90 keyframes" 3 dense_cells "$last"
}

table merge-incremental rows
table merge-stages stage_rows
