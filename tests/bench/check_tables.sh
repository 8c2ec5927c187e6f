#!/usr/bin/env bash
# Test of the check of tables: every fault of control.md is found, and its last table accepted.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
expected='3: a table of figures that no command writes
8: printed is: | ATE rmse, m |
15: printed is: | OS2-128 |
24: printed is: | `armv7-64mb` |
29: printed is: | `default` |
32: the command does not print this table
38: printed is: | town, seeds 1:'
if found=$("$root/bench/tables/check.sh" "$root/tests/bench/control.md"); then
  echo "FAILED: faults were accepted"
  exit 1
fi
status=0
while read -r fault; do
  grep -qF "control.md:$fault" <<<"$found" || { echo "FAILED: not found: $fault"; status=1; }
done <<<"$expected"
if [ "$(grep -c 'control.md:' <<<"$found")" != "$(wc -l <<<"$expected")" ]; then
  echo "FAILED: more was found than there is"
  status=1
fi
echo "$found"
exit $status
