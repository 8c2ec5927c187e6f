#!/usr/bin/env bash
# Perceptual aliasing: how often the merger is fooled by places that look alike.
#
#   bench/merge/aliasing.sh [SEEDS] [FEWER]   30 seeds (from 1 on) of tunnels and decks, 10 of the other
#                                             scenes; a table of docs/results.md, written there with
#                                             WRITE_DOCS=1. Two hours
#
# Of every seed, A and B drive through one place and overlap: they must be merged. C drives through
# its copy elsewhere: with A it must not be. Everything from simulated scans on. FULL=1: with an
# OS2-128 and a Livox Avia, too. REUSE=1: with the runs that are left from an earlier time, for
# another merger (BIN names the folder of programs, OUT that of results). SCENES and SCANS: others
# than all, and than 300 of them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seeds=${1:-30}
fewer=${2:-10}
scenes=${SCENES:-bore fixtures decks streets corridor courtyard quad orchard}
sensors="vlp-16"
[ -z "${FULL:-}" ] || sensors="vlp-16 os2-128 livox-avia"
scans=${SCANS:-300}
out=${OUT:-build/bench/aliasing}
unimapper=${BIN:-build/release/bin}/unimapper

# merge_pair SCENE-SENSOR-SEED ROUTE: A with another; a line "SCENE-SENSOR ROUTE SEED STATUS ERROR"
merge_pair() {
  local trial=$1 other=$2
  "$unimapper" merge "$out/runs/$trial/A" "$out/runs/$trial/$other" --out "$out/map" --replace \
    --allow-unconnected >/dev/null 2>"$out/merge.log"
  echo "${trial%-*} $other ${trial##*-} $(bench/merge/errors.py overlap "$out/map" \
    "A=$out/data/$trial/A" "$other=$out/data/$trial/$other")" >>"$out/trials.txt"
}

# seeds_of SCENE
seeds_of() {
  case "$1" in
    bore | fixtures | decks) echo "$seeds" ;;
    *) echo "$fewer" ;;
  esac
}

trial() {  # trial SCENE SENSOR SEED
  local route
  for route in A B C; do
    make_run "$1-$2-$3/$route" --scene "$1" --sensor "$2" --seed "$3" --route "$route" \
      --scans "$scans"
  done
  merge_pair "$1-$2-$3" B
  merge_pair "$1-$2-$3" C
}

# cells SCENE SENSOR: what became of both pairs, over the seeds
cells() {
  awk -v which="$1-$2" -v seeds="$(seeds_of "$1")" '
    $1 == which && $3 <= seeds {
      if ($4 == "unconnected") what = "apart"
      else if ($4 != "merged") what = "provisional"
      else what = $5 != "none" && $5 <= 1 ? "right" : "wrong"
      ++count[$2, what]
      ++pairs[$2]
    }
    END {
      printf "%d / %d / %d / %d | %.0f | %d / %d / %d", count["B", "right"], count["B", "apart"],
        count["B", "provisional"], count["B", "wrong"], 100 * count["B", "right"] / pairs["B"],
        count["C", "apart"], count["C", "provisional"], count["C", "wrong"] + count["C", "right"]
    }' "$out/trials.txt"
}

rows() {
  local scene sensor
  echo "| scene, LiDAR, seeds from 1 on | overlapping: right / apart / provisional / wrong | recall, % | in the copy: apart / provisional / wrong |"
  rule 4
  for sensor in $sensors; do
    for scene in $scenes; do row "\`$scene\`, $(lidar "$sensor"), $(seeds_of "$scene")" 3 cells "$scene" "$sensor"; done
  done
}

if ! only_layout; then
  [ -n "${REUSE:-}" ] || rm -rf "$out/data" "$out/runs"
  mkdir -p "$out"
  : >"$out/trials.txt"
  for seed in $(seq "$seeds"); do
    for sensor in $sensors; do
      for scene in $scenes; do
        [ "$seed" -gt "$(seeds_of "$scene")" ] || trial "$scene" "$sensor" "$seed"
      done
    done
  done
fi
table merge-aliasing rows
