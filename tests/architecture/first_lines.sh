#!/usr/bin/env bash
# Check of the first line of every file.
#
#   first_lines.sh PATH...    text files below these paths
#
# It is a comment that names what the file contains: at most 100 columns, no question. Prints one
# line per finding and fails if there is any.
set -euo pipefail

# Text files, without negative controls.
files=$(find "$@" -type f \( -name '*.[ch]' -o -name '*.[ch]pp' -o -name '*.md' -o -name '*.sh' \
  -o -name '*.cmake' -o -name '*.awk' -o -name '*.gnuplot' -o -name '*.py' -o -name dev -o -path .ci/run \) \
  ! -path 'tests/architecture/headless/*' ! -path 'tests/architecture/upward/*' ! -path '*/node_modules/*' | sort)
[ -n "$files" ] || { echo "error: no files to check" >&2; exit 1; }

headings=$(echo "$files" | xargs awk '
  # A file that begins with "#!" is described by its second line.
  FNR == 1 && /^#!/ { next }
  { if (FNR > 2 || done == FILENAME) nextfile; done = FILENAME }
  {
    if (FILENAME ~ /\.([hc]|[hc]pp)$/) mark = "^(//|/[*]) ?"
    else if (FILENAME ~ /\.(sh|awk|gnuplot|cmake|md)$/ || FILENAME ~ /^(dev|\.ci\/run)$/) mark = "^# "
    else if (FILENAME ~ /\.py$/) mark = "^\"\"\""
    else nextfile
    # A source file that begins with its own header is described there.
    own = FILENAME
    sub(/.*\//, "", own)
    if (sub(/\.cpp$/, ".hpp", own) && $0 ~ "^#include .*[\"</]" own "[\">]") nextfile
    if ($0 !~ mark "[^ ]") print FILENAME ":1: does not begin with a comment that names its contents"
    else if (length($0) > 100) print FILENAME ":1: first line longer than 100 columns"
    else if ($0 ~ /\?/ || tolower($0) ~ questions)
      print FILENAME ":1: first line is no noun phrase: " $0
  }' questions='^(//|/[*]|#) ?(what|who|where|how|which|when|whether|why|whatever|everything|nothing|nobody)([^a-z_]|$)')

[ -z "$headings" ] || { echo "$headings"; exit 1; }
