#!/bin/sh
# Handles of what `unimapper onboard` shares: share_doorbell_test.sh UNIMAPPER LINK_PROGRAM
#
# Consumers that wait for LCM alone take keyframes, labels and health. Runs in a network namespace of
# its own; exit code 77 (a skipped test) where making one is not allowed.
set -eu

unimapper=$1
program=$2
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="simulate.log onboard.log keyframe.log labels.log health.log"
share="doorbell$$"

# consume TOPIC CONTENT MESSAGES: returns once it waits.
consume() {
  "$program" consume "$url" "$share" "$3" "$1" "$2" >"$directory/$1" 2>"$directory/$1.log" &
  consumers="$consumers $!"
  children="$children $!"
  await '^waiting' "$1.log"
}

"$unimapper" simulate --sensor vlp-16 --scans 50 --thin 4 --out "$directory/recording" \
  2>"$directory/simulate.log" >"$directory/simulate.out" || fail "simulate"
consumers=
for log in keyframe labels health; do : >"$directory/$log.log"; done
consume keyframe 0x00030001 2
consume labels 0x00030002 20
consume health 0x00030003 2
"$unimapper" onboard "$directory/recording" --out "$directory/run" --realtime --share "$share" \
  --share-doorbell "$url" 2>"$directory/onboard.log" || fail "onboard ended with $?"
for consumer in $consumers; do wait "$consumer" || fail "a consumer ended with $?"; done
expect_in onboard.log ' 0 allocations'
for topic in keyframe labels health; do expect_in "$topic" '^taken=[0-9]* missed=[0-9]* woken=yes'; done
expect_in keyframe '^taken=[2-9] '

# A network that is none is refused before anything is mapped, and nothing stays in /dev/shm.
if "$unimapper" onboard "$directory/recording" --out "$directory/none" --share "$share" \
  --share-doorbell none:// 2>"$directory/onboard.log"; then
  fail "a doorbell without a network was accepted"
fi
expect_in onboard.log '"none://": LCM knows udpm'
if ls /dev/shm | grep -q "$share"; then fail "the share was left in /dev/shm"; fi
echo "passed"
