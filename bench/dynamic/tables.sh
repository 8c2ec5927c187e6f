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

# Prints a table and, with WRITE_DOCS=1, puts it into docs/results.md.
table() { echo && bench/tables/table.sh "$@"; }

# means FILE...: SA / DA moving / AA moving, and behind a bar DA / AA, means of the files' figures
means() {
  local file
  for file in "$@"; do
    echo "$(number "$file" SA) $(number "$file" DA) $(moving "$file")"
  done | awk '
    { sa += $1; da += $2; aa += sqrt($1 * $2); moving += $3; both += sqrt($1 * $3) }
    END { printf "%.2f / %.2f / %.2f|%.2f / %.2f\n",
          sa / NR, moving / NR, both / NR, da / NR, aa / NR }'
}

# scene_table SCENE DRIFT: a row per LiDAR, a column per stage at which points are labelled
scene_table() {
  local sensor labels row
  echo "| $1: SA / DA moving / AA moving % | online | final | refined | online, all dynamic: DA / AA |"
  echo "|---|---|---|---|---|"
  for sensor in $sensors; do
    row="| $sensor |"
    for labels in default final refined; do
      row="$row $(means "$out/$sensor-$1-$2"-*."$labels".json | cut -d'|' -f1) |"
    done
    echo "$row $(means "$out/$sensor-$1-$2"-*.default.json | cut -d'|' -f2) |"
  done
}

# recording_table: labelled points of the recording, where nothing stands for long
recording_table() {
  local labels row="| default |"
  echo "| KITTI raw 0005, labelled points: SA / DA / AA % | online | final | refined |"
  echo "|---|---|---|---|"
  for labels in default final refined; do row="$row $(accuracy "$out/kitti.$labels.json") |"; done
  echo "$row"
  [ ! -e "$out/kitti.paper.json" ] || echo "| paper | $(accuracy "$out/kitti.paper.json") | | |"
}
accuracy() { printf '%.2f / %.2f / %.2f' "$(number "$1" SA)" "$(number "$1" DA)" "$(number "$1" AA)"; }

# rules_table: a row per variant
rules_table() {
  local variant files recording
  echo "| one thing changed: SA / DA / AA %, moving | $first_drive, all LiDARs | KITTI raw 0005 | removal, us a keyframe |"
  echo "|---|---|---|---|"
  for variant in "${variants[@]}"; do
    files=("$out"/*-"$first_drive"-[0-9]*."$variant".json)
    recording=
    [ ! -e "$out/kitti.$variant.json" ] || recording=$(accuracy "$out/kitti.$variant.json")
    echo "| $variant | $(means "${files[@]}" | cut -d'|' -f1) | $recording | $(removal_us "${files[@]}") |"
  done
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

# removal_us FILE...: median time of removal of a keyframe, mean of the drives
removal_us() {
  local file
  for file in "$@"; do removal_ms "${file%.json}.stats"; done |
    awk '{ us += 1000 * $1 } END { printf "%.0f", us / NR }'
}

# breakdown class|range: a row per LiDAR and one for all, the points of their drives together
breakdown() {
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
  echo "| SA / DA / AA %, first $octomap_scans scans (recording: all) | per point | benchmark | ms per scan | peak MB |"
  echo "|---|---|---|---|---|"
  for cost in "$out"/*.octomap.cost; do
    name=$(basename "$cost" .octomap.cost)
    comparison_row "$name" "$out/$name.beside.json" "– | –"
    comparison_row "$name, OctoMap" "$out/$name.octomap.json" \
      "$(number "$cost" ms_per_scan) | $(number "$cost" peak_mb)"
  done
}
