#!/usr/bin/env bash
# Changed objects between two days in a town: a table of docs/changes.md.
#
#   bench/merge/changes.sh [SEED...]   11 12 13 14; WRITE_DOCS=1 writes the table there. Half an hour
#
# Routes A and B on two days, 600 scans each, with each LiDAR; half of the parking slots are drawn anew
# every day. Seeds 1 to 3 decided the rules. OUT: folder of runs and results, kept. BIN: programs;
# LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=("$@")
[ $# -gt 0 ] || seeds=(11 12 13 14)
sensors=${SENSORS:-vlp-16 os2-128}
out=${OUT:-build/bench/changes}
unimapper=${BIN:-build/release/bin}/unimapper
export keep_scans=1

# result TRIAL SENSOR SEED: $out/results/TRIAL.json
result() {
  local route store=$out/stores/$1
  [ ! -e "$out/results/$1.json" ] || return 0
  rm -rf "$store" "$out/map"
  mkdir -p "$out/results" "$out/stores"
  for route in A B; do
    make_run "$1/$route" --scene town --sensor "$2" --seed "$3" --route "$route" --scans 600
  done
  "$unimapper" map create --store "$store" >/dev/null
  "$unimapper" map add --store "$store" "$out/runs/$1/A" "$out/runs/$1/B" >/dev/null 2>&1
  "$unimapper" map merge --store "$store" >/dev/null 2>&1
  "$unimapper" map export --store "$store" --out "$out/map" >/dev/null 2>&1
  "$unimapper" evaluate changes --map "$out/map" --truth A="$out/data/$1/A" B="$out/data/$1/B" \
    >"$out/unfinished.json"
  mv "$out/unfinished.json" "$out/results/$1.json"
  rm -rf "$out/data/$1"/{A,B}/{scans,labels}
}

# figures SENSOR: over the seeds
figures() {
  local seed trials=()
  for seed in "${seeds[@]}"; do
    result "town-$1-$seed" "$1" "$seed"
    trials+=("$out/results/town-$1-$seed.json")
  done
  bench/merge/changed_objects.py "${trials[@]}"
}

rows() {
  local sensor
  echo "| seeds ${seeds[*]} | changed vehicles found | objects | changed | replaced | parts of these | stood during one visit | wrong | precision |"
  rule 9
  for sensor in $sensors; do row "$(lidar "$sensor")" 8 figures "$sensor"; done
}

table changed-objects rows
