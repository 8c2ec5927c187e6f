#!/usr/bin/env bash
# Errors and times of the odometry: tables of docs/odometry.md.
#
#   bench/odometry/run.sh [RECORDINGS] [SCANS]   200; WRITE_DOCS=1 writes the tables there
#
# RECORDINGS: the folder with kitti_0005a, kitti_0001 and hilti_hall, where the tests lay them out.
# Simulated: town and campus, seven LiDARs, SCANS scans each of sweeps in motion; square, tunnel, bore,
# corridor and hall; SEED (1; others chose the parameters). The relative error is KITTI's, of segments
# of 20, 40, ... 100 m, as these drives are short. With a gyroscope: on bodies that sway once a second
# by so many degrees, samples out of the true poses. OUT: folder of recordings; each is removed after
# use. BIN: programs; LAYOUT=1 prints the tables without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

recordings=${1:-build/release/recordings}
scans=${2:-200}
seed=${SEED:-1}
out=${OUT:-build/bench/odometry}
bin=${BIN:-build/release/bin}
lidars="hdl-64e vlp-16 os1-64 os2-128 aeva-aeries2 livox-avia livox-mid-360"

# cells RECORDING [MODE]: of what the program prints, "key value key value ..."
cells() {
  "$bin/odometry_bench" "$@" | awk '{
    for (i = 1; i < NF; i += 2) v[$i] = $(i + 1)
    relative = v["segments"] > 0 ? sprintf("%.2f", v["rel_percent"]) : "-"
    printf "%.0f | %s | %.3f | %.2f | %.1f (%.1f) | %d | %d\n", v["path_m"], relative, v["ate_m"],
      v["drift_percent"], v["ms_p50"], v["ms_p99"], v["degenerate"], v["lost"] }'
}

# worst RECORDING OPTION...: the cells of that first scan with the largest relative error
worst() {
  local first
  for first in 1 3 5 8 12; do cells "$@" "from=$first"; done | sort -t '|' -k 2,2g | tail -n 1
}

# simulated SCENE LIDAR ARGUMENTS...: cells of a recording whose points are not compensated
simulated() {
  local folder=$out/$1-$2-$seed
  rm -rf "$folder"
  mkdir -p "$out"
  "$bin/unimapper" simulate --scene "$1" --sensor "$2" --seed "$seed" --scans "$scans" --drift none \
    --bag mcap --out "$folder" >/dev/null 2>&1
  rm -rf "$folder/scans" "$folder/labels"
  cells "$folder/drive.mcap"
  rm -rf "$folder"
}

# swaying DEGREES SCENE LIDAR: absolute errors without, with a gyroscope and with an IMU; that of up
swaying() {
  local folder=$out/$2-$3-$seed
  rm -rf "$folder"
  mkdir -p "$out"
  "$bin/unimapper" simulate --scene "$2" --sensor "$3" --seed "$seed" --scans "$scans" --drift none \
    --distortion --sway "$1@1" --bag mcap --imu --out "$folder" >/dev/null 2>&1
  for imu in "" gyroscope imu; do
    # shellcheck disable=SC2086
    "$bin/odometry_bench" "$folder/drive.mcap" $imu
  done | awk '{ for (i = 1; i < NF; i += 2) v[NR, $i] = $(i + 1) }
    END { printf "%.3f | %.3f, %.3f | %.1f, %.1f (%.1f)\n", v[1, "ate_m"], v[2, "ate_m"],
      v[3, "ate_m"], v[1, "up_off_deg"], v[3, "up_off_deg"], v[3, "up_sigma_deg"] }'
  rm -rf "$folder"
}

header() {
  echo "| $1 | path, m | relative, % | ATE, m | drift at the end, % | ms a scan (p99) | degenerate | lost |"
  rule 8
}

recorded_table() {
  header "recorded"
  row "KITTI 0005, 70 scans" 7 cells "$recordings/kitti_0005a"
  row "KITTI 0001, 60 scans" 7 cells "$recordings/kitti_0001"
  row "KITTI 0005, the worst of five later first scans" 7 worst "$recordings/kitti_0005a"
  row "KITTI 0001, the worst of five later first scans" 7 worst "$recordings/kitti_0001"
  row "KITTI 0005, backwards, the worst of five" 7 worst "$recordings/kitti_0005a" reversed
  row "KITTI 0001, backwards, the worst of five" 7 worst "$recordings/kitti_0001" reversed
  row "KITTI 0005, points within 15 m, the worst of five" 7 worst "$recordings/kitti_0005a" range=15
  row "KITTI 0001, every second scan, the worst of five" 7 worst "$recordings/kitti_0001" every=2
  row "KITTI 0005, every sixth scan, the worst of five" 7 worst "$recordings/kitti_0005a" every=6
  row "hall, 2 Hz, carried by hand, 177 scans" 7 cells "$recordings/hilti_hall"
  row "hall, backwards, the worst of five" 7 worst "$recordings/hilti_hall" reversed
  row "hall, every third scan, the worst of five" 7 worst "$recordings/hilti_hall" every=3
  row "hall, every fourth scan, the worst of five" 7 worst "$recordings/hilti_hall" every=4
  row "hall, points within 15 m, the worst of five" 7 worst "$recordings/hilti_hall" range=15
}

simulated_table() {
  local scene lidar
  header "simulated"
  for scene in town campus; do
    for lidar in $lidars; do row "\`$scene\`, $(lidar "$lidar")" 7 simulated "$scene" "$lidar"; done
  done
  for scene in hall square corridor tunnel bore; do row "\`$scene\`, VLP-16" 7 simulated "$scene" vlp-16; done
}

gyroscope_table() {
  local degrees scene lidar
  echo "| with a gyroscope, and an accelerometer | ATE without, m | with, m | up off without, with (sigma), ° |"
  rule 4
  while read -r degrees scene lidar; do
    row "\`$scene\`, $(lidar "$lidar"), sway of $degrees°" 3 swaying "$degrees" "$scene" "$lidar"
  done <<<"1 town vlp-16
6 town vlp-16
6 town hdl-64e
10 campus vlp-16
6 hall vlp-16
1 convoy vlp-16
1 campus livox-avia"
}

table odometry-recorded recorded_table
table odometry-simulated simulated_table
table odometry-gyroscope gyroscope_table
