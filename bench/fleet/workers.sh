#!/usr/bin/env bash
# Merge of one project by different numbers of workers: the table of docs/fleet.md (WRITE_DOCS=1
# writes it there).
#
#   bench/fleet/workers.sh [SCANS [SEED]]   400 7: five minutes
#
# A NATS server on the loopback interface, workers of one thread, a merge of one thread that works
# along. The killed worker ends in the middle (-9). Ends with 1 if a map differs from the one that
# was merged alone. BIN, OUT: folders of programs and of output; LAYOUT=1 prints the table without
# figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh
out=${OUT:-build/bench/fleet_workers}
unimapper=${BIN:-build/release/bin}/unimapper

rows() {
  local route workers
  if ! only_layout; then
    for route in A B C; do
      make_run "town_${2:-7}_${1:-400}_$route" --scene town --sensor vlp-16 --route "$route" \
        --scans "${1:-400}" --seed "${2:-7}"
    done
  fi
  echo "| workers | loops that they verified | processor time of the merge, s | of the workers, s | loops in a second of theirs | of all, against the merge alone | the same map |"
  rule 7
  for workers in 0 1 2 3 "2, one killed"; do
    row "$workers" 6 bench/fleet/workers.py "$unimapper" "$out" "town_${2:-7}_${1:-400}" "$workers"
  done
}

table workers rows "$@"
