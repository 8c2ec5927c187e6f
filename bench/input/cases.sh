#!/usr/bin/env bash
# Cases out of the field, in one table: what people reported of other programs, tried on this one.
#
#   bench/input/cases.sh [CASE...]   "C1 F2"; all without. An hour
#
# Programs in the folders of ../shared/cases, or CASES, make inputs and print what came out: a row
# for each exit code, beneath what the case's first lines call right. WRONG is a crash, a program of
# a case that fails or takes longer than LIMIT seconds, and a poor result without a word: below 93 %
# of the static points, or more than 0.5 m from the truth. Else "refused" (an exit code with a
# reason), "said" (mapped with a warning), "right" (good figures) or "mapped" (none). The last
# lines count. BIN: programs; OUT: folder for inputs and runs, of which simulated drives are kept;
# G1_SCANS: length of the long drive, 600.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

cases=$(realpath -m "${CASES:-../shared/cases}")
[ -d "$cases" ] || { echo "cases.sh: no cases in $cases: CASES names their folder" >&2; exit 2; }
UNIMAPPER=$(realpath "${BIN:-build/release/bin}")/unimapper
CASES_WORK=$(realpath -m "${OUT:-build/bench/cases}")
export UNIMAPPER CASES_WORK CASES="$cases" PYTHONDONTWRITEBYTECODE=1
mkdir -p "$CASES_WORK"

# run PROGRAM: what it prints, and how it ended where that was badly
run() {
  local code=0 words=(/usr/bin/python3 "$1")
  case $1 in *.sh) words=(bash "$1") ;; */G1_long/make.py) words+=("${G1_SCANS:-600}") ;; esac
  timeout -k 10 "${LIMIT:-900}" "${words[@]}" 2>&1 || code=$?
  [ "$code" = 0 ] || echo "## all of ${1##*/}: exit $((code + 1000))"
}

# rows CASE: of what its programs print
rows() {
  awk -v name="$1" '
    function row(   poor, kind) {
      if (code == "") return
      poor = sa != "" && sa < 93 || ate != "" && ate > 0.5
      kind = said != "" ? "said" : poor ? "WRONG" : sa != "" || ate != "" ? "right" : "mapped"
      if (code != 0) kind = code > 0 && code < 124 && said != "" ? "refused" : "WRONG"
      if (code >= 1000) code = "case " code - 1000
      printf "| %s | %s | %s | %s | %s | %s |\n", name, title, code, figures, kind, said
      code = figures = said = sa = ate = ""
    }
    function figure() {
      figures = figures (figures == "" ? "" : ", ") substr($0, RSTART, RLENGTH)
      split(substr($0, RSTART, RLENGTH), part, " ")
    }
    /^ *##/ && !/exit/ { row(); title = $0; sub(/^ *## */, "", title); next }
    match($0, /exit -?[0-9]+/) || match($0, /^(onboard|merge) [0-9]+/) {
      row()
      split(substr($0, RSTART, RLENGTH), part, " ")
      code = part[2] + 0
      before = part[1] == "exit" ? substr($0, 1, RSTART - 1) : part[1]
      gsub(/^[ #]+|[:, ]+$/, "", before)
      if (before != "") title = before
    }
    code == "" { next }
    match($0, /SA [0-9.]+ DA [0-9.]+/) { figure(); if (sa == "" || part[2] < sa) sa = part[2] + 0 }
    match($0, /ATE [0-9.]+/) { figure(); if (ate == "" || part[2] + 0 > ate) ate = part[2] + 0 }
    match($0, /, [0-9]+\)\]$/) { figures = substr($0, RSTART + 2, RLENGTH - 4) " MB" }
    !said && !/later keyframes/ && match($0, /(error|warning|refused|provisional|not connected): .*/) {
      said = substr($0, RSTART, 110)
      gsub(/\|/, "/", said)
    }
    END { row() }'
}

printf '| case | variant | exit | figures | verdict | what was said |\n|---|---|---|---|---|---|\n'
# C3 takes runs of C1, C2 and E1, E3 those of D1, and H1 a drive of F2.
for folder in "$cases"/[!C]*/ "$cases"/C[!3]*/ "$cases"/C3*/; do
  title=$(basename "$folder") name=$(basename "${folder%%_*}")
  if [ $# -gt 0 ] && [[ " $* " != *" $name "* ]]; then continue; fi
  wanted=$(cat "$folder"/* | grep -m 1 -o 'Right: .*' | tr '|"' '/ ' || true)
  echo "| $name | **$title** | | | | ${wanted:-Right: as its first lines say} |"
  for program in "$folder"*.py "$folder"*.sh; do
    if [ -e "$program" ]; then run "$program" | rows "$name"; fi
  done
  case $name in C1 | C2 | D1 | E1) ;; *) rm -rf "${CASES_WORK:?}/$name" ;; esac
done | tee "$CASES_WORK/table.md"
rm -rf "$CASES_WORK"/[CDE][123]
cut -d '|' -f 6 "$CASES_WORK/table.md" | tail -n +3 | grep . | sort | uniq -c
