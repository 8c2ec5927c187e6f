#!/bin/sh
# The real link, between processes, over UDP multicast: link_test.sh PROGRAM SCENARIO
#
# Runs in a network namespace of its own, so that nothing leaves this machine. Exit code 77 (a
# skipped test) where making one is not allowed.
set -eu

program=$1
scenario=$2
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="result progress"
touch "$directory/result" "$directory/progress" "$directory/sender"

# listen SESSIONS: returns once the listener hears. It ends with its sessions, or when told to stop.
listen() {
  "$program" listen "$url" "$1" >"$directory/result" 2>"$directory/progress" &
  listener=$!
  children="$children $listener"
  await '^listening' progress
}

publish() { "$program" publish "$url" "$@" 2>"$directory/sender"; }

# start_publishing ARGUMENT...: in the background.
start_publishing() {
  "$program" publish "$url" "$@" 2>>"$directory/sender" &
  sender=$!
  children="$children $sender"
}

kill_sender() {
  kill -KILL "$sender"
  wait "$sender" || true
}

# expect_whole KEYFRAMES: the listener ended with this session, all of it.
expect_whole() {
  wait "$listener"
  expect_in result 'end=sessions malformed=0'
  expect_in result "^alpha keyframes=$1 missing=0 damaged=0 ended equal"
}

case $scenario in
two_robots)
  # One of them with datagrams that no network fragments.
  listen 2
  start_publishing alpha 12 60000 0
  start_publishing beta_two 5 1300 0
  expect_whole 12
  expect_in result '^beta_two keyframes=5 missing=0 damaged=0 ended equal'
  ;;
empty_session)
  # Whoever announces and ends a session without a keyframe does not end the listening.
  listen 1
  publish ghost 0 60000 0
  sleep 3
  publish alpha 5 60000 0
  expect_whole 5
  ;;
late_listener)
  # What was sent before anybody listened is sent again.
  start_publishing alpha 60 60000 50
  await '^sent 5$' sender
  listen 1
  expect_whole 60
  ;;
stopped_listener)
  # The kernel's buffer overflows while the base stands still.
  listen 1
  start_publishing alpha 100 60000 20
  await '^sent 20$' sender
  kill -STOP "$listener"
  sleep 2
  kill -CONT "$listener"
  expect_whole 100
  ;;
killed_robot)
  # Its session stays open. A signal ends the waiting for messages; what has arrived is kept.
  listen 1
  start_publishing alpha 1000 60000 50
  await '^alpha [1-9]' progress
  kill_sender
  kill -TERM "$listener"
  wait "$listener" || fail "the listener ended with an error"
  expect_in result 'end=stopped'
  expect_in result '^alpha keyframes=[1-9][0-9]* missing=[0-9]* damaged=0 open equal'
  ;;
restarted_robot)
  # Nobody listened, then the robot was killed: its next start delivers what was on its disk.
  start_publishing alpha 1000 60000 20 "$directory/spool"
  await '^sent 30$' sender
  kill_sender
  listen 1
  "$program" resume "$url" "$directory/spool" >"$directory/resumed"
  expect_whole '[23][0-9]'
  grep -q '^sessions=1 delivered=1 keyframes=\([0-9]*\) acknowledged=\1 lost=0$' \
    "$directory/resumed" || fail "not all was delivered: $(cat "$directory/resumed")"
  "$program" resume "$url" "$directory/spool" >"$directory/resumed"
  expect_in resumed '^sessions=0 '
  ;;
logger)
  # What lcm-logger writes we read.
  LCM_DEFAULT_URL="$url&recv_buf_size=4194304" lcm-logger -q "$directory/log" \
    >"$directory/progress" 2>&1 &
  logger=$!
  children="$children $logger"
  # It says nothing when it is ready.
  sleep 2
  publish alpha 5 60000 20
  sleep 1
  kill -INT $logger
  wait $logger || true
  "$program" read "$directory/log" >"$directory/result"
  expect_in result '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
logplayer)
  # What we write lcm-logplayer plays.
  "$program" write "$directory/log" alpha 5
  listen 1
  lcm-logplayer --lcm-url="$url" "$directory/log" >/dev/null
  expect_whole 5
  ;;
*)
  echo "unknown scenario $scenario"
  exit 2
  ;;
esac
echo "passed"
cat "$directory/result"
