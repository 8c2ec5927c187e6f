#!/usr/bin/env bash
# Sites to a centre under kills: the table of docs/fleet.md (WRITE_DOCS=1 writes it there).
#
#   bench/fleet/run.sh [ROBOTS [SITES [KEYFRAMES [SECONDS [SEED]]]]]   20 3 30 30 1: a minute
#
# Real processes on multicast and TCP in a network namespace of their own: robots without a LiDAR, a
# base at each site, a NATS server, a base at the centre. About every second one of the bases or the
# server is killed (-9) and started again, as the seed says. Ends with 77 where making a namespace is
# not allowed, with 1 if a keyframe was lost or came twice. BIN, OUT: folders of programs and of
# output; LAYOUT=1 prints the table without figures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh
enter_namespace n "$@"

rows() {
  echo "| robots, sites | keyframes | kills | lost | twice | at the centre after the last one, s | a site's base, ms a keyframe | server, ms | centre's base, ms |"
  rule 9
  row "${1:-20}, ${2:-3}" 8 bench/fleet/drive.py "${BIN:-build/release/bin}" \
    "${OUT:-build/bench/fleet}" "${1:-20}" "${2:-3}" "${3:-30}" "${4:-30}" "${5:-1}"
}

table fleet rows "$@"
