#!/usr/bin/env bash
# What dynamic object removal keeps and removes: every LiDAR in simulated towns of several seeds,
# and the labelled recording where it lies in ../shared/data; for the default, for variants that
# leave one rule out, and for the paper taken literally. Prints Markdown tables; about ten minutes.
#
#   bench/dynamic/run.sh [SEEDS] [SCANS]     e.g. "21 22 23" 200
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

seeds=${1:-21 22 23}
scans=${2:-200}
unimapper=${UNIMAPPER:-build/release/bin/unimapper}
out=build/bench/dynamic
sensors="os2-128 os1-64 hdl-64e vlp-16 aeva-aeries2 livox-avia livox-mid-360"
mkdir -p "$out"

# Every variant is the default with one thing changed.
variants=(default paper no-carrying floating-ground sure-everywhere no-components no-persistence other-keyframes-only)
config_of() {
  case "$1" in
    no-carrying) echo '{"removal": {"most_carried_log_odds": 0}}' ;;
    floating-ground) echo '{"ground": {"floating_step_m": 0}}' ;;
    sure-everywhere) echo '{"free_space": {"sure_range_m": 0}}' ;;
    no-components) echo '{"removal": {"components": false}}' ;;
    no-persistence) echo '{"removal": {"persistence_share": 0}}' ;;
    other-keyframes-only) echo '{"free_space": {"own_keyframe": false}}' ;;
    *) echo '{}' ;;
  esac
}

# The first number behind a key of a JSON file.
number() { grep -m1 "\"$2\"" "$1" | grep -oE -- '-?[0-9.]+(e-?[0-9]+)?' | tail -1; }

# score NAME DATASET VARIANT: writes OUT/NAME.VARIANT.json
score() {
  local run="$out/runs/$1.$3" preset=default
  [ "$3" != paper ] || preset=paper
  config_of "$3" >"$out/$1.$3.config"
  "$unimapper" onboard "$2" --out "$run" --preset "$preset" --config "$out/$1.$3.config" 2>"$out/$1.$3.log"
  "$unimapper" evaluate dynamic --truth "$2" --run "$run" >"$out/$1.$3.json" 2>/dev/null
  rm -rf "$run"
}

# DA of the objects that moved while they were seen.
moving() { sed -n '/"moving": {/,/}/p' "$1" | grep -oE '"DA": [0-9.]+' | grep -oE '[0-9.]+'; }

# row LABEL FILE...: the mean of the files' figures
row() {
  local label=$1
  shift
  for file in "$@"; do
    echo "$(number "$file" SA) $(number "$file" DA) $(moving "$file")"
  done | awk -v label="$label" '
    { sa += $1; da += $2; aa += sqrt($1 * $2); moving += $3; both += sqrt($1 * $3) }
    END { printf "| %s | %.2f | %.2f | %.2f | %.2f | %.2f |\n",
          label, sa / NR, da / NR, aa / NR, moving / NR, both / NR }'
}

recording=../shared/data
real=
if [ -e "$recording/unpack.sh" ]; then
  real=$(sh "$recording/unpack.sh" build/bench/recordings)/kitti_0005a
else
  echo "The real recordings are not beside the project; their rows are left out." >&2
fi

for sensor in $sensors; do
  for seed in $seeds; do
    data="$out/data/$sensor-$seed"
    rm -rf "$data"
    "$unimapper" simulate --scene town --sensor "$sensor" --route A --scans "$scans" --seed "$seed" \
      --out "$data" 2>/dev/null
    for variant in "${variants[@]}"; do score "$sensor-$seed" "$data" "$variant"; done
    rm -rf "$data/scans"
  done
done
[ -z "$real" ] || for variant in "${variants[@]}"; do score kitti "$real" "$variant"; done

echo "| default, seeds $seeds, $scans scans each: mean | SA % | DA % | AA % | DA moving % | AA moving % |"
echo "|---|---|---|---|---|---|"
for sensor in $sensors; do row "$sensor" "$out/$sensor"-[0-9]*.default.json; done
[ -z "$real" ] || row "KITTI raw 0005" "$out/kitti.default.json"
echo
echo "| variant, mean of all simulated drives | SA % | DA % | AA % | DA moving % | AA moving % |"
echo "|---|---|---|---|---|---|"
for variant in "${variants[@]}"; do row "$variant" "$out"/*-[0-9]*."$variant".json; done
if [ -n "$real" ]; then
  echo
  echo "| variant, KITTI raw 0005 | SA % | DA % | AA % | DA moving % | AA moving % |"
  echo "|---|---|---|---|---|---|"
  for variant in "${variants[@]}"; do row "$variant" "$out/kitti.$variant.json"; done
fi
