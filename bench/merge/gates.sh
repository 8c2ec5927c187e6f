#!/usr/bin/env bash
# Right and wrong loop candidates at each gate of verification: tables of loop-acceptance.md
#
#   bench/merge/gates.sh [SEEDS]   "3 5", on which no limit was chosen; WRITE_DOCS=1 writes the tables
#                                  there. Half an hour
#
# Inter-session candidates of descriptors between simulated drives A and B of a seed, 300 scans each.
# A candidate is right if the proposed pose is within the limits of the correction of the true one;
# an accepted loop is wrong if it is off by more than 1 m. OUT: folder of runs, kept; BIN: programs;
# LAYOUT=1 prints the tables without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=${1:-3 5}
out=${OUT:-build/bench/gates}
bin=${BIN:-build/release/bin}
unimapper=$bin/unimapper

# What counts as right, and the gates' names.
classify='
  BEGIN { FS = "\t"
    split("tilt before alignment in sigmas|overlap before alignment|alignment did not converge|" \
          "alignment moved it by metres|alignment turned it by radians|tilt in sigmas|rmse in metres|" \
          "overlap|structure in free space", gate, "|")
    for (g in gate) number[gate[g]] = g }
  { split($1, error, " "); right = error[1] <= 4 && error[2] <= 0.25
    first = 0; refusing = 0; only = 0
    for (i = 2; i <= NF; ++i) {
      split($i, part, "=")
      if (part[2] !~ /^refused/) continue
      ++refusing; only = number[part[1]]
      if (!first) first = only } }'

# candidates SCENE SENSOR-OF-A SENSOR-OF-B: of all seeds, a line each
candidates() {
  local seed a b
  for seed in $seeds; do
    a=$1-$2-$seed/A b=$1-$3-$seed/B
    make_run "$a" --scene "$1" --sensor "$2" --route A --seed "$seed" --scans 300
    make_run "$b" --scene "$1" --sensor "$3" --route B --seed "$seed" --scans 300
    "$bin/merge_gates_bench" "$out/runs/$a/keyframes.lcmlog" "$out/data/$a" \
      "$out/runs/$b/keyframes.lcmlog" "$out/data/$b"
  done
}

# cells SCENE SENSOR-OF-A SENSOR-OF-B
cells() {
  candidates "$@" | tee -a "$out/all.tsv" | awk "$classify"'
    !right { ++wrong; off += !refusing && error[3] > 1 }
    right { ++all; if (!refusing) { ++accepted; off += error[3] > 1 } else ++by[first] }
    END { printf "%d | %d", all, accepted
      for (g = 1; g <= 9; ++g) if (g != 5) printf " | %d", by[g] + (g == 4 ? by[5] : 0)
      printf " | %d | %d", wrong, off }'
}

pairs='town os2-128 livox-avia
town livox-avia os2-128
town vlp-16 livox-mid-360
campus livox-avia os2-128
campus aeva-aeries2 os1-64
courtyard vlp-16 vlp-16
hall vlp-16 livox-mid-360
decks vlp-16 vlp-16
corridor vlp-16 vlp-16'

rows() {
  local scene a b
  echo "| seeds $seeds | right | accepted | refused by tilt before | overlap before | convergence | correction | tilt | residual | overlap | free space | wrong | accepted, off by more than 1 m |"
  rule 13
  while read -r scene a b; do
    row "$scene, $(lidar "$a") and $(lidar "$b")" 12 cells "$scene" "$a" "$b"
  done <<<"$pairs"
}

# of_gate NUMBER: right and wrong candidates that it alone refuses, of all pairs
of_gate() {
  awk -v which="$1" "$classify"'
    refusing == 1 && only == which { if (right) ++r; else ++w } END { printf "%d | %d", r, w }' "$out/all.tsv"
}

gate_rows() {
  local name number=0
  echo "| refused by this gate and by no other | right | wrong |"
  rule 3
  for name in "tilt before" "overlap before" convergence "moved too far" "turned too far" tilt residual \
    overlap "free space"; do
    number=$((number + 1))
    row "$name" 2 of_gate "$number"
  done
}

# at_limit LIMIT: of the candidates that pass all other gates, right and wrong ones seen through by more
at_limit() {
  awk -v limit="$1" "$classify"'
    { split($NF, part, " "); share = part[length(part)]
      if (refusing > (first == 9)) next
      if (right) { ++all; kept += share <= limit } else { ++others; passed += share <= limit } }
    END { printf "%d of %d | %d of %d", all - kept, all, passed, others }' "$out/all.tsv"
}

limit_rows() {
  local limit
  echo "| limit of structure in free space | right candidates that it refuses | wrong ones that it lets pass |"
  rule 3
  for limit in 0.1 0.2 0.3 0.4 0.5 0.6; do row "$limit" 2 at_limit "$limit"; done
}

only_layout || { mkdir -p "$out"; rm -f "$out/all.tsv"; }
table gates-pairs rows
table gates-alone gate_rows
table gates-free-space limit_rows
