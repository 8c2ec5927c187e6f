#!/usr/bin/env bash
# Citation check of the documents and comments: citations.sh [SOURCE_TREE]
#
# In README.md and docs/**.md: targets of relative links, files in `backquotes`, commands of ./dev,
# and identifiers in `backquotes` (each part of `a::b.c` must occur in a source file); in sources, the documents named
# in comments. Prints what is missing and ends with 1 if anything is.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${1:-$here/../..}"

missing=0
checked=0

complain() { echo "$1 names $2, which does not exist" >&2; missing=$((missing + 1)); }

files=$(find . \( -name .git -o -name build -o -name 'build-*' -o -name demo -o -name node_modules \) -prune -o -type f -print |
  sed 's#^\./##' | grep -v '^tests/architecture/upward/' | LC_ALL=C sort)
documents=$(grep -E '^(README\.md|docs/.*\.md)$' <<<"$files")
sources=$(grep -E '\.(c|h|cpp|hpp|sh|cmake|lcm|json)$|CMakeLists\.txt$|^dev$|^\.ci/' <<<"$files")

# named FILE WHERE...: a file or folder, relative to one of the folders WHERE, or a bare name.
named() {
  local name=$1 folder
  shift
  for folder in "$@"; do [ ! -e "$folder/$name" ] || return 0; done
  [[ $name != */* ]] && grep -qE "(^|/)${name//./\\.}\$" <<<"$files"
}

# matches PATTERN FILE: what matches, without repetitions.
matches() { grep -oE "$1" "$2" | LC_ALL=C sort -u || true; }

# shellcheck disable=SC2086
words=$(cat $sources | grep -oE '[A-Za-z_][A-Za-z0-9_]*' | LC_ALL=C sort -u)

for document in $documents; do
  folder=$(dirname "$document")
  while read -r target; do
    checked=$((checked + 1))
    [ -e "$folder/$target" ] || complain "$document" "$target"
  done < <(matches '\]\([^)#: ]+[)#]' "$document" | sed 's/^](//; s/[)#]$//')

  while read -r file; do
    checked=$((checked + 1))
    # Built, or beside the project.
    case $file in build/* | ../shared/*) continue ;; esac
    named "$file" . include include/unimapper src ports docs "$folder" || complain "$document" "$file"
  done < <(matches '`[A-Za-z0-9_./-]+`' "$document" | tr -d '`' |
    grep -E '^(include|src|ports|bench|tests|docs|toolchains|\.ci)/|\.(hpp|cpp|h|c|sh|cmake|lcm)$' || true)

  while read -r command; do
    checked=$((checked + 1))
    grep -q "^  $command) " dev 2>/dev/null || complain "$document" "./dev $command"
  done < <(matches '\./dev [a-z]+' "$document" | cut -d' ' -f2)

  identifiers=$(matches '`[A-Za-z_][A-Za-z0-9_]*((::|\.|->)[A-Za-z_][A-Za-z0-9_]*)*(\(\))?`' "$document" |
    sed 's/::\|->/ /g' | tr '`.()' '    ' | xargs -n 1 | LC_ALL=C sort -u)
  checked=$((checked + $(wc -w <<<"$identifiers")))
  while read -r word; do
    [ -z "$word" ] || complain "$document" "$word"
  done < <(LC_ALL=C comm -23 <(echo "$identifiers") <(echo "$words"))
done

while IFS=: read -r source document; do
  checked=$((checked + 1))
  [ -e "$document" ] || complain "$source" "$document"
done < <(
  # shellcheck disable=SC2086
  grep -oE '(^|[^./a-zA-Z_])docs/[A-Za-z0-9_/-]+\.(md|c|cpp)' $sources |
    sed -E 's/:[^:]*docs/:docs/' | grep -v '^tests/architecture/' | sort -u)

echo "$checked names in documents, $missing of them missing"
[ "$checked" -gt 0 ] && [ "$missing" = 0 ]
