#!/usr/bin/env bash
# Cost of viewers to a base that receives and merges: a table of docs/base.md.
#
#   bench/view/load.sh [VIEWERS...]   0 20, the first of which the others are compared with;
#                                     WRITE_DOCS=1 writes the table there. Three minutes a row
#
# Three robots (routes A to C) drive through one simulated town at the pace of their stamps, the base
# merges and serves its page, and viewers (viewers.py) ask for what the page asks for, all in a network
# namespace of its own. Ends with 77 where making one is not allowed. OUT: folder of runs, kept; BIN:
# programs; SCANS: of each robot; LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
enter_namespace n "$@"

counts=("$@")
[ $# -gt 0 ] || counts=(0 20)
scans=${SCANS:-600}
out=${OUT:-build/bench/view}
unimapper=${BIN:-build/release/bin}/unimapper
url='udpm://239.255.76.67:7667?ttl=0'
http=127.0.0.1:8080

# processor_seconds PID: user and system time of a process of ours at its end, to half a second
processor_seconds() {
  local ticks=0 fields
  while fields=$(cat "/proc/$1/stat" 2>/dev/null); do
    # What follows the name in parentheses, which may hold spaces.
    read -ra fields <<<"${fields##*) }"
    [ "${fields[0]}" != Z ] || break
    ticks=$((fields[11] + fields[12]))
    sleep 0.5
  done
  echo $((ticks / $(getconf CLK_TCK)))
}

# drive VIEWERS: cells "lost | merges | longest, s | delay, s | all loops, s | slower, % | processor, s | failed"
drive() (
  trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
  local route base drive folder=$out/$1 drives=() viewers=
  mkdir -p "$folder"
  for route in A B C; do
    [ -e "$out/data/$route/dataset.json" ] || "$unimapper" simulate --scene town --sensor vlp-16 \
      --seed 7 --route "$route" --scans "$scans" --out "$out/data/$route" >/dev/null 2>&1
  done
  rm -rf "$folder/store" "$folder/runs"
  "$unimapper" base --store "$folder/store" --listen "$url" --merge --http "$http" --sessions 3 \
    >"$folder/base.out" 2>"$folder/base.err" &
  base=$!
  processor_seconds "$base" >"$folder/processor.txt" &
  until grep -qs listening "$folder/base.err"; do sleep 0.05; done
  [ "$1" = 0 ] || { python3 bench/view/viewers.py "$http" "$1" >"$folder/viewers.txt" & viewers=$!; }
  for route in A B C; do
    "$unimapper" onboard "$out/data/$route" --out "$folder/runs/$route" --realtime --publish "$url" \
      >"$folder/$route.log" 2>&1 &
    drives+=($!)
  done
  wait "$base"
  local failed=0 made lost all first
  if [ -n "$viewers" ]; then
    kill "$viewers" && wait "$viewers"
    failed=$(cut -d' ' -f2 "$folder/viewers.txt")
  fi
  # They may wait for a last word of a base that has ended.
  for drive in "${drives[@]}"; do wait "$drive"; done
  sleep 1
  "$unimapper" map check --store "$folder/store" >/dev/null
  made=$(grep -hm1 '"keyframes":' "$folder"/runs/*/stats.json | awk -F'[:,]' '{ sum += $2 } END { print sum }')
  lost=$((made - $(sed -n 's/^unimapper: stored \([0-9]*\) keyframes.*/\1/p' "$folder/base.err")))
  all=$(sed -n 's/.*all loops at the end took \([0-9.]*\) s.*/\1/p' "$folder/base.err")
  echo "$all" >"$folder/all.txt"
  first=$(cat "$out/${counts[0]}/all.txt")
  sed -n "s/.*merged \([0-9]*\) times, \([0-9.]*\) s the longest; .* map \([0-9.]*\) s after.*/$lost of $made | \1 | \2 | \3/p" \
    "$folder/base.err" | tr '\n' ' '
  awk -v all="$all" -v first="$first" -v processor="$(cat "$folder/processor.txt")" -v failed="$failed" \
    'BEGIN { printf "| %.1f | %.0f | %d | %d\n", all, 100 * (all / first - 1), processor, failed }'
)

rows() {
  local count
  echo "| three robots, VLP-16, $scans scans each | keyframes lost | merges | longest, s | delay of a keyframe at most, s | all loops at the end, s | slower, % | the base's processor time, s | requests that failed |"
  rule 9
  for count in "${counts[@]}"; do row "$count viewers" 8 drive "$count"; done
}

table view-load rows
