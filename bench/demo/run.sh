#!/usr/bin/env bash
# Demonstration: three robots with three LiDARs in one simulated town on three days, merged.
#
# Each robot runs its own onboard process and streams keyframes over LCM; one merger process listens
# and makes one map.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

scans=400
use_network=1
out=demo
for argument in "$@"; do
  case "$argument" in
    --quick) scans=200 ;;
    --no-network) use_network= ;;
    --out=*) out=${argument#--out=} ;;
    *) cat >&2 <<'TXT'
usage: ./dev demo [--quick] [--no-network] [--out=DIR]

  --quick       200 scans instead of 400 (half a minute once built)
  --no-network  hand keyframes over as event logs instead of live LCM
  --out=DIR     where everything goes (default: demo; emptied first)
TXT
       exit 2 ;;
  esac
done

# LCM is UDP multicast. It gets a network of its own (loopback only), so that nothing of it ever
# reaches the user's network.
if [ -n "$use_network" ] && [ -z "${UNIMAPPER_DEMO_NAMESPACE:-}" ]; then
  export UNIMAPPER_DEMO_NAMESPACE=1
  inside='ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
  namespace=(unshare --net)
  [ "$(id -u)" = 0 ] || namespace=(unshare --user --map-root-user --net)
  if ! "${namespace[@]}" sh -c "$inside" sh true 2>/dev/null; then
    cat >&2 <<'TXT'
error: this machine does not let the demo make its own network namespace, and LCM's multicast
does not belong on your network. Run it as root, or allow unprivileged user namespaces, or use
  ./dev demo --no-network
TXT
    exit 1
  fi
  exec "${namespace[@]}" sh -c "$inside" sh "$0" "$@"
fi

unimapper=build/release/bin/unimapper
url='udpm://239.255.76.67:7667?ttl=0'
names=(ouster avia velodyne)
sensors=(os2-128 livox-avia vlp-16)
routes=(A B C)
# What an earlier demo left; nothing else may be deleted, whatever --out says.
if [ -e "$out" ] && [ ! -e "$out/.unimapper-demo" ]; then
  echo "error: $out exists and is not a demo's output; choose another --out" >&2
  exit 1
fi
rm -rf "$out"
mkdir -p "$out"
: >"$out/.unimapper-demo"

say() { printf '\033[1m==> [%3ds] %s\033[0m\n' "$SECONDS" "$*" >&2; }

truths=()
for i in 0 1 2; do
  say "simulating robot ${names[i]}: ${sensors[i]}, route ${routes[i]}, $scans scans"
  "$unimapper" simulate --scene town --sensor "${sensors[i]}" --route "${routes[i]}" \
    --scans "$scans" --seed 7 --out "$out/data/${names[i]}"
  truths+=("${names[i]}=$out/data/${names[i]}")
done

onboard() {  # onboard INDEX [ARGS]: one robot's process
  local i=$1; shift
  "$unimapper" onboard "$out/data/${names[i]}" --out "$out/runs/${names[i]}" "$@" \
    2>"$out/${names[i]}.log"
}

runs=()
for name in "${names[@]}"; do runs+=("$out/runs/$name"); done
if [ -n "$use_network" ]; then
  say "one merger listens, three robots drive and stream over LCM"
  "$unimapper" merge --listen "$url" --sessions 3 --out "$out/map" \
    --truth "${truths[@]}" --stats "${runs[@]}" &
  merger=$!
  sleep 0.5
  robots=()
  for i in 0 1 2; do onboard "$i" --publish "$url" & robots+=($!); done
  for i in 0 1 2; do
    wait "${robots[i]}" || { echo "error: robot ${names[i]} failed:" >&2; cat "$out/${names[i]}.log" >&2
      kill "$merger"; exit 1; }
  done
  say "all robots arrived; merging"
  wait "$merger"
else
  say "three robots drive"
  for i in 0 1 2; do onboard "$i"; done
  say "merging"
  "$unimapper" merge "${runs[@]}" --out "$out/map" --truth "${truths[@]}"
fi

say "done"
cat <<TXT

  report        $out/map/report.html
  map           $out/map/map.ply
  trajectories  $out/map/trajectories/*.tum
  pose graph    $out/map/graph.g2o
TXT
