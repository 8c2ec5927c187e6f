#!/usr/bin/env bash
# One fuzz target for some seconds: run.sh BIN FOLDER TARGET SECONDS|replay
#
# BIN/fuzz_TARGET starts from FOLDER/seeds/TARGET, keeps what it learns in FOLDER/corpus/TARGET and
# what ends it in FOLDER/found. `replay` makes the same inputs from the same seeds every time, as many
# as runs.txt says. Prints a line; ends with 1, after the target's last words, if an input ended it.
set -euo pipefail
bin=$1 folder=$2 target=$3 seconds=$4
log=$folder/$target.log
corpora=("$folder/seeds/$target")
if [ "$seconds" = replay ]; then
  runs=$(awk -v target="$target" '$1 == target { print $2 }' "$(dirname "$0")/runs.txt")
  limits=(-seed=1 -runs="${runs:?no number of runs for $target}")
else
  corpora=("$folder/corpus/$target" "${corpora[@]}")
  limits=(-max_total_time="$seconds")
fi
mkdir -p "${corpora[@]}"
if "$bin/fuzz_$target" "${limits[@]}" -timeout=60 -rss_limit_mb=4096 \
  -artifact_prefix="$folder/found/$target-" "${corpora[@]}" >"$log" 2>&1; then
  echo "$target: $(tail -1 "$log")"
else
  echo "$target: FAILED"
  tail -40 "$log"
  exit 1
fi
