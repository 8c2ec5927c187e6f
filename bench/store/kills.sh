#!/usr/bin/env bash
# Commands of `unimapper map` that are killed at random moments, and the store after that.
#
#   bench/store/kills.sh [ROUNDS [COMMAND...]]   100 rounds of every command that writes; under an hour
#
# Each round copies a project of two small runs, starts the command, kills it with SIGKILL at a random
# moment of the time that it takes, and asks `map check`. The store has the epoch before or the one
# after it, whole; a folder of an export is the earlier map or the new one, file by file. OUT: folder
# for data, kept; BIN: programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

rounds=${1:-100}
all="add merge export remove purge link forbid apart pin withdraw undo position import survey create"
commands=${*:2}
out=${OUT:-build/bench/kills}
unimapper=${BIN:-build/release/bin}/unimapper
store=$out/round/store

# words COMMAND: its arguments, on the project that `prepare` makes
words() {
  case "$1" in
    add) echo "add $out/runs/c" ;;
    export) echo "export --replace --out $out/round/map" ;;
    remove) echo "remove b" ;;
    purge) echo "remove --purge b" ;;
    link) echo "link a:0 b:1 --force" ;;
    forbid) echo "forbid a:0 b:1" ;;
    apart | pin) echo "$1 b" ;;
    withdraw) echo "withdraw 1" ;;
    position) echo "position a:1 --at 1 2 3 --sigma 0.5" ;;
    import) echo "import $out/new/graph.g2o" ;;
    survey) echo "survey $out/new/map.ply" ;;
    *) echo "$1" ;;
  esac
}

map() { "$unimapper" map "$1" --store "$store" "${@:2}" >/dev/null 2>&1; }

epochs() {
  "$unimapper" map list --store "$store" --json 2>/dev/null | grep -c '"epoch":' || true
}

# The project before each round, $out/project, with the map of its first run in it, and the map that
# an export of it writes, $out/new.
prepare() {
  local name scans=60
  for name in a b c; do
    make_run "$name" --sensor vlp-16 --columns 256 --route A --seed 3 --scans $scans
    scans=$((scans + 10))
  done
  rm -rf "$out/round" "$out/project" "$out/new"
  mkdir -p "$out/round"
  map create
  map add "$out/runs/a"
  map merge
  map export --out "$out/round/map"
  map add "$out/runs/b"
  map position a:0 --at 0 0 0 --sigma 1
  map merge
  map export --out "$out/new"
  mv "$out/round" "$out/project"
}

fresh() {
  rm -rf "$out/round"
  cp -r "$out/project" "$out/round"
  [ "$1" != create ] || rm -rf "$store"
}

# is_map FOLDER: whether the round's folder has the same map, but for times
is_map() { diff -rq -x timing.json -x times.json -x report.html "$1" "$out/round/map" >/dev/null; }

# fault COMMAND EPOCHS: what is wrong after a kill, in words; nothing
fault() {
  local now
  now=$(epochs)
  if [ "$1" = create ]; then
    # What is half made is made whole by the next command that writes.
    { [ -e "$store/store.sqlite" ] || map create; } && map add "$out/runs/c" && map check ||
      echo "no store"
    return
  fi
  map check || echo "map check"
  [ "$now" = "$2" ] || [ "$now" = "$(($2 + 1))" ] || echo "$now epochs instead of $2"
  [ "$1" != export ] || is_map "$out/project/map" || is_map "$out/new" || echo "a map of parts"
}

# has_changed COMMAND EPOCHS
has_changed() {
  case "$1" in
    export) is_map "$out/new" ;;
    create) [ -e "$store/store.sqlite" ] ;;
    *) [ "$(epochs)" != "$2" ] ;;
  esac
}

# kills COMMAND: rounds in which it was killed | of these with the change made | faults
kills() {
  local before took killed=0 changed=0 faults=0 process status found round
  fresh "$1"
  took=$(date +%s%N)
  # shellcheck disable=SC2046
  map $(words "$1") || { echo "error: $1 fails" >&2; return 1; }
  took=$((($(date +%s%N) - took) / 1000000))
  for ((round = 0; round < rounds; ++round)); do
    fresh "$1"
    before=$(epochs)
    # shellcheck disable=SC2046
    set -- "$1" $(words "$1")
    "$unimapper" map "$2" --store "$store" "${@:3}" >/dev/null 2>&1 &
    process=$!
    sleep "$(awk -v ms=$((RANDOM % (took + 1))) 'BEGIN { print ms / 1000 }')"
    kill -9 "$process" 2>/dev/null || true
    status=0
    wait "$process" 2>/dev/null || status=$?
    [ "$status" != 137 ] || killed=$((killed + 1))
    if has_changed "$1" "$before"; then changed=$((changed + 1)); fi
    found=$(fault "$1" "$before")
    [ -z "$found" ] || { faults=$((faults + 1)); echo "$1, round $round: $found" >&2; }
  done
  echo "$killed | $changed | $faults"
}

rows() {
  local command
  echo "| command | killed | of all rounds, with the change made | faults |"
  rule 4
  for command in ${commands:-$all}; do row "\`$command\`" 3 kills "$command"; done
}

RANDOM=7
only_layout || prepare
table store-kills rows
