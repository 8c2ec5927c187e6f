#!/usr/bin/env bash
# Cost of authentication: the table of docs/security.md.
#
#   bench/keys/run.sh     a few seconds
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/keys
bin=build/release/bin

measure() {
  mkdir -p "$out"
  "$bin/bench_keys" 237000 60000 >"$out/os2_60000.txt"
  "$bin/bench_keys" 237000 1300 >"$out/os2_1300.txt"
  "$bin/bench_keys" 81000 1300 >"$out/vlp_1300.txt"
}

# figures FILE: the four figures and their sums at either end
figures() {
  awk '{ figure[NR] = $NF }
    END { printf "%.2f | %.2f | %.2f | %.2f | %.2f | %.2f\n", figure[1], figure[2],
          figure[1] + figure[2], figure[3], figure[4], figure[3] + figure[4] }' "$out/$1"
}

keys_table() {
  echo "| processor time per keyframe, ms | signature | codes | robot together | codes | signature | base together |"
  rule 7
  row "OS2-128, 237 kB in datagrams of 60,000 B" 6 figures os2_60000.txt
  row "OS2-128, 237 kB in datagrams of 1,300 B" 6 figures os2_1300.txt
  row "VLP-16, 81 kB in datagrams of 1,300 B" 6 figures vlp_1300.txt
}

only_layout || measure
table keys-cost keys_table
