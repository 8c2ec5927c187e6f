#!/usr/bin/env bash
# Peak memory of merges and exports of a stored project: a table of docs/results.md.
#
#   bench/merge/memory.sh [SEEDS]   "3"; WRITE_DOCS=1 writes the table there. Ten minutes a seed
#
# Two drives and three of 300 scans (30 keyframes) through one town, OS2-128, routes A to C on three
# days. What grows with the number of keyframes is read off where the limit is so small that what it
# limits is full with two drives; one drive does without what sessions take that are compared.
# OUT: folder of runs, kept; BIN: programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/project.sh
source bench/merge/project.sh

seeds=${1:-3}
out=${OUT:-build/bench/memory}
unimapper=${BIN:-build/release/bin}/unimapper
small_mb=100
default_mb=2000
fleet=36000

# measure SEED: merges and exports of two drives and of three
measure() {
  local route day=0 drives limit runs=()
  for route in A B C; do
    make_run "$1-$route" --sensor os2-128 --route "$route" --day "$day" --seed "$1" --scans 300
    runs+=("$out/runs/$1-$route")
    day=$((day + 1))
  done
  for drives in 2 3; do
    for limit in $default_mb $small_mb; do
      project "$out/store" "${runs[@]:0:drives}"
      measured "merge-$drives-$limit" "$unimapper" map merge --store "$out/store" --memory "$limit"
      measured "export-$drives-$limit" "$unimapper" map export --store "$out/store" \
        --memory "$limit" --out "$out/map" --replace
    done
  done
}

# cells COMMAND LIMIT: peaks with two drives and three, slope, peak of the fleet, processor time
cells() {
  awk -v two="${peak_mb[$1-2-$2]}" -v three="${peak_mb[$1-3-$2]}" -v s="${seconds[$1-3-$2]}" \
    -v limit="$2" -v default="$default_mb" -v fleet="$fleet" 'BEGIN {
      slope = (three - two) / 30
      # Noise does not give memory back.
      whole = (three + (slope > 0 ? slope : 0) * (fleet - 90) + default - limit) / 1000
      printf "%d | %d | %.2f | %s | %s", two, three, slope,
        limit == default ? "-" : sprintf("%.1f", whole), s
    }'
}

rows() {
  local seed command
  echo "| OS2-128 | 60 keyframes, MB | 90 keyframes, MB | MB per keyframe | 36,000 keyframes at the default limit, GB | processor time of 90, s |"
  rule 6
  for seed in $seeds; do
    if ! only_layout; then measure "$seed"; fi
    for command in merge export; do
      row "seed $seed: \`map $command\`" 5 cells $command $default_mb
      row "seed $seed: \`map $command --memory $small_mb\`" 5 cells $command $small_mb
    done
  done
}

table merge-memory rows
