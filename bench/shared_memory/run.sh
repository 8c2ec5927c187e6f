#!/usr/bin/env bash
# Latency and cost of shared memory, and kill storms: the tables of docs/shared-memory.md.
#
#   bench/shared_memory/run.sh     two minutes; BIN names the folder of programs
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/shared_memory
bin=${BIN:-build/release/bin}
messages=2000
only_layout || mkdir -p "$out"

# latency_cells MEGABYTES [PRIORITY]: the reader's p50, p99 and longest, then p50 and p99 of loan and publish
latency_cells() {
  "$bin/share_latency" "$1" "$messages" "${@:2}" >"$out/latency-$1.txt"
  awk '
    $1 == "latency" { printf "%s | %s | %s", $2, $3, $4 }
    $1 == "loan" || $1 == "publish" { printf " | %s / %s", $2, $3 }' "$out/latency-$1.txt"
}

latency_table() {
  echo "| microseconds, $messages messages at 100 Hz | published to read, p50 | p99 | longest | loan, p50 / p99 | publish, p50 / p99 |"
  rule 6
  row "1 MB" 5 latency_cells 1
  row "4 MB" 5 latency_cells 4
  row "1 MB, SCHED_FIFO, both on one core" 5 latency_cells 1 50
  row "4 MB, SCHED_FIFO, both on one core" 5 latency_cells 4 50
}

# kill_cells WHO: what share_kills counted
kill_cells() {
  awk -v who="$1" '$2 == who { printf "%d | %d | %d | %d | %d | %d", $1, $4, $6, $8, $10, $12 }' "$out/kills.txt"
}

kills_table() {
  echo "| SIGKILL at every step and at random times | killed | ended otherwise | messages torn | slots or leases leaked | messages dropped | messages lost |"
  rule 7
  only_layout || "$bin/share_kills" 10000 1000 >"$out/kills.txt"
  row "consumers" 6 kill_cells consumers
  row "writers" 6 kill_cells writers
}

# cost_cells SENSOR: size of a keyframe; p50 and p99 of sharing it, and the labels of its scans
cost_cells() {
  local data="$out/data-$1"
  [ -e "$data/dataset.json" ] ||
    "$bin/unimapper" simulate --scene town --sensor "$1" --scans 300 --seed 3 --out "$data" 2>/dev/null
  "$bin/share_cost" "$data" "$1" >"$out/cost-$1.txt"
  awk '
    $1 == "keyframes" { printf "%s", $3 }
    $1 == "keyframe" || $1 == "labels" { printf " | %s / %s", $2, $3 }' "$out/cost-$1.txt"
}

cost_table() {
  echo "| on the pipeline's thread, ms | cells of a keyframe, MB | keyframe and health, p50 / p99 | labels of ten scans, p50 / p99 |"
  rule 4
  row "OS2-128" 3 cost_cells os2-128
  row "VLP-16" 3 cost_cells vlp-16
}

table shared-memory-latency latency_table
table shared-memory-cost cost_table
table shared-memory-kills kills_table
