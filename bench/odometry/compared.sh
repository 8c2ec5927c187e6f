#!/usr/bin/env bash
# Drift of the odometry on unseen seeds, beside point-to-point: table of docs/odometry.md.
#
#   bench/odometry/compared.sh [SCANS]   300; WRITE_DOCS=1 writes the table there
#
# Town and campus, seven LiDARs, sweeps in motion, SEEDS ("21 22"). Point-to-point is kiss-icp's
# method (point_to_point.cpp). OUT: folder of recordings; each is removed after use. BIN: programs;
# LAYOUT=1 prints the table without figures. ROWS ("town vlp-16" ...): prints rows of these alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

scans=${1:-300}
seeds=${SEEDS:-21 22}
out=${OUT:-build/bench/odometry}
bin=${BIN:-build/release/bin}

# errors SCENE LIDAR: a line for each seed and mode, "MODE drift_percent ate_m covered"
errors() {
  local seed folder mode
  for seed in $seeds; do
    folder=$out/$1-$2-$seed
    rm -rf "$folder"
    mkdir -p "$out"
    "$bin/unimapper" simulate --scene "$1" --sensor "$2" --seed "$seed" --scans "$scans" \
      --drift none --bag mcap --imu --out "$folder" >/dev/null 2>&1
    rm -rf "$folder/scans" "$folder/labels"
    for mode in own imu swept-as-still point-to-point; do
      echo "$mode $("$bin/odometry_bench" "$folder/drive.mcap" ${mode/#own/})"
    done
    rm -rf "$folder"
  done
}

# compared SCENE LIDAR: means and worst drift; worst ratio of absolute errors to the better of others
compared() {
  # shellcheck disable=SC2016
  errors "$@" | awk '
    { for (i = 2; i < NF; i += 2) v[$i] = $(i + 1)
      drift = v["drift_percent"]; ate[$1] = v["ate_m"]
      sum[$1] += drift; sum_m[$1] += ate[$1]; if (drift > most[$1]) most[$1] = drift }
    $1 == "point-to-point" {
      ++seeds
      better = ate[$1] < ate["swept-as-still"] ? ate[$1] : ate["swept-as-still"]
      ratio = ate["own"] / better
      if (ratio > worst) worst = ratio }
    END {
      printf "%.2f (%.2f) | %.2f (%.2f) | %.2f (%.2f) | %.2f (%.2f) | %.3f, %.3f, %.3f | %.2f\n",
        sum["own"] / seeds, most["own"], sum["imu"] / seeds, most["imu"],
        sum["swept-as-still"] / seeds, most["swept-as-still"],
        sum["point-to-point"] / seeds, most["point-to-point"], sum_m["own"] / seeds,
        sum_m["swept-as-still"] / seeds, sum_m["point-to-point"] / seeds, worst }'
}

compared_table() {
  local scene lidar
  echo "| drift at the end, mean (worst) of $(wc -w <<<"$seeds") seeds, % | own | with an IMU | not compensated | point-to-point | ATE own, not compensated, point-to-point, m | worst ratio |"
  rule 7
  for scene in town campus; do
    for lidar in hdl-64e vlp-16 os1-64 os2-128 aeva-aeries2 livox-avia livox-mid-360; do
      [ -z "${ROWS:-}" ] || grep -qx "$scene $lidar" <<<"$ROWS" || continue
      row "\`$scene\`, $(lidar "$lidar")" 6 compared "$scene" "$lidar"
    done
  done
}

if [ -n "${ROWS:-}" ]; then compared_table; else table odometry-compared compared_table; fi
