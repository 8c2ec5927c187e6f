#!/bin/sh
# `unimapper base` and robots over UDP multicast: base_test.sh UNIMAPPER LINK_PROGRAM SCENARIO
#
# Runs in a network namespace of its own, so that nothing leaves this machine. Exit code 77 (a
# skipped test) where making one is not allowed.
set -eu

unimapper=$1
program=$2
scenario=$3
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="out err sender contents"
store=$directory/store
touch "$directory/out" "$directory/err" "$directory/sender"

# start [OPTION...]: returns once the base hears.
start() {
  : >"$directory/err"
  : >"$directory/out"
  "$unimapper" base --store "$store" --listen "$url" "$@" >>"$directory/out" 2>>"$directory/err" &
  base=$!
  children="$children $base"
  await 'listening on' err
}

# publish NAME KEYFRAMES PAUSE_MS: in the background.
publish() {
  "$program" publish "$url" "$1" "$2" 60000 "$3" 2>>"$directory/sender" >>"$directory/sender" &
  sender=$!
  children="$children $sender"
}

# stop SIGNAL: the base ends well.
stop() {
  kill -"$1" $base
  wait $base || fail "the base ended with $?"
}

# holds PATTERN: what inspect says of the store.
holds() {
  "$unimapper" inspect "$store" --check >"$directory/contents" || fail "the store is damaged"
  grep -q -- "$1" "$directory/contents" || fail "expected: $1"
}

case $scenario in
until_told)
  start
  publish alpha 10 0
  alpha=$sender
  publish beta_two 5 0
  wait $alpha $sender
  # Everything is acknowledged, so it is stored; the end, too.
  stop TERM
  grep -q 'robots 2, sessions 2 (0 open), stored 15 keyframes' "$directory/out" || fail "status"
  grep -q 'for each byte of a keyframe' "$directory/err" || fail "bytes written"
  holds 'alpha: robot 5, os2-128, 10 keyframes .* 0 missing, ended'
  holds 'beta_two: robot 8, os2-128, 5 keyframes .* 0 missing, ended'
  # Nothing changed in between: no line is printed twice.
  [ -z "$(uniq -d "$directory/out")" ] || fail "a line twice"
  ;;
number_of_sessions)
  start --sessions 1
  publish alpha 5 0
  wait $sender
  wait $base || fail "the base ended with $?"
  holds 'alpha: .* 5 keyframes .* 0 missing, ended'
  ;;
killed)
  # Three times while a robot publishes: it sends again what was not acknowledged.
  publish alpha 60 40
  for keyframes in 12 24 36; do
    start
    await "^sent $keyframes\$" sender
    kill -KILL $base
    wait $base || true
  done
  start
  wait $sender || fail "the sender failed"
  stop INT
  holds 'alpha: .* 60 keyframes .* 0 missing, ended'
  ;;
quota)
  # alpha has more than it may store, the other has not.
  start --robot-gb 0.0005
  publish alpha 30 0
  alpha=$sender
  publish beta_two 2 0
  wait $sender || fail "the other session was not delivered"
  await 'beyond a quota' err
  await 'refused [1-9]' out
  # It may have ended by itself.
  kill $alpha 2>/dev/null || true
  stop TERM
  grep -q 'refused [1-9]' "$directory/out" || fail "nothing was refused"
  grep -q 'session alpha of robot 5 is beyond a quota' "$directory/err" || fail "nothing was said"
  holds 'beta_two: .* 2 keyframes .* 0 missing, ended'
  ;;
*)
  echo "unknown scenario $scenario"
  exit 2
  ;;
esac
echo "passed"
