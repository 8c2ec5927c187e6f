#!/usr/bin/env bash
# Sites to a centre, under kills and under load: tables of docs/fleet.md (WRITE_DOCS=1 writes them).
#
#   bench/fleet/run.sh [ROBOTS [SITES [KEYFRAMES [SECONDS [SEED]]]]]   20 3 30 30 1: a minute
#   bench/fleet/run.sh cluster [SECONDS [KILL [CUT [SEED]]]]           60 15 15 1: two minutes
#   bench/fleet/run.sh load [SECONDS [ROBOTS...]]                      15 20 40: two minutes
#   bench/fleet/run.sh year                                            a minute
#   bench/fleet/run.sh schedule [SCANS [SEED]]                         400 7: six minutes
#
# Real processes on multicast and TCP in a network namespace of their own: robots without a LiDAR, a
# base at each site, NATS servers, a base at the centre. About every second one of the bases or the
# server is killed (-9) and started again, as the seed says. `cluster`: three servers, one of which is
# killed every KILL seconds; one site reaches them by a leaf node, whose link is cut for CUT seconds.
# `load`: nobody is killed, and each of ROBOTS, at ten sites, sends a keyframe of a town a second.
# `year`: keyframes of simulated drives through a town, and what 20 robots make of them in 250 days of
# eight hours; a terabyte for 20 €, twice. `schedule`: loops of eight town sessions on other numbers of
# workers, by a model with measured times (schedule.cpp). Ends with 77 where making a namespace is not
# allowed, with 1 if a keyframe was lost or came twice. BIN, OUT: folders of programs and of output;
# LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
enter_namespace n "$@"
bin=${BIN:-build/release/bin}
out=${OUT:-build/bench/fleet}
unimapper=$bin/unimapper
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

kill_rows() {
  echo "| robots, sites | keyframes | kills | lost | twice | at the centre after the last one, s | a site's base, ms a keyframe | server, ms | centre's base, ms |"
  rule 9
  row "${1:-20}, ${2:-3}" 8 bench/fleet/drive.py "$bin" "$out/kills" --robots "${1:-20}" \
    --sites "${2:-3}" --keyframes "${3:-30}" --seconds "${4:-30}" --seed "${5:-1}"
}

cluster_rows() {
  echo "| s, a server killed every, s; link cut, s | keyframes | kills | lost | twice | at the centre after the last one, s | a site's base, ms a keyframe | servers, ms | centre's base, ms |"
  rule 9
  row "${1:-60}, ${2:-15}; ${3:-15}" 8 bench/fleet/drive.py "$bin" "$out/cluster" --robots 9 --sites 3 \
    --keyframes "$((${1:-60} / 2))" --seconds "${1:-60}" --servers 3 --server-kill-s "${2:-15}" \
    --cut-s "${3:-15}" --seed "${4:-1}"
}

load_rows() {
  local seconds=${1:-15} robots
  shift $(($# > 0 ? 1 : 0))
  [ $# -gt 0 ] || set -- 20 40
  if ! only_layout && [ ! -d "$out/town" ]; then
    make_run town_7_100_A --scene town --sensor vlp-16 --route A --scans 100 --seed 7
    "$unimapper" map create --store "$out/town" >/dev/null
    "$unimapper" map add --store "$out/town" "$out/runs/town_7_100_A" >/dev/null
  fi
  echo "| robots, ten sites, s | keyframes | lost | twice | robots held back, s | at the centre after the last second, s | robots, ms a keyframe | a site's base, ms | server, ms | centre's base, ms |"
  rule 10
  for robots; do
    row "$robots, $seconds" 9 bench/fleet/load.py "$bin" "$out/load" "$out/town" "$robots" 10 "$seconds"
  done
}

year_rows() {
  local sensor
  echo "| LiDAR | kB a keyframe | keyframes an hour and robot | GB a day | Mbit/s while they drive | stream for three days, GB | TB a year | disks at site and centre, € |"
  rule 8
  for sensor in vlp-16 livox-mid-360 os2-128; do
    only_layout || make_run "year_$sensor" --scene town --sensor "$sensor" --route A --scans 100 --seed 7
    row "$(lidar "$sensor")" 7 bench/fleet/year.py "$out/runs/year_$sensor"
  done
}

schedule_rows() {
  local i route routes=(A B C A B C A B) logs=()
  if ! only_layout; then
    for i in "${!routes[@]}"; do
      route=${routes[i]}
      make_run "eight_${2:-7}_${1:-400}_$i" --scene town --sensor vlp-16 --route "$route" --day "$i" \
        --scans "${1:-400}" --seed "${2:-7}"
      logs+=("$out/runs/eight_${2:-7}_${1:-400}_$i/keyframes.lcmlog")
    done
    "$bin/fleet_schedule" "${logs[@]}" >"$out/schedule.txt"
    head -1 "$out/schedule.txt" >&2
  fi
  echo "| workers | s | speed-up | clouds that they build | busy, % | s without the link's limit | s if keyframes and clouds cost nothing |"
  rule 7
  for i in 1 2 4 16 64; do
    row "$i" 6 awk -v workers="$i" '$1 == workers { printf "%s | %s | %s | %s | %s | %s", $2, $3, $4, $5, $6, $7 }' \
      "$out/schedule.txt"
  done
}

case "${1:-}" in
  cluster | load | year | schedule) table "fleet-$1" "$1_rows" "${@:2}" ;;
  *) table fleet kill_rows "$@" ;;
esac
