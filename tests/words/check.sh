#!/usr/bin/env bash
# Vocabulary check: superseded words, and the first line of every file.
#
#   check.sh ROOT ROOMS    files below the paths that the file ROOMS lists, relative to ROOT
#
# Superseded words are those of superseded.txt, less the uses that allowed.txt permits. The first
# line of a source file is a comment that names what the file contains: at most 100 columns, no
# question. Prints one line per finding and fails if there is any.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$1
rooms=$(cd "$(dirname "$2")" && pwd)/$(basename "$2")
cd "$root"

rules() { grep -v '^#' "$1" | grep -v '^$' || true; }

# Text files of the listed rooms. The glossary and this folder name the superseded words; negative
# controls and seeded bugs are no prose.
files=$(rules "$rooms" | while read -r path; do
  [ -e "$path" ] || { echo "error: $path of $rooms does not exist" >&2; exit 1; }
  find "$path" -type f \( -name '*.[ch]' -o -name '*.[ch]pp' -o -name '*.md' -o -name '*.sh' \
    -o -name '*.cmake' -o -name '*.txt' -o -name '*.awk' -o -name '*.gnuplot' -o -name '*.lcm' \
    -o -name '*.in' -o -name '*.json' -o -name '*.py' -o -name dev -o -path .ci/run \) \
    ! -path docs/glossary.md ! -path 'tests/words/*' ! -path 'tests/mutations/*' \
    ! -path 'tests/architecture/upward/*' ! -path '*/node_modules/*'
done | sort -u)
[ -n "$files" ] || { echo "error: no files to check" >&2; exit 1; }

# Hits as PATH:LINE:TEXT; a path is checked like a line of its own (line 0).
hits() {
  local patterns
  patterns=$(rules "$here/superseded.txt" | cut -f1)
  echo "$files" | xargs grep -EinH -e "$patterns" /dev/null || true
  echo "$files" | grep -Ei -e "$patterns" | sed 's/.*/&:0:&/' || true
}

words=$(hits | awk -v superseded="$here/superseded.txt" -v allowed="$here/allowed.txt" '
  BEGIN {
    while ((getline line < superseded) > 0)
      if (line !~ /^#/ && split(line, part, "\t") == 2) term[tolower(part[1])] = part[2]
    while ((getline line < allowed) > 0)
      if (line !~ /^#/ && split(line, part, "\t") == 2) { path[++n] = part[1]; use[n] = tolower(part[2]) }
  }
  {
    file = $0; sub(/:.*/, "", file)
    text = tolower(substr($0, length(file) + 2)); sub(/^[0-9]+:/, "", text)
    for (i = 1; i <= n; ++i) if (file ~ path[i]) gsub(use[i], "", text)
    for (pattern in term)
      if (text ~ pattern) { print $0 "  -> " term[pattern]; break }
  }')

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

[ -z "$words$headings" ] || { printf '%s\n' "$words" "$headings" | grep .; exit 1; }
