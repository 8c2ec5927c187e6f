#!/usr/bin/env bash
# Memory, commits and bytes written of the base's store: the table of docs/base.md.
#
#   bench/store/run.sh     two to five minutes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

# store_cells ROBOTS KEYFRAMES CELLS: of a store on the disk of the build
store_cells() {
  local folder=build/bench/store
  rm -rf "$folder"
  build/release/bin/store_bench "$folder" "$@" | tee /dev/stderr | sed -n 's/^cells: //p'
  rm -rf "$folder"
}

store_table() {
  echo "| robots × keyframes | bytes each | commits | memory at the end, MB | largest, MB | bytes written for each byte of a keyframe |"
  rule 6
  row "5 × 36,000 (ten hours), the smallest keyframes" 5 store_cells 5 36000 0
  row "3 × 150, keyframes of 60,000 scattered cells" 5 store_cells 3 150 60000
  row "3 × 150, keyframes of 250,000 scattered cells" 5 store_cells 3 150 250000
}

only_layout || mkdir -p build/bench
table store-cost store_table
