#!/usr/bin/env bash
# Changed objects between two days in a town: a table of docs/changes.md.
#
#   bench/merge/changes.sh [SEED...]   11 12 13 14; WRITE_DOCS=1 writes the table there. Half an hour
#
# Routes A and B on two days, 600 scans each, with each LiDAR; half of the parking slots are drawn anew
# every day. Seeds 1 to 3 decided the rules. OUT: folder of runs and results, kept. BIN: programs;
# LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/project.sh
source bench/merge/project.sh

seeds=("$@")
[ $# -gt 0 ] || seeds=(11 12 13 14)
out=${OUT:-build/bench/changes}
unimapper=${BIN:-build/release/bin}/unimapper
export keep_scans=1

# result TRIAL SENSOR SEED: $out/results/TRIAL.json
result() {
  local route
  [ ! -e "$out/results/$1.json" ] || return 0
  mkdir -p "$out/results"
  for route in A B; do
    make_run "$1/$route" --scene town --sensor "$2" --seed "$3" --route "$route" --scans 600
  done
  merged_map "$out/stores/$1" "$out/map" "$out/runs/$1/A" "$out/runs/$1/B"
  "$unimapper" evaluate changes --map "$out/map" --truth A="$out/data/$1/A" B="$out/data/$1/B" \
    >"$out/unfinished.json"
  mv "$out/unfinished.json" "$out/results/$1.json"
  rm -rf "$out/data/$1"/{A,B}/{scans,labels}
}

# figures SENSOR: over the seeds
figures() {
  local seed trials=()
  for seed in "${seeds[@]}"; do
    result "town-$1-$seed" "$1" "$seed"
    trials+=("$out/results/town-$1-$seed.json")
  done
  python3 - "${trials[@]}" <<'PY'
import json, sys
results = [json.load(open(path)) for path in sys.argv[1:]]
def total(key): return sum(result[key] for result in results)
def percent(part, whole): return f"{100 * part / whole:.0f} %" if whole else "-"
changed = total("right") + total("replaced") + total("parts")
wrong = sum(len(result["wrong"]) for result in results)
vehicles, all_vehicles = total("vehicles_found"), total("vehicles_changed")
print(f"{vehicles} of {all_vehicles} ({percent(vehicles, all_vehicles)})", total("found"), total("right"),
      total("replaced"), total("parts"), total("stood"), wrong, percent(changed, changed + wrong), sep=" | ")
PY
}

rows() {
  local sensor
  echo "| seeds ${seeds[*]} | changed vehicles found | objects | changed | replaced | parts of these | stood during one visit | wrong | precision |"
  rule 9
  for sensor in vlp-16 os2-128; do row "$(lidar "$sensor")" 8 figures "$sensor"; done
}

table changed-objects rows
