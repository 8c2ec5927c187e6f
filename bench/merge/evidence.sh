#!/usr/bin/env bash
# Evidence of sensor data on loops and placements: tables of docs/design/loop-acceptance.md.
#
#   bench/merge/evidence.sh [SEEDS]   "2 4", on which the limits were chosen; WRITE_DOCS=1 writes the
#                                     tables there. Half an hour
#
# Simulated drives A and B of a seed, whose parked cars and actors differ: every verified inter-session
# loop between them, right in all scenes but the tunnel. Then the votes of neighbours, of seeds 3 and 5
# and of the pair that was refused (../shared/data/refused_pair, where it lies beside the project). OUT:
# folder of runs, kept; BIN: programs; LAYOUT=1 prints the tables without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=${1:-2 4}
out=${OUT:-build/bench/evidence}
bin=${BIN:-build/release/bin}
unimapper=$bin/unimapper

# cells SCENE SENSOR: over the seeds
cells() {
  local seed route
  for seed in $seeds; do
    for route in A B; do
      make_run "$1-$2-$seed/$route" --scene "$1" --sensor "$2" --route "$route" --seed "$seed" \
        --scans 400
    done
    "$bin/merge_evidence_bench" "$out/runs/$1-$2-$seed/A/keyframes.lcmlog" \
      "$out/runs/$1-$2-$seed/B/keyframes.lcmlog"
  done | awk '
    function low(a, b) { return NR == 1 || b < a ? b : a }
    function high(a, b) { return NR == 1 || b > a ? b : a }
    {
      loops += $1; c0 = low(c0, $2); c1 = low(c1, $3); c2 = high(c2, $3); c3 = high(c3, $4)
      r1 = low(r1, $6); r2 = high(r2, $6); k0 = low(k0, $8); k1 = high(k1, $10)
      slipped += $11; rest = high(rest, $12); s1 = high(s1, $14); s2 = high(s2, $15)
    }
    END {
      printf "%d | %.2f to %.2f (%.2f to %.2f) | %.2f to %.2f | %.3f to %.2f | %d (%.2f) | %.2f (%.2f)",
        loops, c0, c3, c1, c2, r1, r2, k0, k1, slipped, rest, s2, s1
    }'
}

rows() {
  local pair
  echo "| seeds $seeds | loops | structure in free space (medians) | roofed share, medians | condition number | slipped (others up to, m) | share elsewhere (median) |"
  rule 7
  for pair in "town vlp-16" "town os2-128" "town livox-avia" "campus vlp-16" "hall vlp-16" \
    "deck vlp-16" "tunnel vlp-16"; do
    # shellcheck disable=SC2086
    row "${pair% *}, $(lidar "${pair#* }")" 6 cells $pair
  done
}

# votes LOG LOG...: pairs of logs; counts where loops put the query | at wrong placements | let through
votes() {
  while [ $# -gt 0 ]; do
    "$bin/merge_evidence_bench" --votes "$1" "$2"
    shift 2
  done | awk '{ for (i = 1; i <= 8; ++i) n[i] += $i }
    END { printf "%d / %d / %d | %d / %d / %d | %d of %d", n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8] }'
}

# votes_of SCENE SENSOR-OF-A SENSOR-OF-B
votes_of() {
  local seed logs=()
  for seed in 3 5; do
    make_run "short/$1-$2-$seed/A" --scene "$1" --sensor "$2" --route A --seed "$seed" --scans 300
    make_run "short/$1-$3-$seed/B" --scene "$1" --sensor "$3" --route B --seed "$seed" --scans 300
    logs+=("$out/runs/short/$1-$2-$seed/A/keyframes.lcmlog" "$out/runs/short/$1-$3-$seed/B/keyframes.lcmlog")
  done
  votes "${logs[@]}"
}

vote_rows() {
  local scene a b refused=../shared/data/refused_pair
  echo "| seeds 3 5 | agree / differ / no vote | the same at ten wrong placements a pair | of these let through |"
  rule 4
  while read -r scene a b; do
    row "$scene, $(lidar "$a") and $(lidar "$b")" 3 votes_of "$scene" "$a" "$b"
  done <<'TXT'
town os2-128 livox-avia
campus livox-avia os2-128
courtyard vlp-16 vlp-16
hall vlp-16 livox-mid-360
decks vlp-16 vlp-16
TXT
  if only_layout || [ -d "$refused" ]; then
    row "the pair that was refused, OS2-128 and Livox Avia" 3 votes "$refused/os2-128.lcmlog" "$refused/avia.lcmlog"
  fi
}

table acceptance-evidence rows
table acceptance-votes vote_rows
