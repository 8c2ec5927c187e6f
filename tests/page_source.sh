#!/bin/sh
# Digest of what the page is built from: page_source.sh [--check]
#
# With --check: an error if src/page/built/page.html names another one, being built from other files.
set -eu
cd "$(dirname "$0")/../src/page"
digest=$(git ls-files -co --exclude-standard -- . ':!tests' ':!built' | LC_ALL=C sort |
  while IFS= read -r file; do [ ! -f "$file" ] || cat "$file"; done | sha256sum | cut -d' ' -f1)
if [ "${1:-}" != --check ]; then
  echo "$digest"
elif ! grep -q "^<!-- source $digest -->$" built/page.html; then
  echo "error: src/page/built/page.html was built from other files; ./dev page builds it" >&2
  exit 1
fi
