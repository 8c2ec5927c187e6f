#!/usr/bin/env bash
# Benchmark of dynamic object removal: accuracy by scene, class, range and variant.
#
# Every LiDAR in simulated scenes of several seeds with several kinds of odometry, and the labelled
# recording where it lies in ../shared/data. Prints Markdown tables: the default, by class and by
# range; variants that leave one rule out, and the paper taken literally.
# Pictures of the first seed's drives go to build/bench/dynamic/pictures.
#
#   bench/dynamic/run.sh [SEEDS] [SCANS] [SCENES] [DRIFTS]
#       defaults: "21 22 23" 100 "town campus" "lio icp"
#
# TABLES says which: accuracy, rules (default: both). docs/results.md shows each for other drives,
# so WRITE_DOCS=1 needs one of them.
#
# Runtime is bounded: variants are scored in the first scene with the first odometry only. On two
# cores about half an hour with the defaults. Five minutes, and one LiDAR alone:
#
#   bench/dynamic/run.sh 21 60 town lio
#   SENSORS=vlp-16 VARIANTS="default paper" bench/dynamic/run.sh
#
# OUT        output folder
# MEASURE=0  only print tables of what was measured before
#
# Installs and builds what is missing, unless UNIMAPPER names a program to score instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seeds=${1:-21 22 23}
scans=${2:-100}
scenes=${3:-${SCENES:-town campus}}
drifts=${4:-${DRIFTS:-lio icp}}
out=${OUT:-build/bench/dynamic}
sensors=${SENSORS:-os2-128 os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360}
tables=${TABLES:-accuracy rules}
wants() { [[ " $tables " == *" $1 "* ]]; }
[ -z "${WRITE_DOCS:-}" ] || [[ "$tables" != *" "* ]] || {
  echo "error: name the table to write, as its line in docs/results.md does: TABLES=..." >&2
  exit 2
}
measures() { ! only_layout && [ "${MEASURE:-1}" != 0 ]; }
if measures; then
  mkdir -p "$out"
  rm -f "$out"/*.json "$out"/*.stats
fi

if measures && [ -z "${UNIMAPPER:-}" ]; then
  ./dev setup toolchains/packages-bench.txt
  ./dev build unimapper bench/all >/dev/null
fi
unimapper=${UNIMAPPER:-${BIN:-build/release/bin}/unimapper}

# shellcheck source=bench/dynamic/tables.sh
source bench/dynamic/tables.sh

# Every variant is the default with one thing changed.
all_variants="default paper no-log-odds-carry elevated-ground seen-through-ground unpropagated-ground \
full-weight-everywhere no-components no-persistence other-keyframes-only no-final-labels"
wants rules || all_variants=default
read -ra variants <<<"${VARIANTS:-$all_variants}"
recorded_variants=("${variants[@]}")
wants rules || ! wants accuracy || recorded_variants=(default paper)
config_of() {
  case "$1" in
    no-log-odds-carry) echo '{"removal": {"log_odds_clamp": 0}}' ;;
    elevated-ground) echo '{"ground": {"elevated_step_m": 0}}' ;;
    seen-through-ground) echo '{"ground": {"seen_through_share": 0}}' ;;
    unpropagated-ground) echo '{"ground": {"propagation_voxels": 1}}' ;;
    no-final-labels) echo '{"removal": {"final_labels": false}}' ;;
    full-weight-everywhere) echo '{"free_space": {"full_weight_range_m": 0}}' ;;
    no-components) echo '{"removal": {"components": false}}' ;;
    no-persistence) echo '{"removal": {"persistence_share": 0}}' ;;
    other-keyframes-only) echo '{"free_space": {"own_keyframe": false}}' ;;
    *) echo '{}' ;;
  esac
}

# simulate SENSOR SCENE DRIFT SEED FOLDER [SCANS]
simulate() {
  rm -rf "$5"
  "$unimapper" simulate --sensor "$1" --scene "$2" --drift "$3" --seed "$4" --route A \
    --scans "${6:-$scans}" --out "$5" >/dev/null 2>&1
}

first() { echo "${1%% *}"; }

# Scenes of the list that this simulator has.
known() {
  local scene
  for scene in $1; do
    if simulate vlp-16 "$scene" lio 1 "$out/data/probe" 1; then
      printf '%s ' "$scene"
    else
      echo "The simulator has no scene \"$scene\"; its rows are left out." >&2
    fi
  done
}
! measures || scenes=$(known "$scenes")
first_drive="$(first "$scenes")-$(first "$drifts")"

# evaluate ARGS...: what it says is only of interest if it fails
evaluate() {
  "$unimapper" evaluate dynamic "$@" 2>"$out/evaluate.log" || {
    cat "$out/evaluate.log" >&2
    return 1
  }
}

# score NAME DATASET VARIANT [EVALUATE ARGS]: writes OUT/NAME.VARIANT.json, and for the default also
# NAME.final.json (labels of evicted keyframes) and NAME.refined.json (the merger's)
score() {
  local name=$1 data=$2 variant=$3 run="$out/runs/$1.$3" preset=default labels=() relabelled=1
  { wants accuracy && [ "$variant" = default ]; } || relabelled=
  [ -z "$relabelled" ] || labels=(--final-labels)
  shift 3
  [ "$variant" != paper ] || preset=paper
  config_of "$variant" >"$out/$name.$variant.config"
  "$unimapper" onboard "$data" --out "$run" --replace --preset "$preset" \
    --config "$out/$name.$variant.config" "${labels[@]}" 2>"$out/$name.$variant.log"
  cp "$run/stats.json" "$out/$name.$variant.stats"
  evaluate --truth "$data" --run "$run" "$@" >"$out/$name.$variant.json"
  [ -z "$relabelled" ] || score_relabelled "$name" "$data" "$run"
  rm -rf "$run"
}

# score_relabelled NAME DATASET RUN
score_relabelled() {
  local map="$out/runs/$1.map" session
  session=$(basename "$3")
  evaluate --truth "$2" --run "$3/final" >"$out/$1.final.json"
  "$unimapper" merge "$3" --truth "$session=$2" --refined-labels --out "$map" --replace >/dev/null 2>&1
  evaluate --truth "$2" --run "$map/refined/$session" >"$out/$1.refined.json"
  rm -rf "$map"
}

recording=../shared/data
real=
if only_layout; then
  real=$recording
elif [ -e "$recording/unpack.sh" ]; then
  real=$(sh "$recording/unpack.sh" build/bench/recordings)/kitti_0005a
else
  echo "The real recordings are not beside the project; their rows are left out." >&2
fi

score_simulated() {
  local sensor=$1 scene=$2 drift=$3 seed=$4 name="$1-$2-$3-$4" variant pictures=()
  local data="$out/data/$name"
  [ "$seed" != "$(first "$seeds")" ] || pictures=(--pictures "$out/pictures/$name" --replace)
  simulate "$sensor" "$scene" "$drift" "$seed" "$data"
  score "$name" "$data" default "${pictures[@]}"
  if [ "$scene-$drift" = "$first_drive" ]; then
    for variant in "${variants[@]:1}"; do score "$name" "$data" "$variant"; done
  fi
  rm -rf "$data/scans"
}

measure() {
  local sensor scene drift seed variant
  for sensor in $sensors; do
    for scene in $scenes; do
      for drift in $drifts; do
        for seed in $seeds; do score_simulated "$sensor" "$scene" "$drift" "$seed"; done
      done
    done
  done
  [ -n "$real" ] || return 0
  score kitti "$real" default --pictures "$out/pictures/kitti" --replace
  for variant in "${recorded_variants[@]:1}"; do score kitti "$real" "$variant"; done
}

! measures || measure
if wants accuracy; then
  only_layout || overview
  for scene in $scenes; do
    table removal-"$scene" scene_table "$scene" "$(first "$drifts")"
  done
  [ -z "$real" ] || table removal-recording recording_table
  table removal-by-class breakdown class
  table removal-by-range breakdown range
fi
if wants rules; then table removal-by-rule rules_table; fi
