#!/usr/bin/env bash
# One fuzz target for some seconds: run.sh BIN FOLDER TARGET SECONDS|replay
#
# BIN/fuzz_TARGET starts from FOLDER/seeds/TARGET, keeps what it learns in FOLDER/corpus/TARGET and
# what ends it in FOLDER/found. `replay` makes the same inputs from the same seeds every time, as many
# as runs.txt says: seeds come in the order of their names, values seen in comparisons, which may be
# addresses, are not tried, and addresses are the same where the system allows it. Only authenticated,
# share_contents and spool, which ask the system for random numbers or files, still differ. Prints a
# line; ends with 1, after the target's last words, if an input ended it.
set -euo pipefail
bin=$1 folder=$2 target=$3 seconds=$4
log=$folder/$target.log
same_addresses=()
mkdir -p "$folder/seeds/$target"
if [ "$seconds" = replay ]; then
  runs=$(awk -v target="$target" '$1 == target { print $2 }' "$(dirname "$0")/runs.txt")
  find "$folder/seeds/$target" -type f | LC_ALL=C sort | paste -sd, >"$folder/$target.seeds"
  inputs=(-seed=1 -runs="${runs:?no number of runs for $target}" -use_cmp=0
    -seed_inputs="@$folder/$target.seeds")
  setarch -R true 2>/dev/null && same_addresses=(setarch -R)
else
  mkdir -p "$folder/corpus/$target"
  inputs=(-max_total_time="$seconds" "$folder/corpus/$target" "$folder/seeds/$target")
fi
if "${same_addresses[@]}" "$bin/fuzz_$target" "${inputs[@]}" -timeout=60 -rss_limit_mb=4096 \
  -artifact_prefix="$folder/found/$target-" >"$log" 2>&1; then
  echo "$target: $(tail -1 "$log")"
else
  echo "$target: FAILED"
  tail -40 "$log"
  exit 1
fi
