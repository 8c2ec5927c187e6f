#!/usr/bin/env bash
# Test of `pip install .` into a fresh environment: pip_test.sh PYTHON SOURCE BUILD
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" -m venv --system-site-packages "$folder/venv"
UNIMAPPER_BUILD_FOLDER=$3 "$folder/venv/bin/python" -m pip --disable-pip-version-check --quiet \
  install --no-index --no-build-isolation --no-cache-dir "$2"
cd "$folder"
"$folder/venv/bin/python" -c '
import sys, unimapper
assert unimapper.__file__.startswith(sys.prefix), unimapper.__file__
unimapper.Pipeline(unimapper.preset("vlp-16"))'
