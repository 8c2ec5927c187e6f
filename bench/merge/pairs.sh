#!/usr/bin/env bash
# Both errors of every rule of acceptance, on pairs of sessions: tables of loop-acceptance.md
#
#   bench/merge/pairs.sh [SEED] [SEEDS]   "11" and "1 2 3 4": of ordinary scenes, of look-alike ones;
#                                         WRITE_DOCS=1 writes the tables there. Three hours
#
# Right pairs: every LiDAR with every other in five ordinary scenes (drive A, and B on another day or
# C in reverse), and drives A and B of look-alike scenes. The query's odometry drifts in one of three
# ways, starts level or as the LiDAR is mounted (10 degrees off), and overlaps by 30 m, 60 m, 120 m or
# all of the way; drives of campus, square and hall are no longer than 23 to 36 m. Wrong pairs: drives
# of different scenes, of different seeds, and drives through the two copies of a look-alike scene. A
# pair is merged right if it is off by at most 1 m in the overlap.
#
# Every right pair that waits or is refused is drawn, with the reason, in OUT/pictures.html: as it is placed, or as
# it truly lies.
#
# What is there is not done again: OUT, a folder of runs and outcomes. BIN: programs; SCENES and
# SENSORS: others than all; SETS="tilt+residual;tilt+votes of neighbours": sets of rules that are off together,
# instead of each one alone; LAYOUT=1 prints the tables without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

seed=${1:-11}
seeds=${2:-1 2 3 4}
read -ra scenes <<<"${SCENES:-town campus square street hall}"
read -ra sensors <<<"${SENSORS:-os2-128 os1-64 hdl-64e vlp-16 livox-mid-360 aeva-aeries2 livox-avia}"
alike="bore fixtures decks streets corridor courtyard quad orchard"
IFS=';' read -ra sets <<<"${SETS:-}"
out=${OUT:-build/bench/pairs}
bin=${BIN:-build/release/bin}
unimapper=$bin/unimapper

# outcomes_of KIND SCENE LIDAR LIDAR RUN RUN [OVERLAP]: outcomes of a pair, a line each, behind these words
outcomes_of() {
  local name="$1-${5//\//-}-${6//\//-}-${7:-all}"
  local file=$out/outcomes/$name.tsv
  if [ ! -e "$file" ]; then
    mkdir -p "$out/outcomes" "$out/pictures"
    "$bin/merge_pairs_bench" "$out/runs/$5/keyframes.lcmlog" "$out/data/$5" \
      "$out/runs/$6/keyframes.lcmlog" "$out/data/$6" "${7:-all}" "$out/pictures/$name.png" "${sets[@]}" \
      >"$out/unfinished.tsv"
    mv "$out/unfinished.tsv" "$file"
  fi
  sed "s/^/$1\t$2\t$3\t$4\t${7:-all}\t/" "$file" >>"$out/all.tsv"
  [ "$1" != right ] || page_of "$name" "$file" "$2, $(lidar "$3") and $(lidar "$4"), ${7:-all}"
}

# page_of NAME OUTCOMES TITLE: a right pair that is not merged, with its reason, in pictures.html
page_of() {
  awk -F '\t' -v name="$1" -v title="$3" '
    $1 == "rule" && $2 == "none" && $3 != "merged" {
      printf "<figure><img src=\"pictures/%s.png\"><figcaption>%s: %s, off by %s m: %s</figcaption></figure>\n",
        name, title, $3, $4, $5 }' "$2" >>"$out/pictures.html"
}

drifts=(lio icp bad)
overlaps=(30 60 120 "")

# drive SCENE SENSOR ROUTE NUMBER: its run; odometry varies with the number of a query
drive() {
  local options=(--drift lio)
  if [ "$3" != A ]; then
    options=(--drift "${drifts[$4 % 3]}")
    [ $(($4 % 2)) -eq 0 ] || options+=(--odometry-start identity --mount-pitch 10)
  fi
  make_run "$1-$2-$seed/$3" --scene "$1" --sensor "$2" --route "$3" --seed "$seed" --scans 300 \
    "${options[@]}"
}

# query_of NUMBER-OF-SCENE NUMBER-OF-SENSOR: the query's run
query_of() {
  local routes=(B C)
  # C of the street has nothing in common with A.
  [ "${scenes[$1]}" != street ] || routes=(B B)
  echo "${scenes[$1]}-${sensors[$2]}-$seed/${routes[($1 + $2) % 2]}"
}

ordinary_pairs() {
  local s a b other query
  for s in "${!scenes[@]}"; do
    for a in "${!sensors[@]}"; do
      query=$(query_of "$s" "$a")
      drive "${scenes[s]}" "${sensors[a]}" A 0
      drive "${scenes[s]}" "${sensors[a]}" "${query##*/}" $((s + a))
    done
  done
  for s in "${!scenes[@]}"; do
    for a in "${!sensors[@]}"; do
      for b in "${!sensors[@]}"; do
        outcomes_of right "${scenes[s]}" "${sensors[a]}" "${sensors[b]}" "${scenes[s]}-${sensors[a]}-$seed/A" \
          "$(query_of "$s" "$b")" "${overlaps[(s + a + 2 * b) % 4]}"
      done
    done
  done
  for other in 1 2 3; do
    for a in "${!sensors[@]}"; do
      for b in "${!sensors[@]}"; do
        s=$(((a + b) % ${#scenes[@]}))
        outcomes_of wrong "different scenes" "${sensors[a]}" "${sensors[b]}" \
          "${scenes[s]}-${sensors[a]}-$seed/A" "$(query_of $(((s + other) % ${#scenes[@]})) "$b")"
      done
    done
  done
}

alike_pairs() {
  local scene one other route
  for one in $seeds; do
    for scene in $alike; do
      for route in A B C; do
        make_run "$scene-vlp-16-$one/$route" --scene "$scene" --sensor vlp-16 --seed "$one" \
          --route "$route" --scans 300
      done
      outcomes_of right "$scene" vlp-16 vlp-16 "$scene-vlp-16-$one/A" "$scene-vlp-16-$one/B"
      for route in A B; do
        outcomes_of wrong "$scene" vlp-16 vlp-16 "$scene-vlp-16-$one/$route" "$scene-vlp-16-$one/C"
      done
      # The court is the same for every seed.
      [ "$scene" != quad ] || continue
      for other in $seeds; do
        [ "$other" -gt "$one" ] || continue
        make_run "$scene-vlp-16-$other/A" --scene "$scene" --sensor vlp-16 --seed "$other" --route A \
          --scans 300
        outcomes_of wrong "different seeds" vlp-16 vlp-16 "$scene-vlp-16-$one/A" "$scene-vlp-16-$other/A"
      done
    done
  done
}

# What became of pairs, with all rules: columns of a line of outcomes.
outcomes='
  BEGIN { FS = "\t" }
  function is_right() { return $9 == "-" || $9 <= 1 }
  function sorted_at(values, n, share,  i, j, t) {
    for (i = 2; i <= n; ++i) for (j = i; j > 1 && values[j] < values[j - 1]; --j) {
      t = values[j]; values[j] = values[j - 1]; values[j - 1] = t }
    return n ? sprintf("%.2f", values[int(share * (n - 1) + 0.5) + 1]) : "-"
  }'

# right_cells SCENE OVERLAPS: pairs | merged right / provisional / refused / merged wrong | errors
right_cells() {
  awk -v scene="$1" -v overlaps="$2" "$outcomes"'
    $1 != "right" || $2 != scene || $6 != "rule" || $7 != "none" || !index(overlaps, $5) { next }
    { ++pairs
      if ($8 == "merged") { if (is_right()) { e[++n] = $9 + 0 } else ++wrong }
      else if ($8 == "provisional") { ++provisional; placed += is_right() }
      else ++refused }
    END { printf "%d | %d | %d (%d) | %d | %d | %s | %s", pairs, n, provisional, placed, refused, wrong,
      sorted_at(e, n, 0.5), sorted_at(e, n, 1) }' "$out/all.tsv"
}

right_rows() {
  local scene
  echo "| right pairs | pairs | merged | provisional (placed right) | refused | merged wrong | error of the merged, median, m | largest, m |"
  rule 8
  for scene in "${scenes[@]}"; do
    case "$scene" in
      town | street)
        row "\`$scene\`, 60 m and more" 7 right_cells "$scene" "60 120 all"
        row "\`$scene\`, 30 m" 7 right_cells "$scene" "30"
        ;;
      *) row "\`$scene\`, drives of 23 to 36 m" 7 right_cells "$scene" "30 60 120 all" ;;
    esac
  done
  for scene in $alike; do row "\`$scene\`" 7 right_cells "$scene" all; done
}

# lidar_cells SENSOR: merged of right pairs in ordinary scenes, by the other's LiDAR
lidar_cells() {
  awk -v lidar="$1" -v sensors="${sensors[*]}" -v scenes="${scenes[*]}" "$outcomes"'
    $1 != "right" || !index(scenes, $2) || $6 != "rule" || $7 != "none" || $3 != lidar { next }
    { ++pairs[$4]; merged[$4] += $8 == "merged" && is_right() }
    END { n = split(sensors, of, " ")
      for (i = 1; i <= n; ++i) printf "%s%d of %d", (i > 1 ? " | " : ""), merged[of[i]], pairs[of[i]] }' \
    "$out/all.tsv"
}

lidar_rows() {
  local sensor
  printf '| ordinary scenes, merged right: map \\ query |'
  for sensor in "${sensors[@]}"; do printf ' %s |' "$(lidar "$sensor")"; done
  echo
  rule $((${#sensors[@]} + 1))
  for sensor in "${sensors[@]}"; do row "$(lidar "$sensor")" ${#sensors[@]} lidar_cells "$sensor"; done
}

# wrong_cells SCENE: pairs | merged | provisional | refused
wrong_cells() {
  awk -v scene="$1" "$outcomes"'
    $1 != "wrong" || $2 != scene || $6 != "rule" || $7 != "none" { next }
    { ++pairs; ++became[$8] }
    END { printf "%d | %d | %d | %d", pairs, became["merged"], became["provisional"], became["refused"] }' \
    "$out/all.tsv"
}

wrong_rows() {
  local scene
  echo "| wrong pairs | pairs | merged | provisional | refused |"
  rule 5
  row "different scenes" 4 wrong_cells "different scenes"
  row "different seeds of one look-alike scene" 4 wrong_cells "different seeds"
  for scene in $alike; do row "the two copies of \`$scene\`" 4 wrong_cells "$scene"; done
}

# rule_cells RULE: right pairs merged right and wrong, wrong pairs merged, without that rule; the
# copies of two scenes, that could be the original with a kiosk or cars gone, do not count
rule_cells() {
  awk -v without="$1" "$outcomes"'
    $6 != "rule" || $7 != without || ($1 == "wrong" && $2 ~ /^(streets|quad)$/) { next }
    $1 == "right" { ++pairs; right += $8 == "merged" && is_right(); off += $8 == "merged" && !is_right() }
    $1 == "wrong" { ++others; merged += $8 == "merged" }
    END { printf "%d of %d | %d | %d of %d", right, pairs, off, merged, others }' "$out/all.tsv"
}

rule_rows() {
  local name
  echo "| without this rule | right pairs merged | merged wrong | wrong pairs merged |"
  rule 4
  local names=(none tilt "overlap before" convergence correction overlap "free space"
    "number and span" "competing set" "weakest direction" "one place" repetition storeys
    "votes of neighbours" walls deformation)
  [ ${#sets[@]} -eq 0 ] || names=(none "${sets[@]}")
  for name in "${names[@]}"; do
    row "$name" 3 rule_cells "$name"
  done
}

# Candidates of descriptors: what counts as right, and the gate that refuses each.
candidates='
  BEGIN { FS = "\t"
    split("overlap before alignment|alignment did not converge|alignment moved it by metres|" \
          "alignment turned it by radians|tilt in sigmas|overlap|structure in free space", gate, "|")
    for (g in gate) number[gate[g]] = g }
  function is_narrow(lidar) { return lidar ~ /avia|aeva/ }
  $6 != "candidate" { next }
  { split($7, error, " "); right = $1 == "right" && error[1] <= 4 && error[2] <= 0.25
    first = 0; refusing = 0; only = 0
    for (i = 8; i <= NF; ++i) {
      split($i, part, "=")
      if (part[2] !~ /^refused/) continue
      ++refusing; only = number[part[1]]
      if (!first) first = only }
    if ($1 == "wrong") group = "wrong"
    else if (index(scenes, $2) == 0) group = "alike"
    else if ($3 == $4) group = "same"
    else group = is_narrow($3) + is_narrow($4) }'

# gate_cells GROUP: of pairs of LiDARs, by how many of the two have a narrow field of view, and others
gate_cells() {
  awk -v scenes="${scenes[*]}" -v which="$1" "$candidates"'
    group != which { next }
    !right { ++wrong; off += !refusing && error[3] > 1 }
    right { ++all; if (!refusing) { ++accepted; off += error[3] > 1 } else ++by[first] }
    END { printf "%d | %d", all, accepted
      for (g = 1; g <= 7; ++g) if (g != 4) printf " | %d", by[g] + (g == 3 ? by[4] : 0)
      printf " | %d | %d", wrong, off }' "$out/all.tsv"
}

gate_rows() {
  echo "| candidates of pairs | right | accepted | refused by overlap before | convergence | correction | tilt | overlap | free space | wrong | accepted, off by more than 1 m |"
  rule 11
  row "ordinary scenes, one LiDAR" 10 gate_cells same
  row "two LiDARs that see all round" 10 gate_cells 0
  row "one with a narrow view" 10 gate_cells 1
  row "both with a narrow view" 10 gate_cells 2
  row "look-alike scenes" 10 gate_cells alike
  row "wrong pairs" 10 gate_cells wrong
}

# alone_cells NUMBER: right and wrong candidates that a gate alone refuses, of all pairs
alone_cells() {
  awk -v scenes="${scenes[*]}" -v which="$1" "$candidates"'
    refusing == 1 && only == which { if (right) ++r; else ++w } END { printf "%d | %d", r, w }' "$out/all.tsv"
}

alone_rows() {
  local name number=0
  echo "| refused by this gate and by no other | right | wrong |"
  rule 3
  for name in "overlap before" convergence "moved too far" "turned too far" tilt overlap "free space"; do
    number=$((number + 1))
    row "$name" 2 alone_cells "$number"
  done
}

# limit_cells LIMIT: of the candidates that pass all other gates, right and wrong ones seen through by more
limit_cells() {
  awk -v scenes="${scenes[*]}" -v limit="$1" "$candidates"'
    { split($NF, part, " "); share = part[length(part)]
      if (refusing > (first == 7)) next
      if (right) { ++all; kept += share <= limit } else { ++others; passed += share <= limit } }
    END { printf "%d of %d | %d of %d", all - kept, all, passed, others }' "$out/all.tsv"
}

limit_rows() {
  local limit
  echo "| limit of structure in free space | right candidates that it refuses | wrong ones that it lets pass |"
  rule 3
  for limit in 0.1 0.2 0.3 0.4 0.5 0.6; do row "$limit" 2 limit_cells "$limit"; done
}

if ! only_layout; then
  mkdir -p "$out"
  : >"$out/all.tsv"
  : >"$out/pictures.html"
  ordinary_pairs
  alike_pairs
fi
table pairs-right right_rows
table pairs-lidars lidar_rows
table pairs-wrong wrong_rows
table pairs-rules rule_rows
table pairs-gates gate_rows
table pairs-gates-alone alone_rows
table pairs-free-space limit_rows
