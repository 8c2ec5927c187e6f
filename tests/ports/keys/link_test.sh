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
logs="simulate.log new.log base.log robot7.log merge.log"

# expect PATTERN LOG
expect() { expect_in "$2.log" "$1"; }

# listen OPTION...: returns once the base hears.
listen() {
  : >"$directory/base.log"
  "$unimapper" merge --listen "$url" --idle-timeout 60 --out "$directory/map" --replace "$@" \
    2>"$directory/base.log" >"$directory/base.out.log" &
  listener=$!
  children="$children $listener"
  await 'listening on' base.log
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
listen --keys "$directory/keys"
drive robot7
expect '0 of 6 keyframes acknowledged' robot7
drive robot7 --key "$directory/robot7.robot"
expect '6 of 6 keyframes acknowledged' robot7
wait "$listener" || fail "merge ended with $?"
expect 'robot7 6/6 ended' base
expect 'refused for their keys: .* without a code' base
grep -q 'robot7-2' "$directory/map/summary.json" && fail "the forger's session was taken"

# A base without keys receives the robot, which takes none of its answers.
listen
drive robot7 --key "$directory/robot7.robot"
expect '0 of 6 keyframes acknowledged' robot7
expect 'answers refused for their keys' robot7
wait "$listener" || fail "merge ended with $?"
expect 'robot7 6/6 ended' base

# What was signed stays readable in the run folder.
"$unimapper" merge "$directory/robot7" --out "$directory/map" --replace 2>"$directory/merge.log" \
  >"$directory/merge.out.log" || fail "merge of the run folder"
