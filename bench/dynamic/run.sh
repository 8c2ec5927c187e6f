#!/usr/bin/env bash
# Benchmark of dynamic object removal: accuracy by scene, class and range.
#
# Every LiDAR in simulated scenes of several seeds, and the labelled recording where it lies in
# ../shared/data. Prints Markdown tables: online, final and refined labels of the default, and the
# paper's preset on the recording.
#
#   bench/dynamic/run.sh [SEEDS] [SCANS] [SCENES] [DRIFT]
#       defaults: "51 52 53 54 55" 100 "town campus" lio
#
# On two cores about an hour with the defaults. Five minutes:
#
#   SENSORS="os1-64 vlp-16" bench/dynamic/run.sh 51 60 town
#
# OUT        output folder
# MEASURE=0  only print tables of what was measured before
#
# Installs and builds what is missing, unless UNIMAPPER names a program to score instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seeds=${1:-51 52 53 54 55}
scans=${2:-100}
scenes=${3:-town campus}
drift=${4:-lio}
out=${OUT:-build/bench/dynamic}
sensors=${SENSORS:-os2-128 os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360}
measures() { ! only_layout && [ "${MEASURE:-1}" != 0 ]; }
if measures; then
  mkdir -p "$out"
  rm -f "$out"/*.json
  [ -n "${UNIMAPPER:-}" ] || { ./dev setup; ./dev build unimapper >/dev/null; }
fi
unimapper=${UNIMAPPER:-${BIN:-build/release/bin}/unimapper}

recording=../shared/data
real=
if only_layout; then
  real=$recording
elif [ -e "$recording/unpack.sh" ]; then
  real=$(sh "$recording/unpack.sh" build/bench/recordings)/kitti_0005a
else
  echo "The real recordings are not beside the project; their rows are left out." >&2
fi

# ---------------------------------------------------------------------------------------------
# Measurements

# evaluate ARGS...: what it says is only of interest if it fails
evaluate() {
  "$unimapper" evaluate dynamic "$@" 2>"$out/evaluate.log" || {
    cat "$out/evaluate.log" >&2
    return 1
  }
}

# score NAME DATASET: writes OUT/NAME.default.json, NAME.final.json (labels of evicted keyframes) and
# NAME.refined.json (the merger's)
score() {
  local run="$out/runs/$1" map="$out/runs/$1.map"
  "$unimapper" onboard "$2" --out "$run" --replace --final-labels 2>"$out/$1.log"
  evaluate --truth "$2" --run "$run" >"$out/$1.default.json"
  evaluate --truth "$2" --run "$run/final" >"$out/$1.final.json"
  "$unimapper" merge "$run" --truth "$1=$2" --refined-labels --out "$map" --replace >/dev/null 2>&1
  evaluate --truth "$2" --run "$map/refined/$1" >"$out/$1.refined.json"
  rm -rf "$run" "$map"
}

measure() {
  local sensor scene seed name data
  for sensor in $sensors; do
    for scene in $scenes; do
      for seed in $seeds; do
        name="$sensor-$scene-$seed" data="$out/data/$sensor-$scene-$seed"
        rm -rf "$data"
        "$unimapper" simulate --sensor "$sensor" --scene "$scene" --drift "$drift" --seed "$seed" \
          --route A --scans "$scans" --out "$data" >/dev/null 2>&1
        score "$name" "$data"
        rm -rf "$data/scans"
      done
    done
  done
  [ -n "$real" ] || return 0
  score kitti "$real"
  "$unimapper" onboard "$real" --out "$out/runs/kitti" --preset paper 2>"$out/kitti.log"
  evaluate --truth "$real" --run "$out/runs/kitti" >"$out/kitti.paper.json"
  rm -rf "$out/runs/kitti"
}

# ---------------------------------------------------------------------------------------------
# Tables

# DA of the objects that moved while they were seen, of the file's outermost object.
moving() { sed -n '/^  "moving": {/,/}/p' "$1" | grep -oE '"DA": [0-9.]+' | grep -oE '[0-9.]+'; }

# means FILE...: SA / DA moving / AA moving, and behind a bar DA / AA, means of the files' figures
means() {
  local file
  for file in "$@"; do
    echo "$(number "$file" SA) $(number "$file" DA) $(moving "$file")"
  done | awk '
    NF != 3 { print "error: not three figures: " $0 >"/dev/stderr"; failed = 1; exit 1 }
    { sa += $1; da += $2; aa += sqrt($1 * $2); moving += $3; both += sqrt($1 * $3) }
    END { if (failed) exit 1; printf "%.2f / %.2f / %.2f|%.2f / %.2f\n",
          sa / NR, moving / NR, both / NR, da / NR, aa / NR }'
}

# scene_table SCENE: a row per LiDAR, a column per stage at which points are labelled
scene_table() {
  local sensor
  echo "| $1, seeds $seeds: SA / DA moving / AA moving % | online | final | refined | online, all dynamic: DA / AA |"
  rule 5
  for sensor in $sensors; do row "$(lidar "$sensor")" 4 scene_cells "$out/$sensor-$1"; done
}
scene_cells() {
  local labels
  for labels in default final refined; do
    printf '%s | ' "$(means "$1"-*."$labels".json | cut -d'|' -f1)"
  done
  means "$1"-*.default.json | cut -d'|' -f2
}

# recording_table: labelled points of the recording, where nothing stands for long
recording_table() {
  echo "| KITTI raw 0005, labelled points: SA / DA / AA % | online | final | refined |"
  rule 4
  row default 3 recording_cells default final refined
  row "paper's preset" 3 recording_cells paper
}
recording_cells() {
  local labels cells=()
  for labels in "$@"; do
    cells+=("$(printf '%.2f / %.2f / %.2f' "$(number "$out/kitti.$labels.json" SA)" \
      "$(number "$out/kitti.$labels.json" DA)" "$(number "$out/kitti.$labels.json" AA)")")
  done
  printf '%s | %s | %s' "${cells[0]}" "${cells[1]:-–}" "${cells[2]:-–}"
}

# breakdown class|range: a row per LiDAR and one for all, the points of their drives together
breakdown() {
  local sensor header columns
  header=$("$unimapper" evaluate breakdown --by "$1" | head -1)
  columns=$(($(tr -cd '|' <<<"$header" | wc -c) - 2))
  echo "$header"
  rule $((columns + 1))
  for sensor in $sensors; do
    row "$(lidar "$sensor")" "$columns" breakdown_cells "$1" "$out/$sensor"-*.default.json
  done
  row all "$columns" breakdown_cells "$1" "$out"/*-[0-9]*.default.json
}
breakdown_cells() {
  "$unimapper" evaluate breakdown --by "$1" --label x "${@:2}" | sed 's/^| x | //; s/ |$//'
}

! measures || measure
for scene in $scenes; do table removal-"$scene" scene_table "$scene"; done
[ -z "$real" ] || table removal-recording recording_table
table removal-by-class breakdown class
table removal-by-range breakdown range
