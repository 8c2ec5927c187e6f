#!/usr/bin/env bash
# Acceptance of loops that are partly false: three tables of docs/design/loop-acceptance.md.
#
#   bench/merge/acceptance.sh [TRIALS] [SEED]     half a minute; WRITE_DOCS=1 writes the tables there
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

program=${BIN:-build/release/bin}/merge_acceptance_bench
trials=${1:-30}
seed=${2:-1}

# The program's rows, or with LAYOUT=1 the same rows of one trial without their figures.
rows() {
  if only_layout; then
    "$program" "$1" 1 "$seed" | sed "s/ 1 trials/ $trials trials/; s/ wrong of 1 / wrong of $trials /" | awk -F ' [|] ' '
      /^[|] / && NR > 2 { printf "%s", $1; for (i = 2; i <= NF; ++i) printf " | *"; print " |"; next }
      { print }'
  else
    "$program" "$1" "$trials" "$seed"
  fi
}

table acceptance-pairs rows pairs
table acceptance-bores rows bores
table acceptance-laps rows laps
