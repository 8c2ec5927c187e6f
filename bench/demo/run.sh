#!/usr/bin/env bash
# Demonstration: three robots with three LiDARs in one simulated town on three days, merged.
#
# Each robot runs its own onboard process and streams keyframes over LCM; a base stores and merges them
# while they drive (drive.sh), and the page of its store shows them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

scans=400
use_network=1
out=demo
watch=
unimapper=build/release/bin/unimapper
for argument in "$@"; do
  case "$argument" in
    --quick) scans=200 ;;
    --no-network) use_network= ;;
    --watch) watch=1 ;;
    --out=*) out=${argument#--out=} ;;
    *) cat >&2 <<'TXT'
usage: ./dev demo [--quick] [--no-network] [--watch] [--out=DIR]

  --quick       200 scans instead of 400 (half a minute once built)
  --no-network  hand keyframes over as event logs instead of live LCM
  --watch       serve the page after the end, too, until it is interrupted
  --out=DIR     where everything goes (default: demo; emptied first)
TXT
       exit 2 ;;
  esac
done

# LCM is UDP multicast. It gets a network of its own (loopback only), so that nothing of it ever
# reaches the user's network; no browser sees anything of that, so the page has its server outside of it.
inside='ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
namespace=(unshare --net)
[ "$(id -u)" = 0 ] || namespace=(unshare --user --map-root-user --net)
if [ -n "$use_network" ] && ! "${namespace[@]}" sh -c "$inside" sh true 2>/dev/null; then
  cat >&2 <<'TXT'
error: this machine does not let the demo make its own network namespace, and LCM's multicast
does not belong on your network. Run it as root, or allow unprivileged user namespaces, or use
  ./dev demo --no-network
TXT
  exit 1
fi

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

# shellcheck source=bench/demo/processes.sh
source bench/demo/processes.sh

truths=()
for i in 0 1 2; do
  say "simulating robot ${names[i]}: ${sensors[i]}, route ${routes[i]}, $scans scans"
  "$unimapper" simulate --scene town --sensor "${sensors[i]}" --route "${routes[i]}" \
    --scans "$scans" --seed 7 --out "$out/data/${names[i]}"
  truths+=("${names[i]}=$out/data/${names[i]}")
done

runs=()
for name in "${names[@]}"; do runs+=("$out/runs/$name"); done
if [ -n "$use_network" ]; then
  "$unimapper" view "$out/store" --read-only --http 127.0.0.1:0 >"$out/view.out" 2>"$out/view.log" &
  page=$!
  pids+=("$page")
  until grep -qs 'the map is at' "$out/view.out"; do
    kill -0 "$page" 2>/dev/null || {
      echo "error: the page has no server:" >&2
      cat "$out/view.log" >&2
      exit 1
    }
    sleep 0.05
  done
  say "robots drive and a base merges what they stream over LCM: watch at $(sed 's/.* at //' "$out/view.out")"
  "${namespace[@]}" sh -c "$inside" sh bench/demo/drive.sh "$unimapper" "$out" "${names[@]}" &
  drive=$!
  pids+=("$drive")
  wait "$drive"
  say "writing the map"
  "$unimapper" map export --store "$out/store" --out "$out/map" --truth "${truths[@]}" --stats "${runs[@]}"
else
  say "three robots drive"
  for name in "${names[@]}"; do
    "$unimapper" onboard "$out/data/$name" --out "$out/runs/$name" 2>"$out/$name.log"
  done
  say "merging"
  "$unimapper" merge "${runs[@]}" --out "$out/map" --truth "${truths[@]}"
fi

say "evaluating"
named_runs=()
for name in "${names[@]}"; do named_runs+=("$name=$out/runs/$name"); done
"$unimapper" evaluate view --map "$out/map" --truth "${truths[@]}" --run "${named_runs[@]}" \
  >"$out/evaluation.json"

say "done"
cat <<TXT

  report        $out/map/report.html
  map           $out/map/map.ply
  trajectories  $out/map/trajectories/*.tum
  pose graph    $out/map/graph.g2o
TXT
[ -n "$watch" ] || exit 0
if [ -n "$use_network" ]; then
  say "$(cat "$out/view.out")"
  wait "$page"
else
  trap - EXIT INT TERM
  exec "$unimapper" view "$out/map"
fi
