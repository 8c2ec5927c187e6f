#!/usr/bin/env bash
# Localisation in a stored map: tables of docs/localisation.md.
#
#   bench/merge/localisation.sh [SEEDS]   2; WRITE_DOCS=1 writes the tables there. Half an hour for the first, an hour
#                                         for the second; TABLES: one of `localisation localisation-lidars`
#
# A is the map, alone. B drives on another day through the same place, as C does in a town, on a
# campus and in a hall; in the other scenes C drives through the copy elsewhere, where nothing can be
# right. 300 scans each, seeds 1 to SEEDS. SCENES: others than those below. The second table has every LiDAR in
# town, campus and hall on B and C, seeds 5 and 6. OUT: folder of runs, kept; it may be that of
# bench/merge/aliasing.sh, whose runs have the same names. BIN: programs; LAYOUT=1 prints the tables
# without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/project.sh
source bench/merge/project.sh

seeds=${1:-2}
shared="town-vlp-16 town-os2-128 town-livox-avia campus-vlp-16 hall-vlp-16"
copied="streets-vlp-16 courtyard-vlp-16 corridor-vlp-16 decks-vlp-16 fixtures-vlp-16 bore-vlp-16"
scenes=${SCENES:-$shared $copied}
sensors="os2-128 os1-64 hdl-64e vlp-16 livox-mid-360 aeva-aeries2 livox-avia"
tables=${TABLES:-localisation localisation-lidars}
out=${OUT:-build/bench/localisation}
unimapper=${BIN:-build/release/bin}/unimapper

# map_of TRIAL: a store with the map of route A, and its trajectory
map_of() {
  local store=$out/maps/$1
  [ ! -e "$store.tum" ] || return 0
  merged_map "$store" "$store-map" "$out/runs/$1/A"
  cp "$store-map/trajectories/A.tum" "$store.tum"
}

# located TRIAL ROUTE: a line as of `errors.py localised`, mean and longest time in ms; runs and map are made
located() {
  local route name=${1%-*}
  for route in A "$2"; do
    make_run "$1/$route" --scene "${name%%-*}" --sensor "${name#*-}" --seed "${1##*-}" \
      --route "$route" --scans 300
  done
  map_of "$1"
  "$unimapper" localise "$out/runs/$1/$2" --store "$out/maps/$1" --json --replace \
    --out "$out/run.tum" >"$out/run.json" 2>"$out/run.txt"
  echo "$(bench/merge/errors.py localised "$out/run.json" "$out/maps/$1.tum" "$out/data/$1/A" \
    "$out/run.tum" "$out/data/$1/$2") $(awk '/ ms each, / { print $(NF - 6), $(NF - 3) }' "$out/run.txt")"
}

# cells SCENE-SENSOR ROUTE: over the seeds
cells() {
  local seed
  for seed in $(seq "$seeds"); do located "$1-$seed" "$2"; done | awk '
    { keyframes += $1; localised += $2; ms += $8 * $1; if ($9 > longest) longest = $9 }
    $2 > 0 {
      first = first (first == "" ? "" : " / ") sprintf("%.0f", $3)
      squares += $2 * $4 * $4
      if ($6 > worst) worst = $6
      beyond += $2 * $7
    }
    END {
      printf "%d of %d | ", localised, keyframes
      if (localised == 0) printf "- | - | - | - | "
      else printf "%s | %.2f | %.2f | %d | ", first, sqrt(squares / localised), worst, beyond + 0.5
      printf "%.0f (%.0f)", ms / keyframes, longest
    }'
}

rows() {
  local scene route title
  echo "| seeds 1 to $seeds | localised | first after, m beside the mapped way | rmse, m | worst, m | beyond 3 sigma | ms a keyframe (longest) |"
  rule 7
  for scene in $scenes; do
    for route in B C; do
      title="\`${scene%%-*}\`, $(lidar "${scene#*-}"), $route"
      case " $copied " in *" $scene "*) [ "$route" = B ] || title+=", the copy" ;; esac
      row "$title" 6 cells "$scene" "$route"
    done
  done
}

# lidar_cells SENSOR: runs | within 30 m | of those wrong | later, wrong ones in parentheses | never | worst error
lidar_cells() {
  local scene seed route
  for scene in town campus hall; do
    for seed in 5 6; do
      for route in B C; do located "$scene-$1-$seed" "$route"; done
    done
  done | awk '
    { ++runs; wrong = $6 > 1 }
    $2 == 0 { ++never; next }
    $6 > worst { worst = $6 }
    $3 <= 30 { ++soon; soon_wrong += wrong; next }
    { ++later; later_wrong += wrong }
    END { printf "%d | %d | %d | %d (%d) | %d | %.2f", runs, soon, soon_wrong, later, later_wrong, never, worst }'
}

lidar_rows() {
  local sensor
  echo "| seeds 5 and 6 | runs | first position within 30 m of the mapped way | wrong of these | later (wrong) | never | worst, m |"
  rule 7
  for sensor in $sensors; do row "$(lidar "$sensor")" 6 lidar_cells "$sensor"; done
}

[[ " $tables " != *" localisation "* ]] || table localisation rows
[[ " $tables " != *" localisation-lidars "* ]] || table localisation-lidars lidar_rows
