#!/usr/bin/env bash
# Glossary check: every name in its column "in the code" occurs in the sources.
#
#   glossary.sh ROOT
set -euo pipefail
cd "$1"
names=$(awk -F'|' '/^\| / && NF >= 7 { print $5 }' docs/glossary.md | grep -oE '`[A-Za-z_0-9]+`' |
  tr -d '`' | sort -u)
[ -n "$names" ] || { echo "error: no names in docs/glossary.md" >&2; exit 1; }
missing=$(echo "$names" | while read -r name; do
  grep -rqw --include='*.hpp' --include='*.lcm' -- "$name" include src ports || echo "$name"
done)
[ -z "$missing" ] || { printf 'docs/glossary.md names what no header declares: %s\n' $missing; exit 1; }
