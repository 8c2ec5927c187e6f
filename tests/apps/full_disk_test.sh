#!/bin/sh
# `unimapper onboard` whose disk of the run folder is full: full_disk_test.sh UNIMAPPER
#
# Mapping and delivery go on; what could not be written is counted and reported.
set -eu
unimapper=$1
# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../network_namespace.sh"
enter_namespace -nm "$@"
make_directory
logs="simulate.log roomy.log full.log"

"$unimapper" simulate --sensor vlp-16 --scans 60 --thin 4 --out "$directory/recording" \
  2>"$directory/simulate.log" >"$directory/simulate.out" || fail "simulate"
mkdir "$directory/disk"
# Room for a few of the sixty files of labels.
mount -t tmpfs -o size=128k tmpfs "$directory/disk" || exit 77
# shellcheck disable=SC2154
trap 'status=$?; end_processes; umount "$directory/disk"; end_test $status' EXIT

# onboard NAME FOLDER: a run there, with a spool on another disk; its exit code is $code
onboard() {
  code=0
  "$unimapper" onboard "$directory/recording" --out "$2" --spool "$directory/spool-$1" \
    2>"$directory/$1.log" || code=$?
}
onboard roomy "$directory/roomy"
[ "$code" = 0 ] || fail "a run with room ended with $code"
expect_in roomy.log '60 scans, 0 refused, 6 keyframes'
onboard full "$directory/disk/run"
expect_in full.log 'No space left on device'
expect_in full.log '60 scans, 0 refused, 6 keyframes'
expect_in full.log '6 of this run written, 0 not written'
[ "$code" = 1 ] || fail "an incomplete run folder ended with $code"
expect_in full.log 'error: .* files could not be written: .*/disk/run is incomplete'
# Nothing that is there is half there.
for file in "$directory"/disk/run/labels/*.label; do
  cmp -s "$file" "$directory/roomy/labels/$(basename "$file")" || fail "$file differs"
done
echo "passed"
