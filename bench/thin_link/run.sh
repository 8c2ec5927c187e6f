#!/usr/bin/env bash
# Maps of robots over thin links: the table of docs/results.md.
#
#   bench/thin_link/run.sh    about six minutes
#
# Two robots drive in one simulated scene. The keyframes of one reach a base through a relay that
# lets so many bytes a second pass, with a queue of half a second, in a network namespace of
# its own. Its process is killed when its drive ends; what the base has by then is merged with the
# whole session of the other robot. Ends with 77 where making a namespace is not allowed.
#
#   BIN, OUT   folders of programs and of output
#   SEED       of scenes and drives
#   WRITE_DOCS=1  puts the table into docs/results.md
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

bin=${BIN:-build/release/bin}
out=${OUT:-build/bench/thin_link}
seed=${SEED:-7}
scans=300
unimapper=$bin/unimapper

# route SENSOR: the two meet, in directions of their own
route() { [ "$1" = os2-128 ] && echo A || echo C; }
other() { [ "$1" = os2-128 ] && echo vlp-16 || echo os2-128; }

# drive SCENE SENSOR: a recording, and the run of a robot that a base hears whole
drive() {
  local folder=$out/$1-$2
  [ -e "$folder/data/dataset.json" ] || "$unimapper" simulate --scene "$1" --sensor "$2" \
    --route "$(route "$2")" --scans "$scans" --seed "$seed" --out "$folder/data" 2>"$folder.log"
  [ -e "$folder/$2/stats.json" ] ||
    "$unimapper" onboard "$folder/data" --out "$folder/$2" >"$folder.log" 2>&1
}

# deliver SCENE SENSOR BYTES_PER_SECOND: what a base has at the end of the drive. In a shell of its
# own: what it started ends with it.
deliver() (
  trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
  local row=$out/$1-$2-$3 port=7667 relay base robot
  # Another port, since a socket hears every group of its port that anybody here has joined.
  [ "$2" = os2-128 ] || port=7677
  local robots=239.255.76.67:$port from=239.255.76.68:$((port + 1))
  rm -rf "$row"
  mkdir -p "$row"
  "$bin/fault_relay" --robots "$robots" --base "$from" --seed "$seed" \
    --to-base "rate=$3,queue=$(($3 / 2)),delay=10" --to-robots delay=10 \
    >"$row/relay.out" &
  relay=$!
  "$unimapper" base --store "$row/store" --listen "udpm://$from?ttl=0" \
    >"$row/base.out" 2>"$row/base.err" &
  base=$!
  until grep -qs listening "$row/base.err" && grep -qs relaying "$row/relay.out"; do sleep 0.05; done
  "$unimapper" onboard "$out/$1-$2/data" --out "$row/$2" --spool "$row/spool" --realtime \
    --publish "udpm://$robots?ttl=0" --datagram-bytes 1300 --min-bytes-per-second 1000 \
    >"$row/robot.out" 2>"$row/robot.err" &
  robot=$!
  # A second for what is on its way.
  sleep "$(awk "BEGIN { print $scans / 10 + 2 }")"
  kill -9 $robot
  wait $robot 2>/dev/null || true
  kill -TERM $base $relay
  wait $base $relay || true
)

# merged SCENE SENSOR SOURCE: with the other robot's run; cells "loops | ATE"
merged() {
  local other log=$out/$1-$2-$4.merge
  other=$(other "$2")
  "$unimapper" merge "$3" "$out/$1-$other/$other" --out "$out/$1-$2-$4.map" --replace \
    --allow-unconnected --truth "$2=$out/$1-$2/data" "$other=$out/$1-$other/data" >"$log" 2>"$log.err"
  awk -v name="$2" '
    $1 == name && $2 == name { ate = $3 == "unconnected" ? "–" : $8 }
    $1 == "loops:" { loops = $2 }
    END { printf "%s | %s", loops, ate }' "$log"
}

# cells SCENE SENSOR BYTES_PER_SECOND|whole
cells() {
  local made=$((scans / 10)) store=$out/$1-$2-$3/store
  if [ "$3" = whole ]; then
    echo "$made | $made | 0 | $(merged "$1" "$2" "$out/$1-$2/$2" whole)"
    return
  fi
  "$unimapper" inspect --json "$store" >"$store.json"
  echo "$made | $(number "$store.json" keyframes) | $(number "$store.json" summaries) |" \
    "$(merged "$1" "$2" "$store" "$3")"
}

thin_table() {
  local scene sensor rate
  echo "| one robot, and how much of it passes | keyframes made | whole | by summary | loops accepted | ATE m |"
  rule 6
  for scene in town campus; do
    for sensor in os2-128 vlp-16; do
      for rate in whole 32000 8000; do
        row "$(lidar "$sensor"), $scene, $(title "$rate")" 5 cells "$scene" "$sensor" "$rate"
      done
    done
  done
}
title() {
  case "$1" in
    whole) echo "all of it" ;;
    *) echo "$(($1 / 125)) kbit/s" ;;
  esac
}

enter_namespace n "$@"
if ! only_layout; then
  mkdir -p "$out"
  out=$(cd "$out" && pwd)
  for scene in town campus; do
    for sensor in os2-128 vlp-16; do drive "$scene" "$sensor"; done
    for rate in 32000 8000; do
      for sensor in os2-128 vlp-16; do deliver "$scene" "$sensor" "$rate" & done
      wait
    done
  done
fi
table thin-link thin_table
