#!/bin/sh
# A robot in C on the real link: link_test.sh ROBOT LISTENER UNIMAPPER SCENARIO
#
# Runs in a network namespace of its own, so that nothing leaves this machine. Exit code 77 (a
# skipped test) where making one is not allowed.
set -eu

robot=$1
listener_program=$2
unimapper=$3
scenario=$4
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="result progress robot keys base contents"
touch "$directory/result" "$directory/progress" "$directory/robot"

# drive SPOOL KEY KEYFRAMES END
drive() { "$robot" "$url" "$@" >"$directory/robot" 2>&1 || fail "the robot ended with $?"; }

# listen SESSIONS: returns once the listener hears.
listen() {
  "$listener_program" listen "$url" "$1" >"$directory/result" 2>"$directory/progress" &
  listener=$!
  children="$children $listener"
  await '^listening' progress
}

case $scenario in
restarted_robot)
  # Nobody listens to the first start, which ends without a word: the next one delivers both.
  drive "$directory/spool" - 4 abandon
  expect_in robot '^published=4 acknowledged=0 lost=0 ended=0'
  listen 2
  drive "$directory/spool" - 3 finish
  expect_in robot '^published=3 acknowledged=3 lost=0 ended=1 clock=1 refused=none'
  expect_in robot '^earlier: sessions=1 delivered=1 keyframes=4 acknowledged=4 lost=0'
  wait "$listener"
  expect_in result 'end=sessions malformed=0'
  # The listener tells two sessions of one name apart.
  expect_in result '^c_robot\(-2\)\{0,1\} keyframes=3 missing=0 damaged=0 ended'
  expect_in result '^c_robot\(-2\)\{0,1\} keyframes=4 missing=0 damaged=0 ended'
  drive "$directory/spool" - 0 abandon
  expect_in robot '^earlier: sessions=0 '
  ;;
keys)
  # What the key's robot signs and authenticates, a base with keys takes, and no other's.
  "$unimapper" keys new robot7 --out "$directory/robot7.robot" --keys "$directory/folder" \
    >"$directory/keys" || fail "no key"
  "$unimapper" base --store "$directory/store" --listen "$url" --sessions 1 \
    --keys "$directory/folder" >"$directory/result" 2>"$directory/base" &
  base=$!
  children="$children $base"
  await 'listening on' base
  drive - - 2 finish
  expect_in robot '^published=2 acknowledged=0 lost=2 ended=0'
  drive - "$directory/robot7.robot" 3 finish
  expect_in robot '^published=3 acknowledged=3 lost=0 ended=1 clock=1 refused=none'
  wait "$base" || fail "the base ended with $?"
  expect_in result '^robots 1, sessions 1 (0 open), stored 3 keyframes .* missing 0, damaged 0, refused 0$'
  "$unimapper" inspect "$directory/store" >"$directory/contents" || fail "the store cannot be read"
  expect_in contents 'c_robot: .* 3 keyframes .* 0 missing, ended'
  ;;
*)
  echo "unknown scenario $scenario"
  exit 2
  ;;
esac
echo "passed"
