#!/usr/bin/env bash
# Benchmark of the onboard pipeline: the quality and latency tables of docs/results.md, and the
# times of the presets in docs/porting.md (WRITE_DOCS=1 writes them there).
#
# Simulated drives of every LiDAR and the real recordings where they lie in ../shared/data;
# hostile scans; cost over points and distance; a drive at real-time rate. Times are of the steady
# state: at least 40 keyframes after the warm-up (bench/latency). What is too short for that is driven
# there and back, which its row says: the recordings, and all simulated drives but the OS2-128's,
# which are half as long to save time (seven minutes in all on two processors).
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

header() {
  echo "| $1 | SA % | DA % | AA % | removal, p50 / p99 ms | description | ingest | allocations |"
  rule 8
}

# steady FILE STAGE KEY: a figure of the steady state, or a dash if the drive was too short
steady() {
  local figure
  figure=$(sed '/"warm_up_ms"/,$d' "$1" | stage /dev/stdin "$2" "$3")
  printf '%s' "${figure:-–}"
}

# warm_up FILE STAGE KEY: the same of the keyframes before
warm_up() { sed -n '/"warm_up_ms"/,$p' "$1" | stage /dev/stdin "$2" "$3"; }

# run_cells NAME DATASET [ONBOARD ARGS]: accuracy of a run, and times of latency-NAME.json
run_cells() {
  local name=$1 dataset=$2 run="$out/runs/$1" score="$out/$1.json" quality="– | – | –" key
  local times="$out/latency-$1.json"
  shift 2
  "$bin/unimapper" onboard "$dataset" --out "$run" --replace "$@" 2>"$out/$name.log"
  if [ -d "$dataset/labels" ]; then
    "$bin/unimapper" evaluate dynamic --truth "$dataset" --run "$run" >"$score" 2>/dev/null
    quality=$(printf '%.2f | %.2f | %.2f' "$(number "$score" SA)" "$(number "$score" DA)" "$(number "$score" AA)")
  fi
  printf '%s' "$quality"
  for key in removal description ingest; do
    printf ' | %s / %s' "$(steady "$times" $key p50)" "$(steady "$times" $key p99)"
  done
  printf ' | %s' "$(number "$run/stats.json" allocations_after_start)"
}

# budgets DATASET: runs with deferred work and a budget of half and a third of the longest call at once
budgets() {
  only_layout && return
  local longest part
  longest=$(steady "$out/latency-os2-128-dense.json" "closing call" max)
  for part in 1 2 3; do
    awk -v part="$part" -v ms="$longest" \
      'BEGIN { printf "{\"budget_us\": %d}\n", part == 1 ? 0 : 1000 * ms / part }' >"$out/budget.json"
    "$bin/unimapper" onboard "$1" --deferred --config "$out/budget.json" --out "$out/runs/budget-$part" \
      --replace 2>/dev/null
    "$bin/unimapper" evaluate dynamic --truth "$1" --run "$out/runs/budget-$part" \
      >"$out/budget-$part.json" 2>/dev/null
  done
}

# latency NAME DATASET SENSOR [ARGS]: percentiles per stage as latency-NAME.json and, as a table,
# latency.md
latency() {
  local name=$1
  shift
  only_layout || "$bin/latency" "$@" --there-and-back >"$out/latency-$name.json" 2>>"$out/latency.md"
}

# both_modes NAME DATASET SENSOR: latency at once, and as NAME-deferred with deferred work
both_modes() {
  latency "$@"
  latency "$1-deferred" "$2" "$3" --deferred
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

street_rows() {
  local data="$out/data/os2-128" dense="$out/data/os2-128-dense"
  simulate os2-128 "$scans" "$seed" "$data"
  both_modes os2-128 "$data" os2-128
  row "$(title os2-128)" 7 run_cells os2-128 "$data"
  latency os2-128-paper-preset "$data" os2-128 --preset paper
  row "$(title os2-128), paper's preset" 7 run_cells os2-128-paper-preset "$data" --preset paper
  latency os2-128-loaded "$data" os2-128 --load
  latency os2-128-hostile "$data" os2-128 --hostile 12
  smaller_computers os2-128 "$data"
  simulate os2-128 "$scans" "$dense_seed" "$dense"
  both_modes os2-128-dense "$dense" os2-128
  row "$(title os2-128-dense)" 7 run_cells os2-128-dense "$dense"
  budgets "$dense"
  rm -rf "$dense/scans"
}

simulated_rows() {
  local sensor data
  header "simulated town, seed $seed"
  street_rows
  for sensor in $sensors; do
    data="$out/data/$sensor"
    simulate "$sensor" $((scans / 2)) "$seed" "$data"
    both_modes "$sensor" "$data" "$sensor"
    row "$(title "$sensor")" 7 run_cells "$sensor" "$data"
    [ "$sensor" != vlp-16 ] || smaller_computers vlp-16 "$data"
    rm -rf "$data/scans"
  done
}

recorded_rows() {
  local folder=
  only_layout || folder=$(sh "$recordings/unpack.sh" "$out/recordings")
  both_modes kitti_0005a "$folder/kitti_0005a" hdl-64e
  latency kitti_0005a-paper-preset "$folder/kitti_0005a" hdl-64e --preset paper
  both_modes kitti_0001 "$folder/kitti_0001" hdl-64e
  both_modes hilti_hall "$folder/hilti_hall" generic
  header "real recordings"
  row "$(title kitti_0005a)" 7 run_cells kitti_0005a "$folder/kitti_0005a"
  row "$(title kitti_0005a), paper's preset" 7 run_cells kitti_0005a-paper-preset "$folder/kitti_0005a" --preset paper
  row "$(title kitti_0001) (no labels)" 7 run_cells kitti_0001 "$folder/kitti_0001"
  row "$(title hilti_hall) (no labels)" 7 run_cells hilti_hall "$folder/hilti_hall" --sensor generic
}

# presets_table: a row per computer, a column per LiDAR
presets_table() {
  local preset
  echo "| removal and description of a keyframe, sum of the p50, ms | OS2-128 | VLP-16 |"
  rule 3
  for preset in default $smaller_presets; do
    row "\`$preset\`" 2 preset_times "$preset"
  done
}

preset_times() {
  local suffix="-$1" sensor file separator=
  [ "$1" != default ] || suffix=
  for sensor in os2-128 vlp-16; do
    file="$out/latency-$sensor$suffix.json"
    printf '%s%.0f' "$separator" \
      "$(awk "BEGIN { print $(steady "$file" removal p50) + $(steady "$file" description p50) }")"
    separator=" | "
  done
}

# stage_table NAME: a row per stage of one recording, the other core as it was and loaded
stage_table() {
  local stage
  echo "| $(lidar "$1"): ms | p50 | p90 | max | x baseline | warm-up: p50 | p50 with \`--load\` |"
  rule 7
  for stage in ingest removal description search total "every call" "closing call" "other calls" \
    baseline; do
    row "$(stage_title "$stage")" 6 stage_times "$1" "$stage"
  done
}

stage_title() {
  case "$1" in
    ingest) echo "ingest (ten scans)" ;;
    total) echo "a keyframe in all" ;;
    "every call") echo "every call of \`add_scan\`" ;;
    "closing call") echo "calls that close a keyframe" ;;
    *) echo "$1" ;;
  esac
}

stage_times() {
  local alone="$out/latency-$1.json" loaded="$out/latency-$1-loaded.json" key
  for key in p50 p90 max of_baseline; do printf '%s | ' "$(steady "$alone" "$2" $key)"; done
  printf '%s | %s' "$(warm_up "$alone" "$2" p50)" "$(steady "$loaded" "$2" p50)"
}

has_recordings() { only_layout || [ -e "$recordings/unpack.sh" ]; }

drives() {
  echo "$streets $sensors"
  if has_recordings; then echo "$real"; fi
}

# latency_table: a row per LiDAR and recording
latency_table() {
  local drive
  echo "| steady state, p50 ms | ingest | removal | description | search | removal while warming up | M points/s ingested |"
  rule 7
  for drive in $(drives); do row "$(title "$drive")" 6 latency_times "$drive"; done
}

latency_times() {
  local file="$out/latency-$1.json" key
  for key in ingest removal description search; do printf '%s | ' "$(steady "$file" $key p50)"; done
  printf '%s | ' "$(warm_up "$file" removal p50)"
  sed -n '/"points_per_second": {/,/}/p' "$file" |
    awk '/"ingest"/ { rate = sprintf("%.1f", $2 / 1e6) } END { printf "%s", rate == "" ? "–" : rate }'
}

# calls_table: the distribution of every call of add_scan, a row per LiDAR and recording
calls_table() {
  local drive
  echo "| calls of \`add_scan\`, ms: p50 / p90 / p99 / max | all | that close a keyframe | others | the longest: scan | MB touched | MB in all |"
  rule 7
  for drive in $(drives); do row "$(title "$drive")" 6 call_times "$drive"; done
}

call_times() {
  local file="$out/latency-$1.json" kind key separator
  for kind in "every call" "closing call" "other calls"; do
    separator=
    for key in p50 p90 p99 max; do
      printf '%s%s' "$separator" "$(steady "$file" "$kind" $key)"
      separator=" / "
    done
    printf ' | '
  done
  awk -F'[:,] *' '
    /"longest_call"/ { inside = 1 }
    inside && /"scan"/ { scan = $2 }
    inside && /"keyframe"/ { keyframe = $2 }
    inside && /"closes"/ { closes = $2 == "true"; inside = 0 }
    /"total": [0-9]+$/ || /"total": [0-9]+,/ { total = $2 }
    /"touched"/ { touched = sprintf("%.0f", $2 / 1e6) }
    END {
      longest = scan == "" ? "–" : scan ", " (closes ? "closes" : "in") " keyframe " keyframe
      printf "%s | %s | %.0f", longest, touched == "" ? "–" : touched, total / 1e6
    }' "$file"
}

# deferred_table: the same with deferred work beside it
deferred_table() {
  local drive
  echo "| calls of \`add_scan\`, ms: p50 / p90 / p99 / max | at once | \`deferred\` | MB in all, \`deferred\` |"
  rule 4
  for drive in $(drives); do row "$(title "$drive")" 3 deferred_times "$drive"; done
}

deferred_times() {
  local file key separator
  for file in "$out/latency-$1.json" "$out/latency-$1-deferred.json"; do
    separator=
    for key in p50 p90 p99 max; do
      printf '%s%s' "$separator" "$(steady "$file" "every call" $key)"
      separator=" / "
    done
    printf ' | '
  done
  awk -F'[:,] *' '/"total": [0-9]+$/ || /"total": [0-9]+,/ { total = $2 }
    END { printf "%.0f", total / 1e6 }' "$file"
}

# budget_table: accuracy under a budget with deferred work
budget_table() {
  echo "| OS2-128, dense street, \`deferred\`: limit of every call | SA % | DA % | AA % | keyframes with a longer call |"
  rule 5
  row "none" 4 budget_cells 1
  row "half of the longest call at once" 4 budget_cells 2
  row "a third of it" 4 budget_cells 3
}

budget_cells() {
  local score="$out/budget-$1.json"
  printf '%.2f | %.2f | %.2f | %s' "$(number "$score" SA)" "$(number "$score" DA)" \
    "$(number "$score" AA)" "$(number "$out/runs/budget-$1/stats.json" deadline_misses)"
}

# hostile_table: a row per kind of hostile scan
hostile_table() {
  local kind
  echo "| ten hostile scans | p50, ms per keyframe | worst, as multiple of the normal worst | points dropped |"
  rule 4
  for kind in "all points in one cell" "every point in its own cell" "colliding keys" \
    "ten times the points" "all points on a line" "all points on a plane" "enormous coordinates" \
    "NaN and infinity"; do
    row "$kind" 3 hostile_times "$kind"
  done
}

hostile_times() {
  grep -A4 "\"scans\": \"$1\"" "$out/latency-os2-128-hostile.json" |
    awk -F': *' '
      /total_ms_p50/ { ms = $2 }
      /of_normal_worst/ { ratio = $2 }
      /dropped_percent/ { printf "%.0f | %.2f | %.0f %%", ms, ratio, $2 }'
}

only_layout || : >"$out/latency.md"
table keyframes-simulated simulated_rows
if has_recordings; then
  table keyframes-recorded recorded_rows
else
  echo "The real recordings are not beside the project; their rows are left out." >&2
fi
table latency-calls calls_table
table latency-deferred deferred_table
table latency-budget budget_table
table latency-recordings latency_table
table latency-stages stage_table os2-128
table latency-hostile hostile_table
table preset-times presets_table
if only_layout; then exit 0; fi
echo
cat "$out/latency.md"

mkdir -p "$out/scaling"
"$bin/latency" --scaling "$out/scaling" --keyframes "${SCALING_KEYFRAMES:-3000}" 2>/dev/null
gnuplot -e "folder='$out/scaling'; image='$out/scaling.png'" bench/latency/scaling.gnuplot
echo
echo "cost against points and distance: $out/scaling.png"

bench/realtime/run.sh "$out/data/os2-128" os2-128
rm -rf "$out/data/os2-128/scans"
