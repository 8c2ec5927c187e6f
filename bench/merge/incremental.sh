#!/usr/bin/env bash
# Cost of a ninth session in a stored project: a table of docs/results.md.
#
#   bench/merge/incremental.sh [SEEDS]   "3"; WRITE_DOCS=1 writes the table there. Some minutes a seed
#
# Nine drives of 200 scans through one town (VLP-16 with 512 columns, routes A to C on three days).
# OUT: folder of runs, kept; BIN: programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=${1:-3}
out=${OUT:-build/bench/incremental}
unimapper=${BIN:-build/release/bin}/unimapper

# timed NAME COMMAND...: its messages to NAME.txt; prints its processor time, s
timed() {
  local TIMEFORMAT='%U %S'
  { time "${@:2}" >"$out/$1.txt" 2>&1; } 2>&1 | awk '{ printf "%.1f", $1 + $2 }'
}

# loops NAME: verified and known ones of a merge
loops() { awk '/loops verified/ { print $2 " | " $5 }' "$out/$1.txt"; }

# cells NAME: of a merge of a project
cells() { printf '%s | %s' "$(loops "$1")" "${seconds[$1]}"; }

# whole_cells: of `unimapper merge`, which knows nothing
whole_cells() { printf -- '- | - | %s' "${seconds[merge]}"; }

declare -A seconds

# measure SEED: seconds of the ninth session's merge, of that of all nine, and of `unimapper merge`
measure() {
  local route day store
  local runs=()
  for day in 0 1 2; do
    for route in A B C; do
      make_run "$1-$route-$day" --sensor vlp-16 --columns 512 --route "$route" --day "$day" \
        --seed "$1" --scans 200
      runs+=("$out/runs/$1-$route-$day")
    done
  done
  rm -rf "$out/store" "$out/whole"
  for store in store whole; do "$unimapper" map create --store "$out/$store" >/dev/null; done
  "$unimapper" map add --store "$out/store" "${runs[@]:0:8}" >/dev/null 2>&1
  "$unimapper" map merge --store "$out/store" >/dev/null 2>&1
  "$unimapper" map add --store "$out/store" "${runs[8]}" >/dev/null 2>&1
  "$unimapper" map add --store "$out/whole" "${runs[@]}" >/dev/null 2>&1
  seconds[ninth]=$(timed ninth "$unimapper" map merge --store "$out/store")
  seconds[nine]=$(timed nine "$unimapper" map merge --store "$out/whole")
  seconds[merge]=$(timed merge "$unimapper" merge "${runs[@]}" --out "$out/map" --replace)
}

rows() {
  local seed
  echo "| processor time, s | loops verified | known | s |"
  rule 4
  for seed in $seeds; do
    if ! only_layout; then measure "$seed"; fi
    row "seed $seed: ninth added to eight (\`map merge\`)" 3 cells ninth
    row "seed $seed: all nine (\`map merge\`)" 3 cells nine
    row "seed $seed: all nine with labels, map and changes (\`unimapper merge\`)" 3 whole_cells
  done
}

table merge-incremental rows
