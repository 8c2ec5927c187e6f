# Markdown tables of the dynamic removal benchmark; sourced by run.sh, reads the results in $out.
# shellcheck shell=bash disable=SC2154

# DA of the objects that moved while they were seen, of the file's outermost object.
moving() { sed -n '/^  "moving": {/,/}/p' "$1" | grep -oE '"DA": [0-9.]+' | grep -oE '[0-9.]+'; }
# SA, DA and AA by the benchmark's protocol.
benchmark() {
  sed -n '/"benchmark": {/,/"HA"/p' "$1" | grep -oE '"(SA|DA|AA)": [0-9.]+' |
    awk '{ printf "%s%.2f", (NR > 1 ? " / " : ""), $2 }'
}

# Median time of removal per keyframe of a run's statistics.
removal_ms() {
  sed -n '/"removal": {/,/}/p' "$1" | grep -m1 -oE '"p50": [0-9.]+' | grep -oE '[0-9.]+$'
}

# means FILE...: SA / DA moving / AA moving, and behind a bar DA / AA, means of the files' figures
means() {
  local file
  for file in "$@"; do
    echo "$(number "$file" SA) $(number "$file" DA) $(moving "$file")"
  done | awk '
    NF != 3 { print "error: not three figures: " $0 >"/dev/stderr"; failed = 1; exit 1 }
    { sa += $1; da += $2; aa += sqrt($1 * $2); moving += $3; both += sqrt($1 * $3) }
    END { if (failed) exit 1; printf "%.2f / %.2f / %.2f|%.2f / %.2f\n",
          sa / NR, moving / NR, both / NR, da / NR, aa / NR }'
}

# scene_table SCENE DRIFT: a row per LiDAR, a column per stage at which points are labelled
scene_table() {
  local sensor
  echo "| $1, seeds $seeds: SA / DA moving / AA moving % | online | final | refined | online, all dynamic: DA / AA |"
  rule 5
  for sensor in $sensors; do row "$(lidar "$sensor")" 4 scene_cells "$out/$sensor-$1-$2"; done
}
scene_cells() {
  local labels
  for labels in default final refined; do
    printf '%s | ' "$(means "$1"-*."$labels".json | cut -d'|' -f1)"
  done
  means "$1"-*.default.json | cut -d'|' -f2
}

# recording_table: labelled points of the recording, where nothing stands for long
recording_table() {
  echo "| KITTI raw 0005, labelled points: SA / DA / AA % | online | final | refined |"
  rule 4
  row "$(variant_title default)" 3 recording_cells default final refined
  if [[ " ${recorded_variants[*]} " == *" paper "* ]]; then
    row "$(variant_title paper)" 3 recording_cells paper
  fi
}
recording_cells() {
  local labels cells=()
  for labels in "$@"; do cells+=("$(accuracy "$out/kitti.$labels.json")"); done
  printf '%s | %s | %s' "${cells[0]}" "${cells[1]:-–}" "${cells[2]:-–}"
}
accuracy() {
  [ -s "$1" ] || { echo "error: no figures in $1" >&2; return 1; }
  printf '%.2f / %.2f / %.2f' "$(number "$1" SA)" "$(number "$1" DA)" "$(number "$1" AA)"
}

variant_title() {
  case "$1" in
    paper) echo "paper's preset" ;;
    no-log-odds-carry) echo "no carried log-odds" ;;
    elevated-ground) echo "elevated ground accepted" ;;
    seen-through-ground) echo "seen-through ground accepted" ;;
    unpropagated-ground) echo "ground propagated over one voxel only" ;;
    full-weight-everywhere) echo "full weight at every range" ;;
    no-components) echo "no components, no persistence" ;;
    no-persistence) echo "no persistence" ;;
    other-keyframes-only) echo "without the keyframe's own images" ;;
    no-final-labels) echo "no final labels (online labels are the same)" ;;
    *) echo "$1" ;;
  esac
}

# rules_table: a row per variant
rules_table() {
  local variant lidars
  lidars=$(wc -w <<<"$sensors")
  echo "| one thing changed: SA / DA / AA %, moving | $(first "$scenes"), $lidars LiDARs, seeds $seeds, $scans scans | KITTI raw 0005 | removal, µs a keyframe ($(lidar "$(first "$sensors")")) |"
  rule 4
  for variant in "${variants[@]}"; do row "$(variant_title "$variant")" 3 rule_cells "$variant"; done
}
rule_cells() {
  local recorded=–
  [ ! -e "$out/kitti.$1.json" ] || recorded=$(accuracy "$out/kitti.$1.json")
  printf '%s | %s | %s' "$(means "$out"/*-"$first_drive"-[0-9]*."$1".json | cut -d'|' -f1)" \
    "$recorded" "$(removal_us "$out/$(first "$sensors")-$first_drive"-[0-9]*."$1".json)"
}

# Overview of every scene, odometry and stage of labelling.
overview() {
  local scene drift labels sensor
  for scene in $scenes; do
    for drift in $drifts; do
      for labels in default final refined; do
        echo
        echo "| $scene, odometry $drift, seeds $seeds, $scans scans each: ${labels/default/online}, mean | SA / DA moving / AA moving % | DA / AA % |"
        rule 3
        for sensor in $sensors; do
          row "$(lidar "$sensor")" 2 overview_cells "$out/$sensor-$scene-$drift"-*."$labels".json
        done
      done
    done
  done
}
overview_cells() { means "$@" | sed 's/|/ | /'; }

# removal_us FILE...: median time of removal of a keyframe, mean of the drives
removal_us() {
  local file
  for file in "$@"; do removal_ms "${file%.json}.stats"; done |
    awk '{ us += 1000 * $1 } END { printf "%.0f", us / NR }'
}

# breakdown class|range: a row per LiDAR and one for all, the points of their drives together
breakdown() {
  local sensor header columns
  header=$("$unimapper" evaluate breakdown --by "$1" | head -1)
  columns=$(($(tr -cd '|' <<<"$header" | wc -c) - 2))
  echo "$header"
  rule $((columns + 1))
  for sensor in $sensors; do
    row "$(lidar "$sensor")" "$columns" breakdown_cells "$1" "$out/$sensor"-*.default.json
  done
  row all "$columns" breakdown_cells "$1" "$out"/*-[0-9]*.default.json
}
breakdown_cells() {
  "$unimapper" evaluate breakdown --by "$1" --label x "${@:2}" | sed 's/^| x | //; s/ |$//'
}
