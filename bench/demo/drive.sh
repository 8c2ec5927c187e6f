#!/usr/bin/env bash
# Robots of the demonstration and their base, in whatever network it is started in.
#
#   bench/demo/drive.sh UNIMAPPER OUT NAME...   recordings are in OUT/data/NAME
#
# Ends with what became of it once the base has merged all sessions into OUT/store.
set -euo pipefail

unimapper=$1 out=$2
shift 2
names=("$@")
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=bench/demo/processes.sh
source bench/demo/processes.sh

"$unimapper" base --store "$out/store" --listen "$url" --merge --sessions "${#names[@]}" \
  >"$out/base.out" 2> >(tee "$out/base.log" >&2) &
base=$!
pids+=("$base")
until grep -qs listening "$out/base.log"; do
  kill -0 "$base" 2>/dev/null || { echo "error: the base failed" >&2; exit 1; }
  sleep 0.05
done
robots=()
for name in "${names[@]}"; do
  "$unimapper" onboard "$out/data/$name" --out "$out/runs/$name" --publish "$url" 2>"$out/$name.log" &
  robots+=($!)
  pids+=($!)
done
for i in "${!names[@]}"; do
  wait "${robots[i]}" || {
    echo "error: robot ${names[i]} failed:" >&2
    cat "$out/${names[i]}.log" >&2
    exit 1
  }
done
echo "all robots arrived; the base merges with all loops" >&2
wait "$base"
