#!/bin/sh
# Keys on the real link, between processes of the tool: link_test.sh UNIMAPPER
#
# A robot with a key is received, one of the same name without a key is not, and a robot whose base
# has no keys is told so. Runs in a network namespace of its own; exit code 77 (a skipped test) where
# making one is not allowed.
set -eu

unimapper=$1
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="simulate.log new.log base.log base.out.log robot7.log merge.log"

# expect PATTERN LOG
expect() { expect_in "$2.log" "$1"; }

# listen STORE OPTION...: returns once the base hears; it ends with the first session.
listen() {
  store=$directory/$1
  shift
  : >"$directory/base.log"
  "$unimapper" base --store "$store" --listen "$url" --sessions 1 "$@" \
    2>"$directory/base.log" >"$directory/base.out.log" &
  base=$!
  children="$children $base"
  await 'listening on' base.log
}

# expect_stored: the base ends well, with all keyframes of one session.
expect_stored() {
  wait "$base" || fail "the base ended with $?"
  expect '^robots 1, sessions 1 (0 open), stored 6 keyframes .* missing 0, damaged 0, refused 0$' \
    base.out
}

# merge RUN
merge() {
  "$unimapper" merge "$1" --out "$directory/map" --replace 2>"$directory/merge.log" \
    >"$directory/merge.out.log" || fail "merge of $1 ended with $?"
}

# drive NAME OPTION...: a run of that name, published.
drive() {
  name=$1
  shift
  "$unimapper" onboard "$directory/recording" --out "$directory/$name" --replace --publish "$url" \
    "$@" 2>"$directory/$name.log" || fail "onboard ended with $?"
}

"$unimapper" simulate --sensor vlp-16 --scans 60 --thin 4 --out "$directory/recording" \
  2>"$directory/simulate.log" >"$directory/simulate.out.log" || fail "simulate"
"$unimapper" keys new robot7 --out "$directory/robot7.robot" --keys "$directory/keys" \
  >"$directory/new.log"

# The forger comes first, under the name of the robot.
listen with_keys --keys "$directory/keys"
drive robot7
expect '0 of 6 keyframes acknowledged' robot7
drive robot7 --key "$directory/robot7.robot"
expect '6 of 6 keyframes acknowledged' robot7
expect_stored
expect 'refused for their keys: .* without a code' base
merge "$store"
grep -q 'robot7' "$directory/map/summary.json" || fail "the robot's session is not in the map"
grep -q 'robot7-2' "$directory/map/summary.json" && fail "the forger's session was taken"

# A base without keys receives the robot, which takes none of its answers.
listen without_keys
drive robot7 --key "$directory/robot7.robot"
expect '0 of 6 keyframes acknowledged' robot7
expect 'answers refused for their keys' robot7
expect_stored

# What was signed stays readable in the run folder.
merge "$directory/robot7"
