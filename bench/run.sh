#!/usr/bin/env bash
# Benchmark of the onboard pipeline: the quality and latency tables of docs/results.md
# (WRITE_DOCS=1 writes them there).
#
# Simulated drives of every LiDAR and the real recordings where they lie in ../shared/data;
# hostile scans; cost over points and distance; a drive at real-time rate.
#
#   bench/run.sh [SCANS] [SEED] [MINUTES]     scans per simulated drive, minutes of real time
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scans=${1:-100}
seed=${2:-11}
minutes=${3:-1}
out=build/bench
bin=build/release/bin
mkdir -p "$out"

# The first number behind a key of a JSON file.
number() { grep -m1 "\"$2\"" "$1" | grep -oE -- '-?[0-9.]+(e-?[0-9]+)?|null' | tail -1; }
# A stage's p50 and p99, milliseconds.
stage() { sed -n "/\"$2\": {/,/}/p" "$1" | grep -oE '"(p50|p99)": *[0-9.]+' | sort |
  awk '{printf "%s%.1f", (NR > 1 ? " / " : ""), $2}'; }

# Prints a table and, with WRITE_DOCS=1, puts it into docs/results.md.
table() { echo && bench/tables/table.sh "$@"; }

header() {
  echo "| $1 | SA % | DA % | AA % | removal p50 / p99 ms | description | ingest | allocations |"
  echo "|---|---|---|---|---|---|---|---|"
}

row() {  # row NAME DATASET [ONBOARD ARGS]
  local name=$1 dataset=$2 run="$out/runs/$1" score="$out/$1.json"
  shift 2
  "$bin/unimapper" onboard "$dataset" --out "$run" "$@" 2>"$out/$name.log"
  local quality="– | – | –"
  if [ -d "$dataset/labels" ]; then
    "$bin/unimapper" evaluate dynamic --truth "$dataset" --run "$run" >"$score" 2>/dev/null
    quality=$(printf '%.2f | %.2f | %.2f' "$(number "$score" SA)" "$(number "$score" DA)" "$(number "$score" AA)")
  fi
  echo "| $name | $quality | $(stage "$run/stats.json" removal) | $(stage "$run/stats.json" description) | $(stage "$run/stats.json" ingest) | $(number "$run/stats.json" allocations_after_start) |"
}

# Percentiles per stage as latency-NAME.json and, as a table, latency.md.
latency() {  # latency NAME DATASET SENSOR [ARGS]
  local name=$1
  shift
  "$bin/latency" "$@" --repeat 3 >"$out/latency-$name.json" 2>>"$out/latency.md"
}
: >"$out/latency.md"

simulated_rows() {
  local sensor data
  header "simulated town, seed $seed, $scans scans"
  for sensor in os2-128 os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360; do
    data="$out/data/$sensor"
    rm -rf "$data"
    "$bin/unimapper" simulate --scene town --sensor "$sensor" --route A --scans "$scans" \
      --seed "$seed" --out "$data" 2>/dev/null
    row "$sensor" "$data"
    latency "$sensor" "$data" "$sensor"
    if [ "$sensor" = os2-128 ]; then
      row "os2-128-paper-preset" "$data" --preset paper
      latency os2-128-loaded "$data" os2-128 --load
      latency os2-128-hostile "$data" os2-128 --hostile 12
    fi
    rm -rf "$data/scans"
  done
}

recorded_rows() {
  local real
  real=$(sh "$recordings/unpack.sh" "$out/recordings")
  header "real recordings"
  row kitti_0005a "$real/kitti_0005a"
  row kitti_0005a-paper-preset "$real/kitti_0005a" --preset paper
  row kitti_0001 "$real/kitti_0001"
  row hilti_hall "$real/hilti_hall" --sensor generic
  latency kitti_0005a "$real/kitti_0005a" hdl-64e
  latency kitti_0001 "$real/kitti_0001" hdl-64e
  latency hilti_hall "$real/hilti_hall" generic
}

# The median of a stage in a JSON file of `latency`.
median_ms() { sed -n "/\"$2\": {/,/}/p" "$1" | grep -m1 -oE '"p50": *[0-9.]+' | awk '{printf "%.1f", $2}'; }

# stage_table NAME: a row per stage of one recording, the other core as it was and loaded
stage_table() {
  local stage alone="$out/latency-$1.json" loaded="$out/latency-$1-loaded.json"
  echo "| $1: ms per keyframe | p50 | max | p50 with \`--load\` |"
  echo "|---|---|---|---|"
  for stage in ingest removal description search total "closing call"; do
    printf '| %s | %s | %.1f | %s |\n' "$stage" "$(median_ms "$alone" "$stage")" \
      "$(sed -n "/\"$stage\": {/,/}/p" "$alone" | grep -m1 -oE '"max": *[0-9.]+' | awk '{print $2}')" \
      "$(median_ms "$loaded" "$stage")"
  done
}

# latency_table: a row per recording
latency_table() {
  local file stage
  echo "| p50 ms | ingest | removal | description | search | M points/s ingested | MB |"
  echo "|---|---|---|---|---|---|---|"
  for file in "$out"/latency-*.json; do
    case "$file" in *-loaded.json | *-hostile.json) continue ;; esac
    printf '| %s ' "$(basename "$file" .json | sed 's/^latency-//')"
    for stage in ingest removal description search; do printf '| %s ' "$(median_ms "$file" "$stage")"; done
    sed -n '/"points_per_second": {/,/}/p' "$file" | grep -m1 '"ingest"' |
      awk '{printf "| %.1f ", $2 / 1e6}'
    sed -n '/"bytes": {/,/}/p' "$file" | grep -m1 '"total"' | awk '{printf "| %.0f |\n", $2 / 1e6}'
  done
}

simulated_rows | table keyframes-simulated
recordings=../shared/data
if [ -e "$recordings/unpack.sh" ]; then
  recorded_rows | table keyframes-recorded
else
  echo "The real recordings are not beside the project; their rows are left out." >&2
fi
cat "$out/latency.md"
stage_table os2-128 | table latency-stages
latency_table | table latency-recordings
awk '/^[|] hostile scans/, /^$/' "$out/latency.md" | sed '/^$/d' | table latency-hostile

mkdir -p "$out/scaling"
"$bin/latency" --scaling "$out/scaling" 2>/dev/null
gnuplot -e "folder='$out/scaling'; image='$out/scaling.png'" bench/latency/scaling.gnuplot
echo
echo "cost against points and distance: $out/scaling.png"

bench/realtime/run.sh "$minutes"
