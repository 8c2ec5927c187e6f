#!/usr/bin/env bash
# Checks of a recording, by both of their errors: the tables of docs/design/plausibility.md.
#
#   bench/input/checks.sh [SEEDS]        "1 3". A quarter of an hour a seed
#   bench/input/checks.sh SEEDS live     what is said while the robot drives. Minutes
#   bench/input/checks.sh SEEDS right    false alarms on right drives of seven LiDARs through all
#                                        scenes. Twenty minutes a seed; VERBOSE=1 says which
#   bench/input/checks.sh SEED cost      processor time of checks and of runs. Two minutes
#
# Drives of seven LiDARs through several scenes with the default odometry, and some with tilted
# mounts, noise of the attitude, a swaying body or distorted sweeps, whose poses are then of a
# frame that is off by what a row says. Thresholds were chosen on even seeds. OUT: folder of drives,
# kept; BIN: programs; SCANS: of a drive.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seeds=${1:-1 3}
mode=${2:-}
out=${OUT:-build/bench/input_checks$mode}
scans=${SCANS:-$([ "$mode" = live ] && echo 300 || echo 200)}
unimapper=${BIN:-build/release/bin}/unimapper

# drive NAME OPTION...: simulated once
drive() {
  [ -e "$out/$1/times.txt" ] && return
  mkdir -p "$out"
  rm -rf "$out/$1" "$out/unfinished"
  "$unimapper" simulate --scans "$scans" --out "$out/unfinished" "${@:2}" >/dev/null 2>&1
  mv "$out/unfinished" "$out/$1"
}

drives() {
  local seed
  for seed in $seeds; do
    drive "$seed-town-vlp-16" --scene town --sensor vlp-16 --seed "$seed"
    drive "$seed-campus-os1-64" --scene campus --sensor os1-64 --columns 512 --seed "$seed"
    drive "$seed-town-avia" --scene town --sensor livox-avia --seed "$seed"
    drive "$seed-hall-mid-360" --scene hall --sensor livox-mid-360 --seed "$seed"
    drive "$seed-deck-vlp-16" --scene deck --sensor vlp-16 --seed "$seed"
    drive "$seed-town-noise" --scene town --sensor vlp-16 --attitude-noise 0.5 --seed "$seed"
    drive "$seed-campus-sway" --scene campus --sensor vlp-16 --sway 3@1 --seed "$seed"
    drive "$seed-campus-tilted" --scene campus --sensor livox-mid-360 --mount-pitch 20 \
      --mount-roll 5 --seed "$seed"
    drive "$seed-street-bad" --scene street --sensor vlp-16 --drift bad --seed "$seed"
    [ "$mode" = live ] && continue
    drive "$seed-town-os2-128" --scene town --sensor os2-128 --columns 512 --seed "$seed"
    drive "$seed-convoy-hdl-64e" --scene convoy --sensor hdl-64e --columns 512 --seed "$seed"
    drive "$seed-town-aeva" --scene town --sensor aeva-aeries2 --seed "$seed"
    drive "$seed-tunnel-os1-64" --scene tunnel --sensor os1-64 --columns 512 --seed "$seed"
    drive "$seed-town-distorted" --scene town --sensor os1-64 --columns 512 --distortion \
      --seed "$seed"
  done
}

# faulty KIND VALUE: cells of the drives with that fault
faulty() {
  bench/input/checks.py "$unimapper" "$out" "$1" "$2" $seeds
}

# scattered DEGREES KIND VALUE: the same, with noise of roll and pitch in the poses
scattered() {
  NOISE=$1 faulty "$2" "$3"
}

checks() {
  local check
  only_layout || drives
  rm -f "$out-right.json"
  echo "| check | unit | said above | refused above | largest on right drives |"
  rule 5
  for check in points records units origin "repeated scans" "order of stamps" interval spacing \
    rounding frame speed mount time motion succession odometry attitude; do
    row "$check" 4 faulty limits "$check"
  done
}

# live KIND VALUE: the same, while the robot drives
live() {
  LIVE=$(dirname "$unimapper")/live_checks faulty "$1" "$2"
}

live_rows() {
  local value
  only_layout || drives
  echo "| what is wrong | drives | said | as what it is | after: median | longest |"
  rule 6
  row "nothing" 5 live none 0
  for value in 2 3 5; do row "yaw by $value degrees" 5 live yaw "$value"; done
  row "pitch by 2 degrees" 5 live pitch 2
  row "lever arm, 1.2 m forward" 5 live x 1.2
  for value in 0.10 0.15; do row "poses late by $value s" 5 live late "$value"; done
  row "poses early by 0.15 s" 5 live late -0.15
  row "positions 1.1 times as far" 5 live scale 1.1
  row "millimetres for metres" 5 live scale 1000
  row "kilometres for metres" 5 live scale 0.001
  row "poses inverted" 5 live inverted 0
  row "axes of a camera" 5 live camera 0
  row "points mirrored along y" 5 live mirror 0
}

rows() {
  local value
  only_layout || drives
  echo "| what is wrong | drives | said | refused | shown | error of the estimate: median | 90 % |"
  rule 7
  row "nothing" 6 faulty none 0
  for value in 1 2 5; do row "yaw by $value degrees" 6 faulty yaw "$value"; done
  for value in 1 2 5; do row "pitch by $value degrees" 6 faulty pitch "$value"; done
  for value in 0.5 1.2; do row "lever arm, $value m forward" 6 faulty x "$value"; done
  for value in 0.05 0.10 0.15; do row "poses late by $value s" 6 faulty late "$value"; done
  row "poses early by 0.15 s" 6 faulty late -0.15
  row "upside down" 6 faulty over 180
  for value in 0.5 1 3; do row "a jump by $value m half way" 6 faulty jump "$value"; done
  row "the odometry starts anew half way" 6 faulty restart 0
  row "carried for 3 s half way" 6 faulty carried 3
  row "scans in the order of text" 6 faulty names 0
  row "points mirrored along y" 6 faulty mirror 0
  for value in 0.3 0.5 1.0; do
    row "roll and pitch scatter by $value degrees" 6 scattered "$value" none 0
  done
  row "by 0.5 degrees, and yaw by 2 degrees" 6 scattered 0.5 yaw 2
  row "by 0.5 degrees, and pitch by 2 degrees" 6 scattered 0.5 pitch 2
  row "by 0.5 degrees, and lever arm, 1.2 m forward" 6 scattered 0.5 x 1.2
  row "by 0.5 degrees, and poses late by 0.10 s" 6 scattered 0.5 late 0.10
  row "by 0.5 degrees, and points mirrored along y" 6 scattered 0.5 mirror 0
}

# right LIDAR: sums over seeds; the drives of one seed are there at a time
right() {
  local seed scene number columns=()
  case $1 in os* | hdl*) columns=(--columns 512) ;; esac
  for seed in $seeds; do
    rm -rf "$out"
    number=$seed
    for scene in town campus deck square convoy street tunnel hall bore fixtures decks streets corridor \
      courtyard quad orchard; do
      drive "$seed-$scene" --scene "$scene" --sensor "$1" "${columns[@]}" --seed "$seed" \
        --route "$(cut -c $((number % 3 + 1)) <<<ABC)" \
        --drift "$(cut -d ' ' -f $((number % 2 + 1)) <<<'lio icp')"
      number=$((number + 1))
    done
    seeds=$seed faulty none 0
    seeds=$seed live none 0
  done | awk -F ' *[|] *' 'NR % 2 { drives += $1; said += $2; refused += $3 } !(NR % 2) { live += $2 }
    END { print drives " | " said " | " refused " | " live }'
  rm -rf "$out"
}

right_rows() {
  local lidar
  echo "| nothing wrong | drives | said | refused | said while the robot drives |"
  rule 5
  for lidar in hdl-64e vlp-16 os1-64 os2-128 aeva-aeries2 livox-avia livox-mid-360; do
    row "$(lidar "$lidar")" 4 right "$lidar"
  done
}

# seconds COMMAND...: of the processor, in user mode
seconds() {
  local TIMEFORMAT=%U
  { time "$@" >/dev/null 2>&1; } 2>&1
}

# cost SCANS LIDAR: medians of five runs in turn
cost() {
  local i name=$seeds-$2-$1
  scans=$1 drive "$name" --scene town --sensor "$2" --seed "$seeds" --drift lio
  rm -f "$out/cost"
  for i in 1 2 3 4 5; do
    echo "$(seconds "$unimapper" inspect "$out/$name")" \
      "$(seconds "$unimapper" onboard "$out/$name" --out "$out/run" --replace)"
  done >"$out/cost"
  paste -d ' ' <(cut -d ' ' -f 1 "$out/cost" | sort -g) <(cut -d ' ' -f 2 "$out/cost" | sort -g) |
    awk 'NR == 3 { printf "%.2f | %.2f | %.0f %%\n", $1, $2, 100 * $1 / $2 }'
}

cost_rows() {
  echo "| processor time, s | inspect | onboard | share |"
  rule 4
  row "\`town\`, VLP-16, 1,000 scans" 3 cost 1000 vlp-16
  row "\`town\`, Livox Avia, 1,000 scans" 3 cost 1000 livox-avia
  row "\`town\`, OS2-128, 300 scans" 3 cost 300 os2-128
}

case $mode in
  cost) table check-cost cost_rows; exit ;;
  live) table live-checks live_rows; exit ;;
  right) table right-drives right_rows; exit ;;
esac
table input-checks rows
table input-check-limits checks
