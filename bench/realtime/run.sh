#!/usr/bin/env bash
# Real-time benchmark: one robot at the rate of its LiDAR, with a base on the same processors.
#
# Onboard pipeline, LCM publisher and a base that stores share two processors. Reports how many
# keyframes were late, that is, not finished when the next scan arrived. The keyframes of the warm-up
# (the length of the window and one) are among them.
#
#   bench/realtime/run.sh [MINUTES | DATASET] [SENSOR] [ONBOARD ARGS]
#                                           a simulated drive (1 minute) or a recording; --deferred
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

dataset=${1:-1}
sensor=${2:-os2-128}
onboard_args=("${@:3}")
# LCM is UDP multicast: it gets a network of its own, loopback only.
if [ -z "${UNIMAPPER_BENCH_NAMESPACE:-}" ]; then
  export UNIMAPPER_BENCH_NAMESPACE=1
  inside='ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
  namespace=(unshare --net)
  [ "$(id -u)" = 0 ] || namespace=(unshare --user --map-root-user --net)
  exec "${namespace[@]}" sh -c "$inside" sh "$0" "$@"
fi

unimapper=${UNIMAPPER:-build/release/bin/unimapper}
out=build/bench/realtime
url='udpm://239.255.76.67:7667?ttl=0'
two_processors=()
[ "$(nproc)" -le 2 ] || two_processors=(taskset --cpu-list "0,1")

rm -rf "$out"
mkdir -p "$out"
case "$dataset" in
  *[!0-9]*) [ -d "$dataset" ] || { echo "error: there is no recording $dataset" >&2; exit 2; } ;;
  *)
    minutes=$dataset
    dataset=$out/data
    echo "simulating $minutes min of driving with the $sensor (about 1 GB a minute for the densest)" >&2
    "$unimapper" simulate --scene town --sensor "$sensor" --route A --scans $((minutes * 600)) \
      --seed 5 --out "$dataset" 2>"$out/simulate.log"
    ;;
esac

"${two_processors[@]}" "$unimapper" base --store "$out/store" --listen "$url" --sessions 1 \
  >"$out/base.log" 2>&1 &
base=$!
until grep -qs 'listening on' "$out/base.log"; do
  kill -0 "$base" 2>/dev/null || { cat "$out/base.log" >&2; exit 1; }
  sleep 0.05
done
if ! "${two_processors[@]}" "$unimapper" onboard "$dataset" --sensor "$sensor" --realtime \
    --publish "$url" --out "$out/run" "${onboard_args[@]}" 2>"$out/onboard.log"; then
  cat "$out/onboard.log" >&2
  kill "$base"
  exit 1
fi
wait "$base" || { cat "$out/base.log" >&2; exit 1; }
"$unimapper" merge "$out/store" --out "$out/map" >"$out/merge.log" 2>&1 ||
  { cat "$out/merge.log" >&2; exit 1; }

# The number behind a key of stats.json, and a stage's p50 / p99 / max.
number() { grep -m1 "\"$1\":" "$out/run/stats.json" | grep -oE '[0-9.]+' | tail -1; }
warm_up() {
  "$unimapper" onboard "$dataset" --sensor "$sensor" --dump-config |
    sed -nE 's/.*"window": ([0-9]+).*/\1/p' | awk '{ print $1 + 1 }'
}
times() { sed -n "/\"$1\": {/,/}/p" "$out/run/stats.json" | grep -oE ': [0-9.]+' |
  awk '{printf "%s%.1f", (NR > 1 ? " / " : ""), $2}'; }
cat <<TXT

| $sensor${onboard_args[*]:+, ${onboard_args[*]}}: $(number scans) scans at the pace of their stamps, with a base | |
|---|---|
| keyframes | $(number keyframes), $(warm_up) of them warm-up |
| late (not finished when the next scan arrived) | $(number keyframes_late) |
| the call that makes a keyframe ready, p50 / p99 / max ms | $(times closing_call_ms) |
| all calls of a keyframe, p50 / p99 / max ms | $(times total) |
| copy of a keyframe for the encoding thread, p50 / p99 / max ms | $(times hand_over_ms) |
| keyframes not published | $(number keyframes_not_published) |
| allocations after start | $(number allocations_after_start) |
TXT
rm -rf "$out/data/scans"  # of a simulated drive
