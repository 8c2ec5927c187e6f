#!/usr/bin/env bash
# Benchmark of fine cells: their size, and how many of them smaller computers have room for.
#
# Writes three tables of docs/results.md: labels of the default beside those with cells of 0.25 m,
# merged maps of both, and labels with the presets of smaller computers. About ten minutes on two
# processors; needs `./dev build unimapper bench/all`.
#
#   bench/dynamic/cells.sh       WRITE_DOCS=1 writes the tables there; TABLES="computers size maps"
#                                says which
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/cells
unimapper=${UNIMAPPER:-${BIN:-build/release/bin}/unimapper}
tables=${TABLES:-computers size maps}
wants() { [[ " $tables " == *" $1 "* ]]; }
# Scene, sensor, seed.
drives="town-os2-128-2 town-os2-128-3 town-os1-64-3 town-livox-avia-3 town-livox-mid-360-3
  street-os2-128-3 street-os2-128-4 street-livox-mid-360-3 square-os2-128-2 campus-os1-64-3
  campus-vlp-16-3 deck-vlp-16-3 tunnel-vlp-16-3 hall-livox-mid-360-3"
worlds="town-7 town-9 campus-8"
presets="default raspberry-pi armv7-64mb"

has_recordings() { only_layout || [ -e ../shared/data/unpack.sh ]; }

# title NAME: "scene-sensor-seed" in words
title() {
  local rest=${1#*-}
  if [ "$1" = kitti ]; then echo "KITTI raw 0005"; return; fi
  echo "${1%%-*}, $(lidar "${rest%-*}"), seed ${rest##*-}"
}

simulate() {  # simulate NAME SCANS [ARGS]: "scene-sensor-seed" into data/NAME
  local rest=${1#*-}
  "$unimapper" simulate --scene "${1%%-*}" --sensor "${rest%-*}" --seed "${rest##*-}" --scans "$2" \
    --out "$out/data/$1" "${@:3}" 2>/dev/null
}

onboard() {  # onboard RUN DATASET [ARGS]
  "$unimapper" onboard "$2" --out "$out/runs/$1" --replace "${@:3}" 2>"$out/$1.log"
}

score() {  # score RUN DATASET
  "$unimapper" evaluate dynamic --truth "$2" --run "$out/runs/$1" >"$out/$1.json" 2>/dev/null
}

label_cells() {  # label_cells RUN
  printf '%.2f / %.2f / %.2f' "$(number "$out/$1.json" SA)" "$(number "$out/$1.json" DA)" \
    "$(number "$out/$1.json" AA)"
}

# Most cells of a keyframe of a run, thousands.
cells_of() {
  awk '/"cells": \{/ { inside = 1 }
    inside && /"used"/ { gsub(/[^0-9]/, ""); printf "%.0f", $0 / 1000; exit }' "$out/runs/$1/stats.json"
}

# ---------------------------------------------------------------------------------------------
# Size

both_sizes() {  # both_sizes NAME DATASET [ARGS]
  local size
  for size in 20 25; do
    onboard "$1-$size" "$2" --config "$out/onboard-$size.json" "${@:3}"
    score "$1-$size" "$2"
  done
}

size_cells() {
  local name=$1
  if [ "$name" = kitti ]; then
    both_sizes kitti "$(sh ../shared/data/unpack.sh "$out/recordings")/kitti_0005a"
  else
    simulate "$name" 60
    both_sizes "$name" "$out/data/$name"
    rm -rf "$out/data/$name"
  fi
  printf '%s | %s | %s → %s' "$(label_cells "$name-20")" "$(label_cells "$name-25")" \
    "$(cells_of "$name-20")" "$(cells_of "$name-25")"
}

size_table() {
  local name
  echo "| 60 scans, SA / DA / AA % | 0.2 m | 0.25 m | cells of a keyframe, thousands |"
  rule 4
  for name in $drives; do row "$(title "$name")" 3 size_cells "$name"; done
  if has_recordings; then row "$(title kitti), all scans" 3 size_cells kitti; fi
}

# ---------------------------------------------------------------------------------------------
# Merged maps

merge() {  # merge WORLD SIZE: three robots' runs
  local robot runs=() truths=()
  for robot in 0 1 2; do
    onboard "$1-$robot-$2" "$out/data/$1-$robot" --config "$out/onboard-$2.json"
    runs+=("$out/runs/$1-$robot-$2")
    truths+=(--truth "$1-$robot-$2=$out/data/$1-$robot")
  done
  "$unimapper" merge "${runs[@]}" "${truths[@]}" --config "$out/merge-$2.json" --out "$out/map-$1-$2" \
    --replace --allow-unconnected >"$out/map-$1-$2.txt" 2>/dev/null
}

map_cells() {  # map_cells WORLD SIZE
  local sensors=(os2-128 livox-avia vlp-16) routes=(A B C) robot
  if [ "$2" = 20 ]; then
    for robot in 0 1 2; do
      "$unimapper" simulate --scene "${1%-*}" --seed "${1#*-}" --sensor "${sensors[robot]}" \
        --route "${routes[robot]}" --day "$robot" --scans 200 --out "$out/data/$1-$robot" 2>/dev/null
    done
  fi
  merge "$1" "$2"
  awk -F '  +' '
    /^session / { for (i = 1; i <= NF; ++i) column[$i] = i }
    $3 ~ /^(merged|central|unconnected)$/ { ate[++n] = $column["ATE rmse m"] }
    /^loops: / { split($0, word, " "); accepted = word[2] }
    END { printf "%s | %s / %s / %s", accepted, ate[1], ate[2], ate[3] }' "$out/map-$1-$2.txt"
  [ "$2" != 25 ] || rm -rf "$out/data/$1"-?
}

maps_table() {
  local world size
  echo "| OS2-128, Avia and VLP-16, 200 scans each | accepted inter-session loops | ATE m: OS2-128 / Avia / VLP-16 |"
  rule 3
  for world in $worlds; do
    for size in 20 25; do row "${world/-/, seed }, 0.$size m" 2 map_cells "$world" "$size"; done
  done
}

# ---------------------------------------------------------------------------------------------
# Smaller computers

computer_drives() {
  only_layout && return
  simulate town-os2-128-11 120
  simulate town-os2-128-3 300
}

computer_cells() {  # computer_cells PRESET
  local name separator=
  for name in town-os2-128-11 town-os2-128-3; do
    onboard "$name-$1" "$out/data/$name" --preset "$1"
    score "$name-$1" "$out/data/$name"
    printf '%s%s' "$separator" "$(label_cells "$name-$1")"
    separator=" | "
  done
}

computers_table() {
  local preset
  echo "| SA / DA / AA % | OS2-128, town, seed 11, 120 scans | seed 3, 300 scans |"
  rule 3
  for preset in $presets; do row "\`$preset\`" 2 computer_cells "$preset"; done
}

if ! only_layout; then
  rm -rf "$out"
  mkdir -p "$out/data" "$out/runs"
  echo '{}' | tee "$out/onboard-20.json" >"$out/merge-20.json"
  echo '{"voxel": {"fine_size_m": 0.25, "coarse_size_m": 2.0}}' >"$out/onboard-25.json"
  echo '{"refinement": {"cell_size_m": 0.25}}' >"$out/merge-25.json"
fi
if wants computers; then
  computer_drives
  table cell-computers computers_table
  only_layout || rm -rf "$out/data"/*
fi
if wants size; then table cell-size size_table; fi
if wants maps; then table cell-size-maps maps_table; fi
