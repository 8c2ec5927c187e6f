#!/usr/bin/env bash
# Processor time of the alignment of many sessions: a table of docs/results.md.
#
#   bench/merge/alignment.sh [SEED]   2; WRITE_DOCS=1 writes the table there. Half a minute
#
# Synthetic drives of 500 keyframes, 5 m apart, in districts of one city that overlap by half, with a
# dozen loops for each pair that meets and a tenth more of wrong ones; a pair that is shifted has loops
# that agree with each other, and no sensor data say that they are wrong. BIN: programs; LAYOUT=1 prints
# the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

seed=${1:-2}
bin=${BIN:-build/release/bin}

# cells SESSIONS SHAPE [ARGS]
cells() {
  "$bin/merge_alignment_bench" --seed "$seed" --sessions "$1" --shape "$2" "${@:3}"
}

rows() {
  echo "| seed $seed | sessions | loops | processor s | connected | ATE rmse, m | right loops accepted, % | wrong ones |"
  rule 8
  row "districts in a grid" 7 cells 10 grid
  row "in a grid" 7 cells 25 grid
  row "in a grid" 7 cells 50 grid
  row "in a grid" 7 cells 200 grid
  row "in a grid, thrice the drift" 7 cells 10 grid --drift 3
  row "the same, and alignment knows it" 7 cells 10 grid --drift 3 --assumed-drift 3
  row "a third of the pairs shifted by 10 m" 7 cells 10 grid --shifted 0.3
  row "the same, thrice the drift" 7 cells 10 grid --shifted 0.3 --drift 3
  row "in a chain" 7 cells 25 chain
  row "two groups that do not meet" 7 cells 20 groups
  row "all in one district" 7 cells 20 star
}

table alignment-scale rows
