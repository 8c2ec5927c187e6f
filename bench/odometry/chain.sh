#!/usr/bin/env bash
# From bags alone to a merged map: table of docs/odometry.md.
#
#   bench/odometry/chain.sh [SCANS]   400; WRITE_DOCS=1 writes the table there
#
# The demonstration's three robots (bench/demo/run.sh), SEED (7), as bags of sweeps in motion. Each is
# mapped without any option: with neither odometry nor transforms in it, the same with an IMU, and with
# the true odometry. OUT: folder of recordings and maps. BIN: programs; LAYOUT=1 prints the table
# without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

scans=${1:-400}
seed=${SEED:-7}
out=${OUT:-build/bench/chain}
bin=${BIN:-build/release/bin}

# mapped NAME OPTION...: errors of three sessions in one map, "OS2-128 | Avia | VLP-16"
mapped() {
  local folder=$out/$1 sensor route truths=() runs=()
  while read -r sensor route; do
    local data=$folder/data/$sensor run=$folder/runs/$sensor
    mkdir -p "$folder/data" "$folder/runs"
    "$bin/unimapper" simulate --scene town --sensor "$sensor" --route "$route" --scans "$scans" \
      --seed "$seed" --drift none --bag mcap "${@:2}" --out "$data" --replace >/dev/null 2>&1
    "$bin/unimapper" onboard "$data/drive.mcap" --out "$run" --replace >/dev/null 2>"$run.log"
    truths+=("$sensor=$data")
    runs+=("$run")
  done <<<"os2-128 A
livox-avia B
vlp-16 C"
  "$bin/unimapper" merge "${runs[@]}" --out "$folder/map" --replace --truth "${truths[@]}" \
    >"$folder/merge.txt"
  awk -F '  +' '
    /^session / { for (i = 1; i <= NF; ++i) if ($i == "ATE rmse m") column = i }
    column && NF >= column { ate[$1] = $column ($3 == "central" ? " (central)" : "") }
    END { printf "%s | %s | %s", ate["os2-128"], ate["livox-avia"], ate["vlp-16"] }' \
    "$folder/merge.txt"
  rm -rf "$folder/data"
}

chain_table() {
  echo "| ATE of sessions in the merged map, m | OS2-128, route A | Livox Avia, route B | VLP-16, route C |"
  rule 4
  row "bags alone" 3 mapped alone --no-odometry
  row "bags with an IMU" 3 mapped imu --no-odometry --imu
  row "bags with true poses" 3 mapped truth
}

table odometry-chain chain_table
