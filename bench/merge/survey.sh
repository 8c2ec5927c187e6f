#!/usr/bin/env bash
# Drives placed in the map of a survey: a table of docs/results.md.
#
#   bench/merge/survey.sh [SEEDS]   "11 12"; WRITE_DOCS=1 writes the table there. Some minutes a seed
#
# The survey is the exported map of a drive through a town, without drift (OS1-64 with 512 columns, 200
# scans, route A, day 0), as a point cloud and nothing else. Into its frame come drives of the same town
# on other days and of another town, with drift. OUT: folder of runs, kept; BIN: programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/project.sh
source bench/merge/project.sh

seeds=${1:-11 12}
out=${OUT:-build/bench/survey}
unimapper=${BIN:-build/release/bin}/unimapper

# drive NAME SEED SENSOR ROUTE DAY DRIFT: a run
drive() {
  make_run "$1" --sensor "$3" --columns 512 --route "$4" --day "$5" --seed "$2" --scans 200 \
    --drift "$6"
}

# measure SEED: the runs, and the store survey-SEED
measure() {
  drive "$1-A" "$1" os1-64 A 0 none
  drive "$1-B" "$1" os1-64 B 1 lio
  drive "$1-C" "$1" vlp-16 C 2 lio
  drive "$1-other" "$(($1 + 100))" os1-64 B 1 lio
  merged_map "$out/drive" "$out/map-$1" "$out/runs/$1-A"
  rm -rf "$out/survey-$1"
  map create "$out/survey-$1"
  map survey "$out/survey-$1" "$out/map-$1/map.ply" --name survey
}

# place SEED RUN: status and errors of a run in the survey
place() {
  rm -rf "$out/placed"
  cp -r "$out/survey-$1" "$out/placed"
  map add "$out/placed" "$out/runs/$2"
  map merge "$out/placed"
  map export "$out/placed" --out "$out/placed-map" --replace
  bench/merge/errors.py survey "$out/placed-map" "$out/map-$1/trajectories/$1-A.tum" \
    "$out/data/$1-A" "$2" "$out/data/$2"
}

rows() {
  local seed
  echo "| a session in the survey | state | rms, m | worst, m |"
  rule 4
  for seed in $seeds; do
    if ! only_layout; then measure "$seed"; fi
    row "seed $seed: OS1-64, route B, another day" 3 place "$seed" "$seed-B"
    row "seed $seed: VLP-16, route C, another day" 3 place "$seed" "$seed-C"
    row "seed $seed: OS1-64, another town" 3 place "$seed" "$seed-other"
  done
}

table merge-survey rows
