#!/usr/bin/env bash
# Benchmark of the onboard pipeline: the quality and latency tables of docs/results.md, and the
# times of the presets in docs/porting.md (WRITE_DOCS=1 writes them there).
#
# Simulated drives of every LiDAR, and the real recordings where they lie in ../shared/data. Times are
# of the steady state: at least 40 keyframes after the warm-up (bench/latency). What is too short for
# that is driven there and back, which its row says: the recordings, and all simulated drives but the
# OS2-128's, which are half as long to save time (five minutes in all on two processors).
#
#   bench/run.sh [SCANS] [SEED] [DENSE_SEED]   scans of the OS2-128's drives; seeds of the town: of
#                                              all LiDARs, and of the dense street
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

scans=${1:-520}
seed=${2:-11}
dense_seed=${3:-3}
out=build/bench
bin=build/release/bin
recordings=../shared/data
sensors="os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360"
streets="os2-128 os2-128-dense"
real="kitti_0005a kitti_0001 hilti_hall"
smaller_presets="jetson raspberry-pi armv7-64mb"
only_layout || mkdir -p "$out"

# Name of a drive in the tables.
title() {
  case "$1" in
    os2-128) echo "OS2-128" ;;
    os2-128-dense) echo "OS2-128, dense street (seed $dense_seed)" ;;
    kitti_0005a) echo "KITTI raw 0005, there and back" ;;
    kitti_0001) echo "KITTI raw 0001, there and back" ;;
    hilti_hall) echo "Hilti hall, there and back" ;;
    *) echo "$(lidar "$1"), there and back" ;;
  esac
}

has_recordings() { only_layout || [ -e "$recordings/unpack.sh" ]; }
drives() {
  echo "$streets $sensors"
  if has_recordings; then echo "$real"; fi
}

# ---------------------------------------------------------------------------------------------
# Figures of latency-NAME.md

# times NAME ROW COLUMN...: percentiles of a stage or of calls, "a / b"; dashes if it was too short
times() {
  awk -F ' *[|] *' -v row="$2" -v columns="${*:3}" '
    BEGIN { at["p50"] = 3; at["p90"] = 4; at["p99"] = 5; at["max"] = 6 }
    $2 == row {
      n = split(columns, column, " ")
      for (i = 1; i <= n; ++i) {
        cell = $at[column[i]]
        printf "%s%s", (i > 1 ? " / " : ""), (cell == "–" ? cell : sprintf("%.1f", cell))
      }
    }' "$out/latency-$1.md"
}
removal_and_description() {
  awk "BEGIN { print $(times "$1" removal p50) + $(times "$1" description p50) }"
}
megabytes() { awk '/^[0-9]+ MB[.]$/ { printf "%s", $1 }' "$out/latency-$1.md"; }

# ---------------------------------------------------------------------------------------------
# Measurements

# latency NAME DATASET SENSOR [ARGS]: percentiles per stage as latency-NAME.md
latency() { only_layout || "$bin/latency" "${@:2}" --there-and-back >"$out/latency-$1.md"; }

# all_modes NAME DATASET SENSOR: latency at once, as NAME-deferred with deferred work, and as
# NAME-two with two workers
all_modes() {
  latency "$@"
  latency "$1-deferred" "$2" "$3" --deferred
  latency "$1-two" "$2" "$3" --workers 2
}

simulate() {  # simulate SENSOR SCANS SEED FOLDER
  only_layout && return
  rm -rf "$4"
  "$bin/unimapper" simulate --scene town --sensor "$1" --route A --scans "$2" --seed "$3" \
    --out "$4" 2>/dev/null
}

# smaller_computers SENSOR DATASET: times of their presets
smaller_computers() {
  local preset
  for preset in $smaller_presets; do latency "$1-$preset" "$2" "$1" --preset "$preset"; done
}

# ---------------------------------------------------------------------------------------------
# Tables

# run_cells NAME DATASET [ONBOARD ARGS]: accuracy of a run, and times of latency-NAME.md
run_cells() {
  local name=$1 dataset=$2 run="$out/runs/$1" score="$out/$1.json" quality="– | – | –" stage
  "$bin/unimapper" onboard "$dataset" --out "$run" --replace "${@:3}" 2>"$out/$name.log"
  if [ -d "$dataset/labels" ]; then
    "$bin/unimapper" evaluate dynamic --truth "$dataset" --run "$run" >"$score" 2>/dev/null
    quality=$(printf '%.2f | %.2f | %.2f' "$(number "$score" SA)" "$(number "$score" DA)" "$(number "$score" AA)")
  fi
  printf '%s' "$quality"
  for stage in removal description ingest; do printf ' | %s' "$(times "$name" $stage p50 p99)"; done
  printf ' | %s' "$(number "$run/stats.json" allocations_after_start)"
}

street_rows() {
  local data="$out/data/os2-128" dense="$out/data/os2-128-dense"
  simulate os2-128 "$scans" "$seed" "$data"
  all_modes os2-128 "$data" os2-128
  row "$(title os2-128)" 7 run_cells os2-128 "$data"
  latency os2-128-paper-preset "$data" os2-128 --preset paper
  row "$(title os2-128), paper's preset" 7 run_cells os2-128-paper-preset "$data" --preset paper
  smaller_computers os2-128 "$data"
  simulate os2-128 "$scans" "$dense_seed" "$dense"
  all_modes os2-128-dense "$dense" os2-128
  row "$(title os2-128-dense)" 7 run_cells os2-128-dense "$dense"
  rm -rf "$dense/scans"
}

lidar_rows() {
  local sensor data
  for sensor in $sensors; do
    data="$out/data/$sensor"
    simulate "$sensor" $((scans / 2)) "$seed" "$data"
    all_modes "$sensor" "$data" "$sensor"
    row "$(title "$sensor")" 7 run_cells "$sensor" "$data"
    [ "$sensor" != vlp-16 ] || smaller_computers vlp-16 "$data"
    rm -rf "$data/scans"
  done
}

recorded_rows() {
  local folder=
  only_layout || folder=$(sh "$recordings/unpack.sh" "$out/recordings")
  all_modes kitti_0005a "$folder/kitti_0005a" hdl-64e
  row "$(title kitti_0005a)" 7 run_cells kitti_0005a "$folder/kitti_0005a"
  latency kitti_0005a-paper-preset "$folder/kitti_0005a" hdl-64e --preset paper
  row "$(title kitti_0005a), paper's preset" 7 run_cells kitti_0005a-paper-preset "$folder/kitti_0005a" --preset paper
  all_modes kitti_0001 "$folder/kitti_0001" hdl-64e
  row "$(title kitti_0001) (no labels)" 7 run_cells kitti_0001 "$folder/kitti_0001"
  all_modes hilti_hall "$folder/hilti_hall" generic
  row "$(title hilti_hall) (no labels)" 7 run_cells hilti_hall "$folder/hilti_hall" --sensor generic
}

keyframes_table() {
  echo "| simulated town, seed $seed, and recordings | SA % | DA % | AA % | removal, p50 / p99 ms | description | ingest | allocations |"
  rule 8
  street_rows
  lidar_rows
  if has_recordings; then
    recorded_rows
  else
    echo "The real recordings are not beside the project; their rows are left out." >&2
  fi
}

# calls_table: the distribution of every call of add_scan, a row per LiDAR and recording
calls_table() {
  local drive
  echo "| calls of \`add_scan\`, ms: p50 / p90 / p99 / max | all | that close a keyframe | others | all, \`deferred\` | MB, at once / \`deferred\` |"
  rule 6
  for drive in $(drives); do row "$(title "$drive")" 5 call_cells "$drive"; done
}
call_cells() {
  local kind
  for kind in "every call" "closing call" "other calls"; do
    printf '%s | ' "$(times "$1" "$kind" p50 p90 p99 max)"
  done
  printf '%s | ' "$(times "$1-deferred" "every call" p50 p90 p99 max)"
  printf '%s / %s' "$(megabytes "$1")" "$(megabytes "$1-deferred")"
}

# presets_table: a row per computer, a column per LiDAR
presets_table() {
  local preset
  echo "| removal and description of a keyframe, sum of the p50, ms | OS2-128 | VLP-16 |"
  rule 3
  for preset in default $smaller_presets; do row "\`$preset\`" 2 preset_cells "$preset"; done
}
preset_cells() {
  local suffix="-$1" sensor separator=
  [ "$1" != default ] || suffix=
  for sensor in os2-128 vlp-16; do
    printf '%s%.0f' "$separator" "$(removal_and_description "$sensor$suffix")"
    separator=" | "
  done
}

# workers_table: a row per LiDAR and recording, a column per number of workers
workers_table() {
  local drive
  echo "| removal and description of a keyframe, sum of the p50, ms | 1 worker | 2 workers | ratio | calls that close a keyframe, p50 / p99: 1 worker | 2 workers |"
  rule 6
  for drive in $(drives); do row "$(title "$drive")" 5 worker_cells "$drive"; done
}
worker_cells() {
  local one two
  one=$(removal_and_description "$1") two=$(removal_and_description "$1-two")
  printf '%.1f | %.1f | %.2f' "$one" "$two" "$(awk "BEGIN { print $one / $two }")"
  printf ' | %s' "$(times "$1" "closing call" p50 p99)" "$(times "$1-two" "closing call" p50 p99)"
}

table keyframes keyframes_table
table latency-calls calls_table
table latency-workers workers_table
table preset-times presets_table
if only_layout; then exit 0; fi
echo
cat "$out"/latency-*.md
rm -rf "$out/data/os2-128/scans"
