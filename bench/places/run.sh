#!/usr/bin/env bash
# Benchmark of place recognition within one LiDAR and across LiDARs.
#
# Every LiDAR drives simulated scenes on route A, again on another day (B) and in reverse (C).
# Places of route A are the database, those of B and C of every LiDAR that is not richer the
# queries. Prints Markdown tables: every row and means by group, ours and STD's (the published
# descriptor, see std_baseline.hpp); ablations; calibration of the confidence; the real recordings
# where they lie in ../shared/data; query time over the size of the database. CSV files of
# everything go to build/bench/places/results; precision-recall curves, maps, the worst failures and
# query times to build/bench/places/plots.
#
#   bench/places/run.sh [SEEDS] [SCANS] [SCENES]
#       defaults: "71" 600 "town campus"
#
# Drives are simulated once and kept without their scans in build/bench/places/runs (about 2 GB with
# the defaults); a rerun describes and searches anew. Delete them when dynamic removal changes. At
# most one drive's scans (1.4 GB) are on the disk at a time. On two cores about three quarters of an
# hour with the defaults, half of that the second time. Ten minutes, and less:
#
#   SENSORS="os1-64 vlp-16 livox-avia" DISTRACTORS=0 bench/places/run.sh 71 300 town
#   TABLES=groups BASELINE=same bench/places/run.sh
#
# TABLES      of docs/results.md: groups, std, parts, recordings, scale (default: these), unseen
# SENSORS     LiDARs, from the richest to the poorest
# BASELINE    rows that STD is scored on too: all, same, none
# VARIANTS    JSON list of ablations; empty: none
# DISTRACTORS drives through other towns whose places are added to the database of the ablations and
#             of the last table; 0: none, and no such table
# LARGEST     places of the largest database of the last table
# OUT         output folder
#
# Installs and builds what is missing, unless BIN names a folder of programs to use instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seeds=${1:-71}
scans=${2:-600}
scenes=${3:-town campus}
sensors=${SENSORS:-os2-128 os1-64 hdl-64e vlp-16 livox-mid-360 aeva-aeries2 livox-avia}
tables=${TABLES:-groups std parts recordings scale}
baseline=${BASELINE:-all}
variants=${VARIANTS-bench/places/variants.json}
distractors=${DISTRACTORS:-34}
largest=${LARGEST:-100000}
out=${OUT:-build/bench/places}
wants() { [[ " $tables " == *" $1 "* ]]; }
wants parts || variants=
wants parts || wants scale || distractors=0
wants std || wants recordings || baseline=none

# A table of docs/results.md, out of what was printed.
from_printed() {
  local input="$out/tables.md"
  ! only_layout || input=/dev/null
  awk -v table="$1" -v layout="${LAYOUT:+1}" -v scenes="$scenes" -v seeds="$seeds" \
    -v recordings="kitti_0001 kitti_0005a hilti_hall" \
    -v sizes="60 250 500 1000 2000 5000 10000 20000 50000 100000" \
    -v variants="$(sed -n 's/.*{"name": "\([^"]*\)".*/\1/p' bench/places/variants.json)" \
    -f bench/places/documents.awk "$input"
}
write_tables() {
  local name
  for name in $tables; do table places-"$name" from_printed "$name"; done
}
if only_layout; then
  write_tables
  exit 0
fi

mkdir -p "$out/runs" "$out/results" "$out/plots"
: >"$out/tables.md"
if [ -z "${BIN:-}" ]; then
  ./dev setup toolchains/packages-bench.txt
  ./dev build unimapper bench/all >/dev/null
fi
bin=${BIN:-build/release/bin}

# onboard DATASET RUN [ONBOARD ARGS]: keyframes, STD descriptors and true poses of a recording.
# Written under another name first, so that an interrupted run is repeated.
onboard() {
  local data=$1 run=$2 making="$2.part"
  shift 2
  rm -rf "$making"
  mkdir -p "$(dirname "$making")"
  "$bin/unimapper" onboard "$data" --out "$making" "$@" 2>"$out/onboard.log"
  [ "$baseline" = none ] || "$bin/describe_std" "$making" "$data"
  cp "$data/gt_poses.txt" "$making"
  rm -rf "$making/labels"
  rm -rf "$run"
  mv "$making" "$run"
}

# Complete with STD descriptors, if they are needed.
is_made() { [ -e "$1/gt_poses.txt" ] && { [ "$baseline" = none ] || [ -e "$1/std.places" ]; }; }

# drive SENSOR SCENE SEED ROUTE SCANS RUN: a simulated drive
drive() {
  local data="$out/data/$1-$2-$3-$4"
  if is_made "$6"; then return; fi
  rm -rf "$data"
  "$bin/unimapper" simulate --sensor "$1" --scene "$2" --seed "$3" --route "$4" --scans "$5" \
    --out "$data" >/dev/null 2>"$out/simulate.log"
  onboard "$data" "$6"
  rm -rf "$data"
}

# compare NAME SCENE_FOLDER... [-- ARGS]: tables, CSV files and plots
compare() {
  local name=$1 folders=()
  shift
  while [ $# -gt 0 ] && [ "$1" != -- ]; do
    folders+=("$1")
    shift
  done
  [ $# -eq 0 ] || shift
  rm -rf "$out/results/$name"
  "$bin/bench_places" "${folders[@]}" --title "$name" --baseline-rows "$baseline" \
    --out "$out/results/$name" "$@" | tee -a "$out/tables.md"
  plot "$name"
}

# Without gnuplot there are no plots.
can_draw() { command -v gnuplot >/dev/null; }

# plot_each NAME KIND: every map-N or worst-N
plot_each() {
  local results="$out/results/$1" title one
  for title in "$results/$2"-*.title; do
    [ -e "$title" ] || continue
    one=$(basename "$title" .title)
    gnuplot -e "data='$results/$one'; image='$out/plots/$1-$one.png'; name='$(cat "$title")'" \
      "bench/places/$2.gnuplot" 2>>"$out/gnuplot.log"
  done
}

plot() {
  can_draw || return 0
  gnuplot -e "folder='$out/results/$1'; image='$out/plots/$1-curves.png'; name='$1'" \
    bench/places/curves.gnuplot 2>"$out/gnuplot.log"
  plot_each "$1" map
  plot_each "$1" worst
}

# LiDAR of a distractor drive.
distractor_sensor() {
  case $(($1 % 4)) in
    2) echo os1-64 ;;
    0) echo vlp-16 ;;
    *) echo livox-avia ;;
  esac
}

# Distractor drives need no STD descriptors.
crowd=()
make_distractors() {
  local baseline=none i run
  for ((i = 1; i <= distractors; ++i)); do
    run="$out/runs/distractors-$scans/$i"
    drive "$(distractor_sensor "$i")" town $((100 + i)) A "$scans" "$run"
    crowd+=("$run")
  done
}

# ablate NAME SCENE_FOLDER...: the default with one change each, among distractors, because without
# them nearly all drives are found.
ablate() {
  local name=$1 among=()
  shift
  [ "${#crowd[@]}" = 0 ] || among=(--distractors "${crowd[@]}")
  "$bin/bench_places" "$@" --title "$name, among ${#crowd[@]} other drives" --baseline-rows none \
    --sensors "${sensors// /,}" --variants "$variants" --ablations-only "${among[@]}" |
    tee -a "$out/tables.md"
}

simulated=
for name in groups unseen std parts scale; do
  if wants $name; then simulated=$scenes; fi
done
make_distractors
for scene in $simulated; do
  folders=()
  for seed in $seeds; do
    folder="$out/runs/$scene-$seed-$scans"
    folders+=("$folder")
    for sensor in $sensors; do
      for route in A B C; do
        drive "$sensor" "$scene" "$seed" "$route" "$scans" "$folder/$sensor-$route"
      done
    done
  done
  if wants groups || wants unseen || wants std; then
    compare "$scene" "${folders[@]}" -- --sensors "${sensors// /,}"
  fi
  [ -z "$variants" ] || ablate "$scene" "${folders[@]}"
done

# A recording as two sessions, the second searched for in the first.
# recording NAME SENSOR HOW DISTANCE [CONFIG]
recording() {
  local name=$1 sensor=$2 how=$3 distance=$4 config="$out/recording.json" session
  local halves="$out/data/$name" runs="$out/runs/$name"
  if ! is_made "$runs/$sensor-B"; then
    rm -rf "$halves"
    "$bin/split_recording" "$how" "$real/$name" "$halves"
    echo "${5:-{\}}" >"$config"
    for session in A B; do
      onboard "$halves/$session" "$runs/$sensor-$session" --sensor "$sensor" --config "$config"
    done
    rm -rf "$halves"
  fi
  compare "$name" "$runs" -- --sensors "$sensor" --routes B --distance "$distance"
}

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

if wants scale && [ "$distractors" != 0 ]; then
  home="$out/runs/${scenes%% *}-${seeds%% *}-$scans"
  known=
  queries=()
  for sensor in os1-64 vlp-16 livox-avia $sensors; do
    [ -e "$home/$sensor-A" ] || continue
    known=${known:-$home/$sensor-A}
    [[ " ${queries[*]} " == *" $home/$sensor-B "* ]] || queries+=("$home/$sensor-B")
    [ "${#queries[@]}" -lt 3 ] || break
  done
  "$bin/bench_place_scale" --known "$known" --queries "${queries[@]}" --distractors "${crowd[@]}" \
    --largest "$largest" --out "$out/results/scale" | tee -a "$out/tables.md"
  if can_draw; then
    gnuplot -e "folder='$out/results/scale'; image='$out/plots/scale.png'" \
      bench/places/scale.gnuplot 2>"$out/gnuplot.log"
  fi
fi

write_tables
echo
echo "Tables as CSV: $out/results. Plots: $out/plots."
