#!/usr/bin/env bash
# Localisation in a stored map: how soon, how exactly, and whether places that look alike fool it.
#
#   bench/merge/localisation.sh [SEEDS]   a line for each scene, seed and route, of the runs that
#                                         bench/merge/aliasing.sh leaves in RUNS
#
# A is the map. B drives through the same place on another day, C through its copy elsewhere, where
# nothing can be right. A line: scene, route, keyframes, then as bench/merge/localisation_error.py.
# SCENES: others than those below. BIN names the folder of programs, OUT that of results.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

seeds=${1:-2}
scenes=${SCENES:-streets courtyard corridor decks fixtures bore}
runs=${RUNS:-build/bench/aliasing}
out=${OUT:-build/bench/localisation}
unimapper=${BIN:-build/release/bin}/unimapper

# map TRIAL: a store with the map of route A, and its trajectory
map() {
  local store=$out/$1
  [ ! -e "$store.tum" ] || return 0
  rm -rf "$store" "$store-map"
  mkdir -p "$out"
  "$unimapper" map create --store "$store" >/dev/null
  "$unimapper" map add --store "$store" "$runs/runs/$1/A" >/dev/null 2>&1
  "$unimapper" map merge --store "$store" >/dev/null 2>&1
  "$unimapper" map export --store "$store" --out "$store-map" >/dev/null 2>&1
  cp "$store-map/trajectories/A.tum" "$store.tum"
}

for seed in $(seq "$seeds"); do
  for scene in $scenes; do
    trial=$scene-vlp-16-$seed
    map "$trial"
    for route in B C; do
      "$unimapper" localise "$runs/runs/$trial/$route" --store "$out/$trial" --json --replace \
        --out "$out/run.tum" >"$out/run.json" 2>/dev/null
      echo "$trial $route $(bench/merge/localisation_error.py "$out/run.json" "$out/$trial.tum" \
        "$runs/data/$trial/A" "$out/run.tum" "$runs/data/$trial/$route")"
    done
  done
done
