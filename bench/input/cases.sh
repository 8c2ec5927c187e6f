#!/usr/bin/env bash
# Cases out of the field, in one table: what people reported of other programs, tried on this one.
#
#   bench/input/cases.sh [CASE...]   "C1 F2"; all without. An hour
#
# Programs in the folders of ../shared/cases, or CASES, make inputs and map them: a row for each
# call of unimapper, beneath what the case's first lines call right. WRONG is a crash, a program of
# a case that fails or takes longer than LIMIT seconds, and a poor result without a word: below 93 %
# of the static points, or more than 0.5 m from the truth. Else "refused" (an exit code with a
# reason), "said" (mapped with a warning), "right" (good figures), "mapped" (none) or "stopped" (a
# program of a case that needed what was refused). The last lines count. BIN: programs; OUT: folder
# of runs, of which simulated drives and CASE.log, all that was printed, are kept; G1_SCANS: length
# of the long drive, 600.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

cases=$(realpath -m "${CASES:-../shared/cases}")
[ -d "$cases" ] || { echo "cases.sh: no cases in $cases: CASES names their folder" >&2; exit 2; }
PROGRAM=$(realpath "${BIN:-build/release/bin}")/unimapper
CASES_WORK=$(realpath -m "${OUT:-build/bench/cases}")
export PROGRAM CASES_WORK CASES="$cases" PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1
mkdir -p "$CASES_WORK"

# What programs of cases call: each line that they may not show goes into LOG with an @ before it.
cat >"$CASES_WORK/unimapper" <<'EOT'
#!/usr/bin/env bash
[ "$1" = simulate ] && exec "$PROGRAM" "$@"
title="$1 $(basename "${2:-}")" option='' code=0
for word in "$@"; do
  case $option in --out) title="$1 $(basename "$word")" ;; esac
  option=$word
done
case " $* " in *' --force '*) title+=' --force' ;; esac
echo "@call $title" >>"$LOG"
"$PROGRAM" "$@" >"$LOG.out" 2>"$LOG.err" || code=$?
if [ "$1" = merge ]; then sed 's/^/@/' "$LOG.out" >>"$LOG"; fi
sed 's/^/@/' "$LOG.err" >>"$LOG"
cat "$LOG.out"
cat "$LOG.err" >&2
echo "@exit $code" >>"$LOG"
exit "$code"
EOT
chmod +x "$CASES_WORK/unimapper"

# run CASE PROGRAM: into its log, with how it ended where that was badly
run() {
  local code=0 words=(/usr/bin/python3 "$2") program=$CASES_WORK/unimapper
  # G1 measures the memory of the process, H1 kills it: both print exit codes.
  case $1 in G1 | H1) program=$PROGRAM ;; esac
  case $2 in *.sh) words=(bash "$2") ;; */G1_long/make.py) words+=("${G1_SCANS:-600}") ;; esac
  export LOG=$CASES_WORK/$1.log UNIMAPPER=$program
  timeout -k 10 "${LIMIT:-900}" "${words[@]}" >>"$LOG" 2>&1 || code=$?
  [ "$code" = 0 ] || echo "## all of ${2##*/}: exit $((code + 1000))" >>"$LOG"
}

# rows CASE: of its log
rows() {
  awk -v name="$1" -v wrapped="$([[ $1 != [GH]1 ]] && echo 1)" '
    function row(   poor, kind) {
      if (code == "") return
      poor = sa != "" && sa < 93 || ate != "" && ate > 0.5
      kind = said != "" ? "said" : poor ? "WRONG" : sa != "" || ate != "" ? "right" : "mapped"
      if (code != 0) kind = code > 0 && code < 124 && said != "" ? "refused" : "WRONG"
      if (code == 1001 && before_it == "refused") kind = "stopped"
      before_it = kind
      if (code >= 1000) code = "case " code - 1000
      printf "| %s | %s | %s | %s | %s | %s |\n", name, title, code, figures, kind, said
      code = figures = said = sa = ate = ""
    }
    function figure(text) { figures = figures (figures == "" ? "" : ", ") text }
    /^@call / { row(); title = substr($0, 7); column = 0; next }
    /^@exit / { code = $2; next }
    /^ *##/ && !/exit/ && !wrapped { row(); title = $0; sub(/^ *## */, "", title); next }
    (!wrapped || /## all of/) && match($0, /exit -?[0-9]+|^(onboard|merge) [0-9]+/) {
      row()
      split(substr($0, RSTART, RLENGTH), part, " ")
      code = part[2] + 0
      before = part[1] == "exit" ? substr($0, 1, RSTART - 1) : part[1]
      gsub(/^[ #]+|[:, ]+$/, "", before)
      if (before != "") title = before
    }
    # The truths of D1 have a frame each: between them an ATE says nothing.
    name == "D1" && title ~ /^merge mm_/ && /^@session .*ATE/ { next }
    /^@session .*ATE rmse m/ {
      n = split($0, part, /  +/)
      for (i = 1; i <= n; ++i) if (part[i] == "ATE rmse m") column = i
      next
    }
    /^@loops: / { column = 0 }
    column && split($0, part, /  +/) >= column {
      figure("ATE " part[column])
      if (part[column] != "-" && (ate == "" || part[column] + 0 > ate)) ate = part[column] + 0
    }
    match($0, /SA [0-9.]+ DA [0-9.]+/) {
      figure(substr($0, RSTART, RLENGTH))
      split(substr($0, RSTART, RLENGTH), part, " ")
      if (sa == "" || part[2] + 0 < sa) sa = part[2] + 0
    }
    match($0, /static points lost [0-9.]+/) {
      figure(substr($0, RSTART, RLENGTH))
      kept = 100 - substr($0, RSTART + 19, RLENGTH - 19)
      if (sa == "" || kept < sa) sa = kept
    }
    match($0, /, [0-9]+\)\]$/) { figures = substr($0, RSTART + 2, RLENGTH - 4) " MB" }
    (/^@/ || !wrapped) && !said && !/later keyframes|rays are/ &&
      match($0, /(error|warning|refused|provisional|not connected): .*/) {
      said = substr($0, RSTART, 110)
      gsub(/\|/, "/", said)
    }
    END { row() }' "$CASES_WORK/$1.log"
}

printf '| case | variant | exit | figures | verdict | what was said |\n|---|---|---|---|---|---|\n'
# C3 takes runs of C1, C2 and E1, E3 those of D1, and H1 a drive of F2.
for folder in "$cases"/[!C]*/ "$cases"/C[!3]*/ "$cases"/C3*/; do
  title=$(basename "$folder") name=$(basename "${folder%%_*}")
  if [ $# -gt 0 ] && [[ " $* " != *" $name "* ]]; then continue; fi
  wanted=$(cat "$folder"/* | grep -m 1 -o 'Right: .*' | tr '|"' '/ ' || true)
  echo "| $name | **$title** | | | | ${wanted:-Right: as its first lines say} |"
  rm -f "$CASES_WORK/$name.log"
  for program in "$folder"*.py "$folder"*.sh; do
    if [ -e "$program" ]; then run "$name" "$program"; fi
  done
  rows "$name"
  case $name in C1 | C2 | D1 | E1) ;; *) rm -rf "${CASES_WORK:?}/$name" ;; esac
done | tee "$CASES_WORK/table.md"
rm -rf "$CASES_WORK"/[CDE][123]
cut -d '|' -f 6 "$CASES_WORK/table.md" | grep '[a-zA-Z]' | sort | uniq -c
