#!/usr/bin/env bash
# Benchmark of place recognition within one LiDAR and across LiDARs.
#
# Every LiDAR drives simulated scenes on route A, again on another day (B) and in reverse (C).
# Places of route A are the database, those of B and C of every LiDAR that is not richer the
# queries. Prints Markdown tables: every row and means by group, ours and STD's (the published
# descriptor, see std_baseline.hpp), and the real recordings where they lie in ../shared/data.
#
#   bench/places/run.sh [SEED] [SCANS] [SCENES]
#       defaults: 71 600 "town campus"
#
# Drives are simulated once and kept without their scans in build/bench/places/runs (about 2 GB with
# the defaults); a rerun describes and searches anew. Delete them when dynamic removal changes. At
# most one drive's scans (1.4 GB) are on the disk at a time. On two cores about an hour with the
# defaults. Less:
#
#   SENSORS="os1-64 vlp-16 livox-avia" bench/places/run.sh 71 300 town
#
# TABLES   of docs/results.md: groups, recordings (default: both)
# SENSORS  LiDARs, from the richest to the poorest
# OUT      output folder
#
# Installs and builds what is missing, unless BIN names a folder of programs to use instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seed=${1:-71}
scans=${2:-600}
scenes=${3:-town campus}
sensors=${SENSORS:-os2-128 os1-64 hdl-64e vlp-16 livox-mid-360 aeva-aeries2 livox-avia}
tables=${TABLES:-groups recordings}
out=${OUT:-build/bench/places}
printed=$out/tables.md
wants() { [[ " $tables " == *" $1 "* ]]; }

# ---------------------------------------------------------------------------------------------
# Tables of docs/results.md, out of what was printed: a title's table, a row's first and third
# column. The rows of routes and groups are those of the means.

# cells TITLE FIRST ROUTE COLUMN...: columns of a row, "a | b"; nothing if there is no such row
cells() {
  awk -F ' *[|] *' -v title="$1" -v first="$2" -v route="$3" -v columns="${*:4}" '
    !/^[|]/ { inside = 0; next }
    !inside { inside = 1; chosen = $2 == title; next }
    chosen && $2 == first && $4 == route {
      n = split(columns, column, " ")
      for (i = 1; i <= n; ++i) printf "%s%s", (i > 1 ? " | " : ""), $column[i]
    }' "$printed"
}
group_cells() { cells "$1, mean (counts: sum)" "$2" "$3" "${@:4}"; }
both_cells() {
  printf '%s | %s' "$(group_cells "$@" 3 6 7 8 9)" "$(group_cells "$1, STD" "${@:2}" 6 8)"
}

# A row per scene, route and group of LiDARs.
groups_table() {
  local scene route group
  echo "| seed $seed, route | LiDARs | rows | by pose: F1 / AUC / R at P = 1 | by distance, 10 m | accepted right / wrong | error m / deg | STD by pose | STD right / wrong |"
  rule 9
  for scene in $scenes; do
    for route in B C; do
      for group in "same LiDAR" wide-wide wide-narrow narrow-narrow; do
        only_layout || [ -n "$(group_cells "$scene" "$group" "$route" 2)" ] || continue
        row "$scene $route | $group" 7 both_cells "$scene" "$group" "$route"
      done
    done
  done
}
recordings_table() {
  echo "| database and queries, and how far a true place may be | queries with a true place | accepted right / wrong | STD: right / wrong |"
  rule 4
  row "KITTI raw 0001, even against odd scans; 10 m" 3 recording_cells kitti_0001 hdl-64e
  row "KITTI raw 0005, even against odd scans; 10 m" 3 recording_cells kitti_0005a hdl-64e
  row "indoor hall, first against second half; 8 m" 3 recording_cells hilti_hall generic
}
recording_cells() {
  printf '%s | %s' "$(cells "$1: database" "$2" B 5 8)" "$(cells "$1, STD: database" "$2" B 8)"
}
write_tables() {
  local name
  for name in $tables; do table places-"$name" "${name}_table"; done
}
if only_layout; then
  write_tables
  exit 0
fi

# ---------------------------------------------------------------------------------------------
# Measurements

mkdir -p "$out/runs"
: >"$printed"
if [ -z "${BIN:-}" ]; then
  ./dev setup
  ./dev build unimapper bench/all >/dev/null
fi
bin=${BIN:-build/release/bin}

# onboard DATASET RUN [ONBOARD ARGS]: keyframes, STD descriptors and true poses of a recording.
# Written under another name first, so that an interrupted run is repeated.
onboard() {
  local data=$1 run=$2 making="$2.part"
  rm -rf "$making"
  mkdir -p "$(dirname "$making")"
  "$bin/unimapper" onboard "$data" --out "$making" "${@:3}" 2>"$out/onboard.log"
  cp "$data/gt_poses.txt" "$making"
  "$bin/bench_places" "$making" --describe-std "$data"
  rm -rf "$making/labels" "$run"
  mv "$making" "$run"
}

# drive SENSOR SCENE ROUTE RUN: a simulated drive
drive() {
  local data="$out/data/$1-$2-$3"
  [ ! -e "$4/std.places" ] || return 0
  rm -rf "$data"
  "$bin/unimapper" simulate --sensor "$1" --scene "$2" --seed "$seed" --route "$3" --scans "$scans" \
    --out "$data" >/dev/null 2>"$out/simulate.log"
  onboard "$data" "$4"
  rm -rf "$data"
}

# compare NAME SCENE_FOLDER SENSORS [ARGS]: prints all rows and means
compare() {
  "$bin/bench_places" "$2" --title "$1" --sensors "${3// /,}" "${@:4}" | tee -a "$printed"
}

# A recording as two sessions, the second searched for in the first.
# recording NAME SENSOR HOW DISTANCE [CONFIG]
recording() {
  local name=$1 sensor=$2 config="$out/recording.json" session
  local halves="$out/data/$name" runs="$out/runs/$name"
  if [ ! -e "$runs/$sensor-B/std.places" ]; then
    rm -rf "$halves"
    "$bin/split_recording" "$3" "$real/$name" "$halves"
    echo "${5:-{\}}" >"$config"
    for session in A B; do
      onboard "$halves/$session" "$runs/$sensor-$session" --sensor "$sensor" --config "$config"
    done
    rm -rf "$halves"
  fi
  compare "$name" "$runs" "$sensor" --routes B --distance "$4"
}

if wants groups; then
  for scene in $scenes; do
    folder="$out/runs/$scene-$seed-$scans"
    for sensor in $sensors; do
      for route in A B C; do drive "$sensor" "$scene" "$route" "$folder/$sensor-$route"; done
    done
    compare "$scene" "$folder" "$sensors"
  done
fi
if wants recordings && [ -e ../shared/data/unpack.sh ]; then
  real=$(sh ../shared/data/unpack.sh build/bench/recordings)
  # Every second scan is a session: five of them span what ten do.
  recording kitti_0001 hdl-64e alternating 10 '{"keyframe": {"scans": 5}}'
  recording kitti_0005a hdl-64e alternating 10 '{"keyframe": {"scans": 5}}'
  recording hilti_hall generic halves 8
elif wants recordings; then
  echo "The real recordings are not beside the project; their table is left out." >&2
  tables=${tables/recordings/}
fi
write_tables
