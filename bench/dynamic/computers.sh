#!/usr/bin/env bash
# Benchmark of labels with the presets of smaller computers, whose cells and ranges are fewer.
#
# Writes a table of docs/results.md. About two minutes on two processors; needs
# `./dev build unimapper`.
#
#   bench/dynamic/computers.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/computers
unimapper=${UNIMAPPER:-${BIN:-build/release/bin}/unimapper}

simulate() {  # simulate SEED SCANS
  only_layout && return
  "$unimapper" simulate --scene town --sensor os2-128 --seed "$1" --scans "$2" \
    --out "$out/data/$1" 2>/dev/null
}

cells() {  # cells PRESET
  local seed score separator=
  for seed in 11 3; do
    score="$out/$1-$seed.json"
    "$unimapper" onboard "$out/data/$seed" --out "$out/run" --replace --preset "$1" 2>"$out/log.txt"
    "$unimapper" evaluate dynamic --truth "$out/data/$seed" --run "$out/run" >"$score" 2>/dev/null
    printf '%s%.2f / %.2f / %.2f' "$separator" "$(number "$score" SA)" "$(number "$score" DA)" \
      "$(number "$score" AA)"
    separator=" | "
  done
}

computers_table() {
  local preset
  echo "| SA / DA / AA % | OS2-128, town, seed 11, 120 scans | seed 3, 300 scans |"
  rule 3
  for preset in default raspberry-pi armv7-64mb; do row "\`$preset\`" 2 cells "$preset"; done
}

if ! only_layout; then
  rm -rf "$out"
  mkdir -p "$out/data"
fi
simulate 11 120
simulate 3 300
table cell-computers computers_table
only_layout || rm -rf "$out/data"
