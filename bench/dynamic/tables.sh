# Markdown tables of the dynamic removal benchmark; sourced by run.sh, reads the results in $out.
# shellcheck shell=bash disable=SC2154

# The first number behind a key of a JSON file.
number() { grep -m1 "\"$2\"" "$1" | grep -oE -- '-?[0-9.]+(e-?[0-9]+)?' | tail -1; }
# DA of the objects that moved while they were seen.
moving() { sed -n '/"moving": {/,/}/p' "$1" | grep -oE '"DA": [0-9.]+' | grep -oE '[0-9.]+'; }
# SA, DA and AA by the benchmark's protocol.
benchmark() {
  sed -n '/"benchmark": {/,/"HA"/p' "$1" | grep -oE '"(SA|DA|AA)": [0-9.]+' |
    awk '{ printf "%s%.2f", (NR > 1 ? " / " : ""), $2 }'
}

# Median time of removal per keyframe of a run's statistics.
removal_ms() {
  sed -n '/"removal": {/,/}/p' "$1" | grep -m1 -oE '"p50": [0-9.]+' | grep -oE '[0-9.]+$'
}

header() {  # header TITLE
  echo
  echo "| $1 | SA % | DA % | AA % | DA moving % | AA moving % |"
  echo "|---|---|---|---|---|---|"
}

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

# Title of a set of labels.
title() {
  case "$1" in
    default) echo online ;;
    final) echo "final" ;;
    *) echo "refined" ;;
  esac
}

variant_header() {
  echo
  echo "| $1 | SA % | DA % | AA % | DA moving % | AA moving % | removal, us a keyframe |"
  echo "|---|---|---|---|---|---|---|"
}

# variant_row LABEL FILE...: as row, and the median time of removal, mean of the drives
variant_row() {
  local file
  row "$@" | tr -d '\n'
  shift
  for file in "$@"; do removal_ms "${file%.json}.stats"; done |
    awk '{ us += 1000 * $1 } END { printf " %.0f |\n", us / NR }'
}

# breakdown class|range: a row per LiDAR and one for all, the points of their drives together
breakdown() {
  echo
  "$unimapper" evaluate breakdown --by "$1"
  for sensor in $sensors; do
    "$unimapper" evaluate breakdown --by "$1" --label "$sensor" "$out/$sensor"-*.default.json
  done
  "$unimapper" evaluate breakdown --by "$1" --label all "$out"/*-[0-9]*.default.json
}

# comparison_row LABEL FILE COST: accuracy by both protocols, and what a scan took
comparison_row() {
  printf '| %s | %.2f / %.2f / %.2f | %s | %s |\n' "$1" "$(number "$2" SA)" "$(number "$2" DA)" \
    "$(number "$2" AA)" "$(benchmark "$2")" "$3"
}

octomap_table() {
  local cost name
  echo
  echo "| SA / DA / AA %, first $octomap_scans scans (recording: all) | per point | benchmark | ms per scan | peak MB |"
  echo "|---|---|---|---|---|"
  for cost in "$out"/*.octomap.cost; do
    name=$(basename "$cost" .octomap.cost)
    comparison_row "$name" "$out/$name.beside.json" "– | –"
    comparison_row "$name, OctoMap" "$out/$name.octomap.json" \
      "$(number "$cost" ms_per_scan) | $(number "$cost" peak_mb)"
  done
}
