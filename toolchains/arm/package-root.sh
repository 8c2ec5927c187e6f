#!/usr/bin/env bash
# Unpacks the libraries of packages-root.txt for another architecture into
# build/package-roots/ARCHITECTURE: package-root.sh ARCHITECTURE (arm64, armhf)
#
# The machine's own package database is neither changed nor read: apt works in a directory of its
# own, with the machine's sources. `dpkg --add-architecture` would not do, because LCM's packages
# for two architectures exclude one another. Needs no root; a root that is complete is left alone.
set -euo pipefail
architecture=${1:?usage: package-root.sh ARCHITECTURE}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
list="$here/packages-root.txt"
roots="$(cd "$here/../.." && pwd)/build/package-roots"
root="$roots/$architecture"
stamp="$root/complete"

cmp -s "$list" "$stamp" && exit 0

work="$roots/$architecture.partial"
rm -rf "$work"
mkdir -p "$work/apt/lists/partial" "$work/apt/cache/archives/partial" "$work/packages" "$work/root"
: >"$work/apt/status"
trap 'rm -rf "$work"' EXIT

apt() {
  apt-get -qq -o APT::Architecture="$architecture" -o APT::Architectures="$architecture" \
    -o Dir::State="$work/apt" -o Dir::State::lists="$work/apt/lists" \
    -o Dir::State::status="$work/apt/status" -o Dir::Cache="$work/apt/cache" \
    -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none -o Acquire::Retries=2 \
    -o Acquire::http::Timeout=30 -o Acquire::https::Timeout=30 -o APT::Update::Post-Invoke::= \
    "$@"
}

fail() {
  echo "error: $1" >&2
  echo "what apt said:" >&2
  sed 's/^/  /' "$work/log" >&2
  exit 1
}

# Sources that do not know the architecture make apt complain; what counts is whether the packages
# can be had.
apt update >"$work/log" 2>&1 || true
mapfile -t packages < <(sed 's/#.*//; s/[[:space:]]*$//; /^$/d' "$list")
(cd "$work/packages" && apt download "${packages[@]}") >>"$work/log" 2>&1 ||
  fail "the packages for $architecture cannot be downloaded: is there a network, and do the sources in /etc/apt offer $architecture?"
for package in "$work"/packages/*.deb; do
  dpkg-deb -x "$package" "$work/root" 2>>"$work/log" || fail "$(basename "$package") is damaged"
done
rm -rf "$root"
mv "$work/root" "$root"
cp "$list" "$stamp"
