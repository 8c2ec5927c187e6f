#!/usr/bin/env bash
# Table of figures on its way into the documents: COMMAND | bench/tables/table.sh NAME
#
# Prints the Markdown table it reads. With WRITE_DOCS=1 it also puts it into the document that has a
# line `<!-- table NAME: ... -->`, in place of what stands from there to `<!-- end of table -->`. With
# WRITE_DOCS=check it changes nothing and ends with 1 if the document holds something else. With
# LAYOUT=1 it only prints, between lines that name the table.
set -euo pipefail
name=${1:?usage: COMMAND | table.sh NAME}
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
if [ -n "${LAYOUT:-}" ]; then
  echo "<!-- table $name: layout -->"
  cat
  echo "<!-- end of table -->"
  exit 0
fi
fragment=$(mktemp)
updated=$(mktemp)
trap 'rm -f "$fragment" "$updated"' EXIT
sed '/./,$!d' >"$fragment"  # without empty lines before it
cat "$fragment"
[ -n "${WRITE_DOCS:-}" ] || exit 0

document=$(grep -lE "^<!-- table $name: .*-->\$" "$root/README.md" "$root"/docs/*.md "$root"/docs/design/*.md || true)
[ -n "$document" ] && [ "$(wc -l <<<"$document")" = 1 ] || {
  echo "error: the documents have no place, or several, for the table $name" >&2
  exit 1
}
awk -v name="$name" -v fragment="$fragment" '
  inside && $0 == "<!-- end of table -->" { inside = 0 }
  !inside
  index($0, "<!-- table " name ": ") == 1 {
    inside = 1
    while ((getline line <fragment) > 0) print line
  }' "$document" >"$updated"
cmp -s "$updated" "$document" && exit 0
if [ "$WRITE_DOCS" = check ]; then
  echo "error: the table $name of ${document#"$root"/} differs; ./dev tables writes it (in another build: BIN=build/dev/bin bench/tables/run.sh)" >&2
  diff "$document" "$updated" >&2 || true
  exit 1
fi
cat "$updated" >"$document"
echo "${document#"$root"/}: table $name written" >&2
