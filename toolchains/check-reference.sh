#!/usr/bin/env bash
# API reference by Doxygen, and what is missing in it: check-reference.sh
#
# Writes build/reference/html. Every warning is an error, but for undocumented functions that say by
# themselves what they are: operators and constructors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p build/reference
log=build/reference/warnings.log
doxygen toolchains/Doxyfile >build/reference/doxygen.log 2>&1 || true
[ -e build/reference/html/index.html ] || { cat build/reference/doxygen.log; exit 1; }
self_evident='operator|Member (~?([A-Z][A-Za-z]*)\(.*\)( noexcept)? \(function\) of (class|struct) [a-z_:]*\2 )'
grep -E ': (warning|error): ' "$log" | sed "s#^$PWD/##" |
  grep -vE "is not documented\.\$" >build/reference/faults.log || true
grep -E 'is not documented\.$' "$log" | sed "s#^$PWD/##" |
  grep -vE "$self_evident" >>build/reference/faults.log || true
cat build/reference/faults.log
echo "API reference: build/reference/html/index.html, $(wc -l <build/reference/faults.log) faults"
[ ! -s build/reference/faults.log ]
