#!/usr/bin/env bash
# Benchmark outside what the rules were tuned on: what the simulator used to hold fixed is varied.
#
# A designed sample of scenes, LiDARs, columns, rings, mountings, odometry starts and noise
# (bench/outside/sample.sh), not every combination. Each drive is labelled on the robot, by the
# merger where a target asks for it, and scored on what has begun to move; mounted ones are scored
# on up, too, and pairs of tilted LiDARs and of halls are merged. Prints the tables of docs/results-outside.md:
# targets, reached or missed; every drive; mountings; pairs; halls. A missed target is a result, no failure. Frames with
# the most wrong points of each drive that missed go to build/bench/outside/pictures.
#
#   bench/outside/run.sh [SEEDS] [SCANS]
#       defaults: "3 5" 60; with 40 scans a quarter of an hour on two cores that others use, too
#
# Rules and thresholds are chosen on even seeds and evaluated on odd ones: EVEN=1 takes "2 4".
#
# ONLY       of the groups: poles deck street square town narrow vlp noise others up pairs hall
# PAIR_SCANS scans of a drive of a pair (150)
# OUT        output folder
# MEASURE=0  only print tables of what was measured before
# LIMIT      seconds that one program may take (600)
#
# Builds what is missing, unless BIN names a folder of programs to use instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

odd_seeds="3 5"
[ -z "${EVEN:-}" ] || odd_seeds="2 4"
seeds=${1:-$odd_seeds}
scans=${2:-60}
pair_scans=${PAIR_SCANS:-150}
only=${ONLY:-poles deck street square town narrow vlp noise others up pairs hall}
out=${OUT:-build/bench/outside}
limit=${LIMIT:-600}
results="$out/results"
# shellcheck source=bench/outside/sample.sh disable=SC2154
source bench/outside/sample.sh

wants() { [[ " $only " == *" $1 "* ]]; }
# in_groups "A,B" "C D": whether the first list has a member of the second
in_groups() {
  local group
  for group in $2; do if [[ ",$1," == *",$group,"* ]]; then return 0; fi; done
  return 1
}

# Lines of the sample that are wanted; `own` and `spinning` are names for targets only.
wanted() {
  local groups rest names
  names=${only/town/town spinning}
  names=${names/narrow/narrow mid}
  names=${names/noise/noise kitti}
  while IFS='|' read -r groups rest; do
    if in_groups "$groups" "$names"; then echo "$groups|$rest"; fi
  done < <(sample; [ -z "$real" ] || recorded_sample)
}

name_of() {
  local name="$1-$2$3"
  name=${name// /}
  name=${name//--/-}
  echo "${name//@/-over-}"
}
title_of() {
  local options
  options=
  [ -z "$3" ] || options=$(sed -E 's/ --/, --/g; s/--columns ([0-9]+)/\1 columns/
    s/--rings ([0-9]+), --uneven-rings/\1 uneven rings/; s/--rings ([0-9]+)/\1 rings/
    s/--attitude-noise ([0-9.]+)@([0-9.]+)/attitude noise \1° over \2 s/
    s/--attitude-noise ([0-9.]+)/attitude noise \1°/; s/--sway ([0-9]+)@([0-9]+)/sway ±\1° at \2 Hz/
    s/--mount-(roll|pitch) ([0-9-]+)/\1 \2°/; s/--odometry-start identity/odometry from identity/
    s/--points body/points in the body frame/; s/--distortion/distorted sweeps/' <<<"$3")
  echo "${1/kitti/KITTI 0005}, $(lidar "$2")${options:+, $options}"
}
seeds_of() { if [ "$1" = kitti ]; then echo 0; else echo "$seeds"; fi; }

if only_layout; then
  real=recording
else
  mkdir -p "$results" "$out/data" "$out/runs"
  [ "${MEASURE:-1}" = 0 ] || rm -rf "$out/pictures"
  if [ -z "${BIN:-}" ]; then
    ./dev setup
    ./dev build unimapper bench/all >/dev/null
  fi
  real=
  if [ -z "${NO_RECORDINGS:-}" ] && [ -e ../shared/data/unpack.sh ]; then
    real=$(sh ../shared/data/unpack.sh build/bench/recordings)
  else
    echo "The real recordings are left out." >&2
  fi
fi
bin=${BIN:-build/release/bin}
# run PROGRAM ARGS: one of ours, bounded in time
run() { timeout "$limit" "$bin/$1" "${@:2}"; }

# recording SCENE SENSOR OPTIONS SEED FOLDER [SCANS [ROUTE]]
recording() {
  rm -rf "$5"
  if [ "$1" = kitti ]; then
    noisy_kitti "$3" "$5"
  else
    # shellcheck disable=SC2086
    run unimapper simulate --scene "$1" --sensor "$2" $3 --seed "$4" --scans "${6:-$scans}" \
      --route "${7:-A}" --out "$5" >/dev/null 2>&1
  fi
}
noisy_kitti() {
  local noise=${1#--attitude-noise } file
  mkdir -p "$2"
  for file in "$real"/kitti_0005a/*; do ln -s "$(realpath "$file")" "$2"; done
  [ -n "$noise" ] || return 0
  rm "$2/poses.txt"
  awk -v degrees="${noise%@*}" -v seconds="$([[ $noise != *@* ]] || echo "${noise#*@}")" \
    -f bench/outside/attitude_noise.awk "$real/kitti_0005a/poses.txt" >"$2/poses.txt"
}

# score NAME DATA RUN [ARGS]: points by class of the run's labels
score() {
  run unimapper evaluate dynamic --truth "$2" --run "$3" "${@:4}" >"$results/$1.json" 2>/dev/null &&
    awk -f bench/outside/points.awk "$results/$1.json" >"$results/$1.points"
}

# drive GROUPS SCENE SENSOR OPTIONS SEED
drive() {
  local name data onboard map
  name="$(name_of "$2" "$3" "$4")-$5"
  data="$out/data/$name" onboard="$out/runs/$name" map="$out/runs/$name.map"
  rm -f "$results/$name".*
  if ! { recording "$2" "$3" "$4" "$5" "$data" &&
    run unimapper onboard "$data" --sensor "$3" --out "$onboard" --replace 2>"$results/$name.log" &&
    score "$name.online" "$data" "$onboard" --pictures "$out/pictures/$name" --worst 2 --replace &&
    { ! in_groups "$1" "$refined_groups" || {
      run unimapper merge "$onboard" --truth "$name=$data" --refined-labels --out "$map" --replace \
        >/dev/null 2>&1 && score "$name.refined" "$data" "$map/refined/$name"; }; }; }; then
    echo "$name: a program failed or took longer than $limit s; the row lacks it" >&2
  fi
  rm -rf "$data" "$onboard" "$map"
}

# files NAME SCENE LABELS: results of all seeds that exist
files() {
  local seed
  for seed in $(seeds_of "$2"); do
    [ ! -e "$results/$1-$seed.$3.points" ] || echo "$results/$1-$seed.$3.points"
  done
}
# figure NAME SCENE LABELS FIGURE: of the points of all seeds together
figure() {
  local found
  found=$(files "$1" "$2" "$3")
  # shellcheck disable=SC2086
  if [ -n "$found" ]; then awk -v figure="$4" -f bench/outside/figure.awk $found; else echo –; fi
}

# says NAME SCENE: what the program said of itself in the drives of all seeds
says() {
  local seed logs=()
  for seed in $(seeds_of "$2"); do
    [ ! -e "$results/$1-$seed.log" ] || logs+=("$results/$1-$seed.log")
  done
  [ "${#logs[@]}" != 0 ] || { echo –; return; }
  awk '
    function say(text) { if (!(text in said)) { said[text] = 1; all = all (all ? ", " : "") text } }
    /warning: rays are/ { say("sampling") }
    /warning: rays leave/ { say("elevations") }
    /changed its mode/ { say("mode") }
    /warning: roll and pitch/ { say("attitude noise") }
    /warning: later keyframes/ { say("labels changed later") }
    /warning: sweeps look/ { say("uncompensated sweeps") }
    /warning: in .* up is not/ { say("up contradicted") }
    match($0, /warning: container full \([a-z_]+/) { say("container full (" substr($0, RSTART + 25, RLENGTH - 25) ")") }
    match($0, /up known in [0-9]+ of [0-9]+/) {
      split(substr($0, RSTART, RLENGTH), word, " ")
      known += word[4]; keyframes += word[6]
    }
    END {
      if (known < keyframes) say("up unknown in " keyframes - known " of " keyframes " keyframes")
      print all ? all : "–"
    }' "${logs[@]}"
}

# drive_cells NAME SCENE
drive_cells() {
  local labels=online figure
  for figure in SA DA AA; do printf '%s | ' "$(figure "$1" "$2" $labels $figure)"; done
  printf '%s | ' "$(figure "$1" "$2" refined AA)"
  for figure in poles walkers; do printf '%s | ' "$(figure "$1" "$2" $labels $figure)"; done
  says "$1" "$2"
}
drives_table() {
  local groups scene sensor options
  echo "| seeds $seeds, $scans scans, of what has begun to move | SA | DA | AA online | AA refined | SA of poles and signs | DA of walkers | what the program says |"
  rule 8
  while IFS='|' read -r groups scene sensor options; do
    row "$(title_of "$scene" "$sensor" "$options")" 7 \
      drive_cells "$(name_of "$scene" "$sensor" "$options")" "$scene"
  done < <(wanted)
}

# classes_below NAME SCENE: how many object classes have an SA or DA of refined labels more than 0.2
# below that of online labels; classes with fewer than 1,000 points are left out.
classes_below() {
  local online refined
  online=$(files "$1" "$2" online)
  refined=$(files "$1" "$2" refined)
  [ -n "$refined" ] || { echo –; return; }
  # shellcheck disable=SC2086
  awk -v goal=0.2 -f bench/outside/classes_below.awk $online labels=refined $refined
}

# value FIGURE LABELS SCENE SENSOR OPTIONS: a figure, `loss` of AA against the LiDAR's own mode, or
# `below`, a number of classes
value() {
  local name own
  name=$(name_of "$3" "$4" "$5")
  if [ "$1" = below ]; then classes_below "$name" "$3"; return; fi
  if [ "$1" != loss ]; then figure "$name" "$3" "$2" "$1"; return; fi
  own=$(figure "$(name_of "$3" "$4" "")" "$3" "$2" AA)
  awk -v own="$own" -v this="$(figure "$name" "$3" "$2" AA)" 'BEGIN {
    if (own == "–" || this == "–") print "–"; else printf "%.2f\n", own - this }'
}

# target_cells FIGURE LABELS COMPARISON GOAL GROUPS: worst drive, its figure, and how many reach it.
# Drives that miss are listed in $out/missed.
target_cells() {
  local groups scene sensor options found
  while IFS='|' read -r groups scene sensor options; do
    in_groups "$groups" "$5" || continue
    found=$(value "$1" "$2" "$scene" "$sensor" "$options")
    [ "$found" = – ] ||
      echo "$found|$(title_of "$scene" "$sensor" "$options")|$(name_of "$scene" "$sensor" "$options")"
  done < <(wanted) | awk -F '|' -v at_least="$([ "$3" = ">=" ] && echo 1)" -v goal="$4" \
    -v missed="$out/missed" '
    { reaches = at_least ? $1 >= goal : $1 <= goal }
    reaches { ++reached }
    !reaches { print $3 >>missed }
    NR == 1 || (at_least ? $1 < worst + 0 : $1 > worst + 0) { worst = $1; where = $2 }
    END {
      if (!NR) { print "– | – | not measured"; exit }
      printf "%s | %s | %s\n", worst, where, reached == NR ? "**reached**" : reached + 0 " of " NR
    }'
}
targets_table() {
  local title figure labels comparison goal groups
  echo "| target, % | worst of its drives | which | drives that reach it |"
  rule 4
  only_layout || : >"$out/missed"
  while IFS='|' read -r title figure labels comparison goal groups; do
    row "$title ${comparison/>=/≥} $goal" 3 target_cells "$figure" "$labels" "$comparison" "$goal" "$groups" |
      sed 's/ <= / ≤ /'
  done < <(targets)
}

# mount_options ROLL PITCH
mount_options() {
  [ "$1 $2" = "0 0" ] || echo "--mount-roll $1 --mount-pitch $2 --odometry-start identity"
}
mount_title() { if [ "$1 $2" = "0 0" ]; then echo level; else echo "roll $1°, pitch $2°"; fi; }

# measure_up SCENE SENSOR ROLL PITCH: error of up against the truth, drives of all seeds
measure_up() {
  local seed folders=()
  for seed in $seeds; do
    folders+=("$out/data/up-$seed")
    recording "$1" "$2" "$(mount_options "$3" "$4")" "$seed" "$out/data/up-$seed"
  done
  run bench_gravity "${folders[@]}" >"$results/up-$1-$2.txt"
  rm -rf "${folders[@]}"
}
# up_cells FILE: keyframes, known, tilt of the odometry, median, 95 %, sigma, in 2 sigma, reached or not
up_cells() {
  [ -s "$1" ] || { echo "– | – | – | – | – | – | – | not measured"; return; }
  awk '$1 == "all" {
    if (!$3) { printf "%s | 0 | %s | – | – | – | – | unknown\n", $2, $4; exit }
    ok = $5 <= 0.3 && $6 <= 0.6 && $9 >= 95
    printf "%s | %s | %s | %s | %s | %s | %s | %s\n", $2, $3, $4, $5, $6, $8, $9, \
      ok ? "**reached**" : "missed"
  }' "$1"
}
up_table() {
  local scene sensor roll pitch
  echo "| seeds $seeds, $scans scans; target: median ≤ 0.3°, 95 % ≤ 0.6°, within 2 sigma in 95 % | keyframes from the third on | up known | odometry's z off by ° | error of up °, median | 95 % | sigma | within 2 sigma % | |"
  rule 9
  while IFS='|' read -r scene sensor roll pitch; do
    row "$scene, $(lidar "$sensor"), $(mount_title "$roll" "$pitch")" 8 \
      up_cells "$results/up-$scene-$sensor.txt"
  done < <(mounted_sample)
}

# pair NAME A B: two recordings as sessions, the second searched for in the first, and both merged
pair() {
  local map="$out/runs/$1.map" a b
  a="$out/runs/$1.A" b="$out/runs/$1.B"
  rm -rf "$a" "$b" "$map" "$results/$1".*
  run unimapper onboard "$2" --sensor "$4" --out "$a" 2>"$results/$1.A.log" &&
    run unimapper onboard "$3" --sensor "$5" --out "$b" --against "$a" 2>"$results/$1.B.log" &&
    run unimapper evaluate loops --run "$b" --truth "$3" --against "$a" --against-truth "$2" \
      --threshold-m "${6:-10}" >"$results/$1.loops" &&
    run unimapper merge "$a" "$b" --allow-unconnected --out "$map" >"$results/$1.merge" 2>&1 &&
    run unimapper evaluate trajectory --map "$map" --truth "$1.A=$2" "$1.B=$3" >"$results/$1.ate" ||
    echo "$1: a program failed or took longer than $limit s; the row lacks it" >&2
  rm -rf "$a" "$b" "$map"
}
measure_pair() {  # measure_pair SCENE SENSOR ROLL PITCH SENSOR ROLL PITCH SEED
  local name="pair-$1-$2-$3-$4-$5-$6-$7-$8" data="$out/data/pair"
  recording "$1" "$2" "$(mount_options "$3" "$4")" "$8" "$data.A" "$pair_scans" A
  recording "$1" "$5" "$(mount_options "$6" "$7")" "$8" "$data.B" "$pair_scans" B
  pair "$name" "$data.A" "$data.B" "$2" "$5"
  rm -rf "$data.A" "$data.B"
}
# pair_cells F1 ATE TILT NAME...: F1 by pose, wrong loops, merged, largest ATE and tilt of the map, reached or
# not. Where up is unknown a map keeps the odometry's tilt, so that is no target everywhere.
pair_cells() {
  local name
  for name in "${@:4}"; do
    [ -e "$results/$name.ate" ] || continue
    echo "loops $(number "$results/$name.loops" true_positives_pose)" \
      "$(number "$results/$name.loops" false_positives_pose)" \
      "$(number "$results/$name.loops" false_negatives_pose)"
    grep -oE '[0-9]+ of [0-9]+ sessions in one frame' "$results/$name.merge"
    sed -n '/"ate_m": {/,/}/p' "$results/$name.ate" | grep '"rmse"' | tr -d ',"'
    sed -n '/"tilt_deg": {/,/}/p' "$results/$name.ate" | grep '"max"' | tr -d ',"'
  done | awk -v f1_goal="$1" -v ate_goal="$2" -v tilt_goal="$3" '
    $1 == "loops" { right += $2; wrong += $3; missed += $4; ++pairs }
    / in one frame/ { if ($1 == $3) ++merged }
    $1 == "rmse:" && $2 + 0 > ate { ate = $2 + 0 }
    $1 == "max:" && $2 + 0 > tilt { tilt = $2 + 0 }
    END {
      if (!pairs) { print "– | – | – | – | – | not measured"; exit }
      f1 = right + wrong + missed ? 2 * right / (2 * right + wrong + missed) : 0
      ok = f1 >= f1_goal && !wrong && merged == pairs && ate <= ate_goal && tilt <= tilt_goal
      printf "%.3f | %d | %d of %d | %s | %s | %s\n", f1, wrong, merged, pairs, \
        merged ? sprintf("%.3f", ate) : "–", merged ? sprintf("%.2f", tilt) : "–", ok ? "**reached**" : "missed"
    }'
}
pairs_table() {
  local scene one r1 p1 other r2 p2 seed names
  echo "| seeds $seeds, $pair_scans scans each | F1 by pose | accepted wrong | merged | ATE, largest, m | tilt of the map, largest, ° | |"
  rule 7
  while IFS='|' read -r scene one r1 p1 other r2 p2; do
    names=()
    for seed in $seeds; do names+=("pair-$scene-$one-$r1-$p1-$other-$r2-$p2-$seed"); done
    row "$scene, $(lidar "$one") ($(mount_title "$r1" "$p1")) and $(lidar "$other") ($(mount_title "$r2" "$p2"))" 6 \
      pair_cells 0.97 0.2 0.3 "${names[@]}"
  done < <(pairs_sample)
}

# Sessions of one hall: the recording cut in two and levelled or not, simulated halls; and two halls
# that must stay apart.
hall_splits="halves alternating first-third last-third"
hall_lidars="vlp-16 os1-64"
# different_halls_cells NAME...: as pair_cells, of pairs that must not be merged
different_halls_cells() {
  local name
  for name in "$@"; do
    [ -e "$results/$name.merge" ] || continue
    echo "wrong $(number "$results/$name.loops" false_positives_pose)"
    grep -oE '[0-9]+ of [0-9]+ sessions in one frame' "$results/$name.merge"
  done | awk '
    $1 == "wrong" { wrong += $2; ++pairs }
    / in one frame/ { if ($1 == $3) ++merged }
    END {
      if (!pairs) { print "– | – | – | – | – | not measured"; exit }
      printf "– | %d | %d of %d | – | – | %s\n", wrong, merged, pairs, merged ? "missed" : "**apart**"
    }'
}
halls_table() {
  local how tilt sensor seed other names
  echo "| hall; seeds $seeds | F1 by pose | accepted wrong | merged | ATE, largest, m | tilt of the map, largest, ° | |"
  rule 7
  if [ -n "$real" ]; then
    for how in $hall_splits; do
      for tilt in 0 2; do
        row "recording, ${how/alternating/alternating scans}, $([ $tilt = 0 ] && echo level || echo "odometry tilted by $tilt°")" 6 \
          pair_cells 0.85 0.15 180 "hall-$how-$tilt"
      done
    done
  fi
  for sensor in $hall_lidars; do
    names=()
    for seed in $seeds; do names+=("hall-$sensor-$seed-$seed"); done
    row "simulated, $(lidar "$sensor"), two drives" 6 pair_cells 0.85 0.15 180 "${names[@]}"
    names=()
    for seed in $seeds; do
      for other in $seeds; do [ "$seed" = "$other" ] || names+=("hall-$sensor-$seed-$other"); done
    done
    row "simulated, $(lidar "$sensor"), two different halls" 6 different_halls_cells "${names[@]}"
  done
}
measure_halls() {
  local how tilt sensor seed other data="$out/data/hall"
  for how in $hall_splits; do
    [ -n "$real" ] || break
    for tilt in 0 2; do
      rm -rf "$data"
      run split_recording "$how" "$real/hilti_hall" "$data" --tilt-deg "$tilt" >/dev/null &&
        pair "hall-$how-$tilt" "$data/A" "$data/B" generic generic 8
    done
  done
  rm -rf "$data"
  for sensor in $hall_lidars; do
    for seed in $seeds; do
      recording hall "$sensor" "" "$seed" "$data.A" 250 A
      for other in $seeds; do
        recording hall "$sensor" "" "$other" "$data.B" 250 B
        pair "hall-$sensor-$seed-$other" "$data.A" "$data.B" "$sensor" "$sensor" 8
      done
    done
    rm -rf "$data.A" "$data.B"
  done
}

measure() {
  local groups scene sensor options seed one r1 p1 other r2 p2
  while IFS='|' read -r groups scene sensor options <&3; do
    for seed in $(seeds_of "$scene"); do drive "$groups" "$scene" "$sensor" "$options" "$seed"; done
  done 3< <(wanted)
  if wants up; then
    while IFS='|' read -r scene sensor r1 p1 <&3; do
      measure_up "$scene" "$sensor" "$r1" "$p1" || echo "up, $scene, $sensor: not measured" >&2
    done 3< <(mounted_sample)
  fi
  if wants pairs; then
    while IFS='|' read -r scene one r1 p1 other r2 p2 <&3; do
      for seed in $seeds; do
        measure_pair "$scene" "$one" "$r1" "$p1" "$other" "$r2" "$p2" "$seed" ||
          echo "pair, $scene, $one, $other: not measured" >&2
      done
    done 3< <(pairs_sample)
  fi
  if wants hall; then measure_halls; fi
}

# Pictures of drives that reach all their targets are not needed.
keep_missed_pictures() {
  local folder name
  for folder in "$out"/pictures/*; do
    [ -d "$folder" ] || continue
    name=$(basename "$folder")
    grep -qxF "${name%-*}" "$out/missed" || rm -rf "$folder"
  done
}

only_layout || [ "${MEASURE:-1}" = 0 ] || measure
table outside-targets targets_table
table outside-drives drives_table
if wants up; then table outside-up up_table; fi
if wants pairs; then table outside-pairs pairs_table; fi
if wants hall; then table outside-halls halls_table; fi
if ! only_layout; then
  keep_missed_pictures
  echo
  echo "Worst frames of drives that miss a target: $out/pictures."
fi
