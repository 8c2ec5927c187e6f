#!/usr/bin/env bash
# Tables of the documents that need no timing: bench/tables/run.sh [--check]
#
# Writes them into the documents; with --check only compares. BIN names the folder of programs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export WRITE_DOCS=1  # LAYOUT=1 only prints
[ "${1:-}" != --check ] || WRITE_DOCS=check
bin=${BIN:-build/release/bin}

"$bin/memory_table" presets | bench/tables/table.sh memory-presets
"$bin/memory_table" parts | bench/tables/table.sh memory-parts
"$bin/memory_table" parameters | bench/tables/table.sh memory-parameters
for table in removal places times workers; do  # summaries of docs/results.md
  awk -v table="$table" -f bench/tables/summary.awk docs/results.md |
    bench/tables/table.sh summary-"$table"
done
