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

expect() { expect_in result "$1"; }

case $scenario in
two_robots)
  listen 2
  "$program" publish "$url" alpha 12 60000 0 &
  first=$!
  "$program" publish "$url" beta_two 12 60000 0 &
  second=$!
  children="$children $first $second"
  wait $first $second $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=12 missing=0 damaged=0 ended equal'
  expect '^beta_two keyframes=12 missing=0 damaged=0 ended equal'
  ;;
small_datagrams)
  listen 1
  "$program" publish "$url" alpha 5 1300 0
  wait $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
empty_session)
  # Whoever announces and ends a session without a keyframe does not end the listening.
  listen 1
  "$program" publish "$url" ghost 0 60000 0
  sleep 3
  "$program" publish "$url" alpha 5 60000 0
  wait $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
late_listener)
  # What was sent before anybody listened is sent again.
  "$program" publish "$url" alpha 60 60000 50 2>"$directory/sender" &
  sender=$!
  children="$children $sender"
  await '^sent 5$' sender
  listen 1
  wait $sender $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=60 missing=0 damaged=0 ended equal'
  ;;
evicted_keyframes)
  # What was sent before anybody listened and found no room is missed, and the listener knows how
  # much.
  "$program" publish "$url" alpha 60 60000 50 1000 2>"$directory/sender" &
  sender=$!
  children="$children $sender"
  await '^sent 5$' sender
  listen 1
  wait $sender $listener
  expect 'end=sessions'
  expect '^alpha keyframes=[1-9][0-9]* missing=[1-9][0-9]* damaged=0 ended equal'
  ;;
stopped_listener)
  # The kernel's buffer overflows while the base stands still.
  listen 1
  "$program" publish "$url" alpha 100 60000 20 2>"$directory/sender" &
  sender=$!
  children="$children $sender"
  await '^sent 20$' sender
  kill -STOP $listener
  sleep 2
  kill -CONT $listener
  wait $sender $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=100 missing=0 damaged=0 ended equal'
  ;;
told_to_stop)
  # A signal interrupts the waiting for messages; what has arrived is kept.
  listen 2
  "$program" publish "$url" alpha 5 60000 0
  kill -TERM $listener
  wait $listener || fail "the listener ended with an error"
  expect 'end=stopped'
  expect '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
doorbell)
  # A consumer in another process is woken by handles alone; what it takes is in shared memory.
  share="link$$"
  "$program" consume "$url" "$share" 20 >"$directory/result" 2>"$directory/progress" &
  consumer=$!
  children="$children $consumer"
  await '^waiting' progress
  "$program" share "$url" "$share" 20 20
  wait $consumer
  rm -f "/dev/shm/unimapper.$share.numbers"*
  expect '^taken=20 missed=0 woken=yes'
  ;;
killed_robot)
  # Its session stays open, and what has arrived is kept.
  listen 1
  "$program" publish "$url" alpha 1000 60000 50 &
  sender=$!
  await '^alpha [1-9]' progress
  kill -KILL $sender
  wait $sender || true
  kill -TERM $listener
  wait $listener || fail "the listener ended with an error"
  expect 'end=stopped'
  expect '^alpha keyframes=[1-9][0-9]* missing=[0-9]* damaged=0 open equal'
  ;;
restarted_robot)
  # Nobody listened, then the robot was killed: its next start delivers what was on its disk.
  "$program" publish "$url" alpha 1000 60000 20 64000000 "$directory/spool" 2>"$directory/sender" &
  sender=$!
  children="$children $sender"
  await '^sent 30$' sender
  kill -KILL $sender
  wait $sender || true
  listen 1
  "$program" resume "$url" "$directory/spool" >"$directory/resumed"
  wait $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=[23][0-9] missing=0 damaged=0 ended equal'
  grep -q '^sessions=1 delivered=1 keyframes=\([0-9]*\) acknowledged=\1 lost=0$' \
    "$directory/resumed" || fail "not all was delivered: $(cat "$directory/resumed")"
  "$program" resume "$url" "$directory/spool" >"$directory/resumed"
  grep -q '^sessions=0 ' "$directory/resumed" || fail "a delivered session is delivered again"
  ;;
logger)
  # What lcm-logger writes we read.
  LCM_DEFAULT_URL="$url&recv_buf_size=4194304" lcm-logger -q "$directory/log" \
    >"$directory/progress" 2>&1 &
  logger=$!
  children="$children $logger"
  # It says nothing when it is ready.
  sleep 2
  "$program" publish "$url" alpha 5 60000 20
  sleep 1
  kill -INT $logger
  wait $logger || true
  "$program" read "$directory/log" >"$directory/result"
  expect '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
logplayer)
  # What we write lcm-logplayer plays.
  "$program" write "$directory/log" alpha 5
  listen 1
  lcm-logplayer --lcm-url="$url" "$directory/log" >/dev/null
  wait $listener
  expect 'end=sessions malformed=0'
  expect '^alpha keyframes=5 missing=0 damaged=0 ended equal'
  ;;
*)
  echo "unknown scenario $scenario"
  exit 2
  ;;
esac
echo "passed"
cat "$directory/result"
