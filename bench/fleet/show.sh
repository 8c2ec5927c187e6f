#!/usr/bin/env bash
# A fleet on one machine: three sites with a robot each, servers, a centre, two workers, one map.
#
#   bench/fleet/show.sh [--quick] [--out=DIR]
#
# All of it runs in a network namespace of its own, and ends with this script. BIN: folder of programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

scans=400 servers=3 out=build/fleet
for argument in "$@"; do
  case "$argument" in
    --quick) scans=150 servers=1 ;;
    --out=*) out=${argument#--out=} ;;
    *) cat >&2 <<'TXT'
usage: ./dev fleet [--quick] [--out=DIR]

  --quick    150 scans instead of 400 for each robot, one server instead of three
  --out=DIR  where everything goes (default: build/fleet; emptied first)
TXT
       exit 2 ;;
  esac
done
enter_namespace n "$@"
# What an earlier one left; nothing else may be deleted, whatever --out says.
if [ -e "$out" ] && [ ! -e "$out/.unimapper-fleet" ]; then
  echo "error: $out exists and is not of a fleet; choose another --out" >&2
  exit 1
fi
rm -rf "$out"
mkdir -p "$out"
: >"$out/.unimapper-fleet"
exec bench/fleet/show.py "${BIN:-build/release/bin}" "$out" "$scans" "$servers"
