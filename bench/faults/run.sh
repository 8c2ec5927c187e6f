#!/usr/bin/env bash
# Delivery from robots to the base under faults: the table of docs/results.md.
#
#   bench/faults/run.sh [ROW...]   rows by the names in rows.sh, all by default (six minutes)
#
# Real processes on multicast in a network namespace of their own, where a relay between the robots'
# group and the base's loses, holds, repeats and damages datagrams as a seed says. Ends with 77 where
# making a namespace is not allowed.
#
#   BIN, OUT    folders of programs and of output
#   SEED        of relay and keyframes
#   KEYFRAMES   of each robot, where a row does not say otherwise
#   FULL=1      outages, kills and counts at their full length (an hour)
#   CHECK=1     ends with 1 if a keyframe was lost, duplicated or falsely reported
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/faults/rows.sh
source bench/faults/rows.sh
# shellcheck source=bench/faults/processes.sh
source bench/faults/processes.sh

bin=${BIN:-build/release/bin}
out=${OUT:-build/bench/faults}
seed=${SEED:-1}
row_names=${*:-$(rows | cut -d'|' -f1)}
longest=100
[ -z "${FULL:-}" ] || longest=1500

# row_cells ROW: the cells of a row. In a shell of its own: what it started ends with it.
row_cells() {
  local command
  row=$out/$1
  rm -rf "$row"
  mkdir -p "$row"
  robots_url="udpm://$robots_group?ttl=0"
  base_url=$robots_url
  receive_buffer=
  disk=
  keys=
  bases=0
  robots=()
  store=$row/store
  command=$(row_field "$1" 3)
  $command
  end_row
  bench/faults/outcome.py "$store" "$(peak base) / $(peak robot)$base_fell" "${robots[@]}"
  [ -z "$disk" ] || umount "$disk"
}

# row_or_error ROW: the cells of a row; one that failed is no reason to do without the others
row_or_error() {
  local cells status
  set +e
  cells=$(
    set -e
    row_cells "$1"
  )
  status=$?
  set -e
  if [ $status != 0 ]; then
    touch "$out/failed"
    cells="failed | – | – | – | – | – | –"
  fi
  echo "$(row_field "$1" 2): $cells" >&2
  echo "$cells"
}

faults_table() {
  local name
  echo "| fault | keyframes sent | stored | lost | duplicated | falsely reported | peak of base / robot, MB | time to catch up, s |"
  rule 8
  for name in $row_names; do row "$(row_field "$name" 2)" 7 row_or_error "$name"; done
  [ ! -e "$out/failed" ] || { echo "error: rows failed; the table is not written" >&2; return 1; }
}

check() {
  awk -F' *[|] *' -v rows="$(wc -w <<<"$row_names")" '
    $3 ~ /^[0-9]+$/ { if ($5 $6 $7 != "000") print "not clean: " $2; else ++clean }
    END { exit clean != rows }' "$out/table.md"
}

# Disks of its own too.
enter_namespace nm "$@"
if only_layout; then
  table delivery-faults faults_table
  exit
fi
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -f "$out/failed"
table delivery-faults faults_table | tee "$out/table.md"
[ -z "${CHECK:-}" ] || check
