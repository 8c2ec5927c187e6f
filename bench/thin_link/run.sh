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
# shellcheck source=bench/faults/processes.sh
source bench/faults/processes.sh

bin=${BIN:-build/release/bin}
out=${OUT:-build/bench/thin_link}
seed=${SEED:-7}
scans=300
unimapper=$bin/unimapper
# The two robots meet, in directions of their own.
declare -A route=([os2-128]=A [vlp-16]=C) other=([os2-128]=vlp-16 [vlp-16]=os2-128)
# A port for each, since a socket hears every group of its port that anybody here has joined.
declare -A port=([os2-128]=7667 [vlp-16]=7677)

# drive SCENE SENSOR: a recording, and the run of a robot that a base hears whole
drive() {
  local folder=$out/$1-$2
  [ -e "$folder/data/dataset.json" ] || "$unimapper" simulate --scene "$1" --sensor "$2" \
    --route "${route[$2]}" --scans "$scans" --seed "$seed" --out "$folder/data" 2>"$folder.log"
  [ -e "$folder/$2/stats.json" ] ||
    "$unimapper" onboard "$folder/data" --out "$folder/$2" >"$folder.log" 2>&1
}

# deliver SCENE SENSOR BYTES_PER_SECOND: what a base has at the end of the drive. In a shell of its
# own: what it started ends with it.
deliver() (
  row=$out/$1-$2-$3 store=$out/$1-$2-$3/store bases=0 keys='' receive_buffer='' longest=60
  robots_group=239.255.76.67:${port[$2]} base_group=239.255.76.68:$((port[$2] + 1))
  rm -rf "$row"
  mkdir -p "$row"
  relay "rate=$3,queue=$(($3 / 2)),delay=10" delay=10
  base
  start robot "$unimapper" onboard "$out/$1-$2/data" --out "$row/$2" --spool "$row/spool" --realtime \
    --publish "udpm://$robots_group?ttl=0" --datagram-bytes 1300 --min-bytes-per-second 1000
  # It says so after a tenth of the drive. A second for what is on its way.
  await "[0-9]/$scans scans" robot.err
  sleep $((9 * scans / 100 + 1))
  kill_process robot
  send_signal TERM base
  wait_for "$current_base"
)

# merged SCENE SENSOR SOURCE NAME: with the other robot's run; cells "loops | ATE"
merged() {
  local with=${other[$2]} log=$out/$1-$2-$4.merge
  "$unimapper" merge "$3" "$out/$1-$with/$with" --out "$out/$1-$2-$4.map" --replace \
    --allow-unconnected --truth "$2=$out/$1-$2/data" "$with=$out/$1-$with/data" >"$log" 2>"$log.err"
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
  local scene sensor
  echo "| one robot, and how much of it passes | keyframes made | whole | by summary | loops accepted | ATE m |"
  rule 6
  for scene in town campus; do
    for sensor in os2-128 vlp-16; do
      row "$(lidar "$sensor"), $scene, all of it" 5 cells "$scene" "$sensor" whole
      row "$(lidar "$sensor"), $scene, 256 kbit/s" 5 cells "$scene" "$sensor" 32000
      row "$(lidar "$sensor"), $scene, 64 kbit/s" 5 cells "$scene" "$sensor" 8000
    done
  done
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
