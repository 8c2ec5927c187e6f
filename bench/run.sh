#!/usr/bin/env bash
# Benchmark of the onboard pipeline: the quality and latency tables of docs/results.md, and the
# times of the presets in docs/porting.md (WRITE_DOCS=1 writes them there).
#
# Simulated drives of every LiDAR and the real recordings where they lie in ../shared/data;
# hostile scans; cost over points and distance; a drive at real-time rate.
#
#   bench/run.sh [SCANS] [SEED] [MINUTES]     scans per simulated drive, minutes of real time
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

scans=${1:-100}
seed=${2:-11}
minutes=${3:-1}
out=build/bench
bin=build/release/bin
recordings=../shared/data
sensors="os2-128 os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360"
smaller_presets="jetson raspberry-pi armv7-64mb"
only_layout || mkdir -p "$out"

header() {
  echo "| $1 | SA % | DA % | AA % | removal, p50 / p99 ms | description | ingest | allocations |"
  rule 8
}

# run_cells NAME DATASET [ONBOARD ARGS]: accuracy and times of a run
run_cells() {
  local name=$1 dataset=$2 run="$out/runs/$1" score="$out/$1.json" quality="– | – | –" key
  shift 2
  "$bin/unimapper" onboard "$dataset" --out "$run" --replace "$@" 2>"$out/$name.log"
  if [ -d "$dataset/labels" ]; then
    "$bin/unimapper" evaluate dynamic --truth "$dataset" --run "$run" >"$score" 2>/dev/null
    quality=$(printf '%.2f | %.2f | %.2f' "$(number "$score" SA)" "$(number "$score" DA)" "$(number "$score" AA)")
  fi
  printf '%s' "$quality"
  for key in removal description ingest; do
    printf ' | %s / %s' "$(stage "$run/stats.json" $key p50)" "$(stage "$run/stats.json" $key p99)"
  done
  printf ' | %s' "$(number "$run/stats.json" allocations_after_start)"
}

# latency NAME DATASET SENSOR [ARGS]: percentiles per stage as latency-NAME.json and, as a table,
# latency.md
latency() {
  local name=$1
  shift
  only_layout || "$bin/latency" "$@" --repeat 3 >"$out/latency-$name.json" 2>>"$out/latency.md"
}

simulate() {  # simulate SENSOR FOLDER
  rm -rf "$2"
  "$bin/unimapper" simulate --scene town --sensor "$1" --route A --scans "$scans" --seed "$seed" \
    --out "$2" 2>/dev/null
}

# Runs of the presets for smaller computers.
run_presets() {  # run_presets SENSOR DATASET
  local preset
  for preset in $smaller_presets; do
    "$bin/unimapper" onboard "$2" --out "$out/runs/$1-$preset" --replace --preset "$preset" 2>/dev/null
  done
}

simulated_rows() {
  local sensor data
  header "simulated town, seed $seed, $scans scans"
  for sensor in $sensors; do
    data="$out/data/$sensor"
    only_layout || simulate "$sensor" "$data"
    row "$(lidar "$sensor")" 7 run_cells "$sensor" "$data"
    latency "$sensor" "$data" "$sensor"
    if [ "$sensor" = os2-128 ]; then
      row "$(lidar "$sensor"), paper's preset" 7 run_cells "os2-128-paper-preset" "$data" --preset paper
      latency os2-128-loaded "$data" os2-128 --load
      latency os2-128-hostile "$data" os2-128 --hostile 12
    fi
    only_layout && continue
    case "$sensor" in os2-128 | vlp-16) run_presets "$sensor" "$data" ;; esac
    rm -rf "$data/scans"
  done
}

recorded_rows() {
  local real=
  only_layout || real=$(sh "$recordings/unpack.sh" "$out/recordings")
  header "real recordings"
  row "KITTI raw 0005" 7 run_cells kitti_0005a "$real/kitti_0005a"
  row "KITTI raw 0005, paper's preset" 7 run_cells kitti_0005a-paper-preset "$real/kitti_0005a" --preset paper
  row "KITTI raw 0001 (no labels)" 7 run_cells kitti_0001 "$real/kitti_0001"
  row "Hilti hall (no labels)" 7 run_cells hilti_hall "$real/hilti_hall" --sensor generic
  latency kitti_0005a "$real/kitti_0005a" hdl-64e
  latency kitti_0001 "$real/kitti_0001" hdl-64e
  latency hilti_hall "$real/hilti_hall" generic
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
  local suffix="-$1" sensor run separator=
  [ "$1" != default ] || suffix=
  for sensor in os2-128 vlp-16; do
    run="$out/runs/$sensor$suffix/stats.json"
    printf '%s%.0f' "$separator" \
      "$(awk "BEGIN { print $(stage "$run" removal p50) + $(stage "$run" description p50) }")"
    separator=" | "
  done
}

# stage_table NAME: a row per stage of one recording, the other core as it was and loaded
stage_table() {
  local stage
  echo "| $(lidar "$1"): ms per keyframe | p50 | max | x baseline | p50 with \`--load\` |"
  rule 5
  for stage in ingest removal description search total "closing call" baseline; do
    row "$(stage_title "$stage")" 4 stage_times "$1" "$stage"
  done
}

stage_title() {
  case "$1" in
    ingest) echo "ingest (ten scans)" ;;
    "closing call") echo "the call that closes the keyframe" ;;
    *) echo "$1" ;;
  esac
}

stage_times() {
  local alone="$out/latency-$1.json" loaded="$out/latency-$1-loaded.json"
  printf '%s | %s | %s | %s' "$(stage "$alone" "$2" p50)" "$(stage "$alone" "$2" max)" \
    "$(stage "$alone" "$2" of_baseline)" "$(stage "$loaded" "$2" p50)"
}

# latency_table: a row per LiDAR and recording
latency_table() {
  local sensor
  echo "| other sensors and recordings, p50 ms | ingest | removal | description | search | M points/s ingested |"
  rule 6
  for sensor in $sensors; do
    [ "$sensor" = os2-128 ] || row "$(lidar "$sensor")" 5 latency_times "$sensor"
  done
  row "KITTI raw 0005" 5 latency_times kitti_0005a
  row "KITTI raw 0001" 5 latency_times kitti_0001
  row "Hilti hall" 5 latency_times hilti_hall
}

latency_times() {
  local file="$out/latency-$1.json" key
  for key in ingest removal description search; do printf '%s | ' "$(stage "$file" $key p50)"; done
  sed -n '/"points_per_second": {/,/}/p' "$file" | grep -m1 '"ingest"' |
    awk '{ printf "%.1f", $2 / 1e6 }'
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
if only_layout || [ -e "$recordings/unpack.sh" ]; then
  table keyframes-recorded recorded_rows
  table latency-recordings latency_table
else
  echo "The real recordings are not beside the project; their tables are left out." >&2
fi
table latency-stages stage_table os2-128
table latency-hostile hostile_table
table preset-times presets_table
if only_layout; then exit 0; fi
echo
cat "$out/latency.md"

mkdir -p "$out/scaling"
"$bin/latency" --scaling "$out/scaling" 2>/dev/null
gnuplot -e "folder='$out/scaling'; image='$out/scaling.png'" bench/latency/scaling.gnuplot
echo
echo "cost against points and distance: $out/scaling.png"

bench/realtime/run.sh "$minutes"
