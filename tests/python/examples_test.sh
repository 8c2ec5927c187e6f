#!/usr/bin/env bash
# Test of the Python examples on two short drives: examples_test.sh PYTHON EXAMPLES TOOL
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for route in A B; do
  "$3" simulate --scene campus --sensor vlp-16 --scans 100 --thin 2 --route "$route" \
    --out "$folder/$route" 2>/dev/null
done
"$1" "$2/map_a_drive.py" "$folder/A" vlp-16 "$folder/map.png" | grep "dynamic ones"
"$1" "$2/odometry.py" "$folder/A" "$folder/odometry.png" | grep "^ATE 0.0"
"$1" "$2/merge_sessions.py" vlp-16 "$folder/merge.png" "$folder/A" "$folder/B" | grep "^B merged"
for picture in map odometry merge; do
  [ "$(head -c 4 "$folder/$picture.png" | tail -c 3)" = PNG ]
done
[ $# -lt 4 ] || cp "$folder"/*.png "$4"
