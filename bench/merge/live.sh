#!/usr/bin/env bash
# Delay of a base that merges while robots drive: a table of docs/base.md.
#
#   bench/merge/live.sh [SEED...]   7; WRITE_DOCS=1 writes the table there. Two minutes a row
#
# Three robots (routes A to C) drive through one simulated scene at the pace of their stamps, in a network
# namespace of its own. The base says how long a keyframe took at most from its commit to the end of the
# merge that it takes part in. Ends with 77 where making a namespace is not allowed. OUT: folder of
# runs, kept; BIN: programs; SCANS: of each robot; LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
enter_namespace n "$@"

seeds=("$@")
[ $# -gt 0 ] || seeds=(7)
scans=${SCANS:-600}
out=${OUT:-build/bench/live}
unimapper=${BIN:-build/release/bin}/unimapper
url='udpm://239.255.76.67:7667?ttl=0'

# robots SCENE SENSOR SEED: cells "localised | merges | longest, s | delay, s"
robots() (
  trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
  local route base drive folder=$out/$1-$2-$3 drives=()
  mkdir -p "$folder"
  for route in A B C; do
    [ -e "$folder/$route/dataset.json" ] || "$unimapper" simulate --scene "$1" --sensor "$2" \
      --seed "$3" --route "$route" --scans "$scans" --out "$folder/$route" >/dev/null 2>&1
  done
  rm -rf "$folder/store" "$folder/runs"
  "$unimapper" base --store "$folder/store" --listen "$url" --merge --sessions 3 \
    >"$folder/base.out" 2>"$folder/base.err" &
  base=$!
  until grep -qs listening "$folder/base.err"; do sleep 0.05; done
  for route in A B C; do
    "$unimapper" onboard "$folder/$route" --out "$folder/runs/$route" --realtime --publish "$url" \
      >"$folder/$route.log" 2>&1 &
    drives+=($!)
  done
  for drive in "${drives[@]}"; do wait "$drive"; done
  wait "$base"
  "$unimapper" map check --store "$folder/store" >/dev/null
  local localised
  localised=$(grep -l "in the base's map: localised" "$folder"/[ABC].log | wc -l)
  sed -n "s/.*merged \([0-9]*\) times, \([0-9.]*\) s the longest; .* map \([0-9.]*\) s after.*/$localised of 3 | \1 | \2 | \3/p" \
    "$folder/base.err"
)

rows() {
  local seed
  echo "| three robots, $scans scans each | localised at the end | merges | longest, s | delay of a keyframe at most, s |"
  rule 5
  for seed in "${seeds[@]}"; do
    row "town, VLP-16, seed $seed" 4 robots town vlp-16 "$seed"
    row "town, OS2-128, seed $seed" 4 robots town os2-128 "$seed"
    row "campus, VLP-16, seed $seed" 4 robots campus vlp-16 "$seed"
  done
}

table merge-live rows
