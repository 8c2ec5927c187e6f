# Rows of the table of faults, sourced by run.sh.
# shellcheck shell=bash disable=SC2034,SC2154

# Robots of the generator by default: so many keyframes, 80 kB each, ten times as often as a robot
# that moves at 1 m a keyframe would make them.
keyframes=${KEYFRAMES:-60}
kills=5 small=3600
outage="15 620 --period-ms 25 --bytes 40000" outage_title="10 min, 40 times as fast"
if [ -n "${FULL:-}" ]; then
  kills=100 small=36000
  outage="600 620 --period-ms 1000" outage_title="10 min"
fi

# Name, title, and the command that starts base, robots and what disturbs them and waits for the robots.
rows() {
  local all=drop=0.05,reorder=0.2,duplicate=0.2,flip=0.02,delay=5
  cat <<ROWS
none|none|plain
loss_5|5 % of datagrams lost|plain drop=0.05 drop=0.05
loss_30|30 % of datagrams lost|plain drop=0.3 drop=0.3
fragments|5 % of Ethernet fragments lost, datagrams of 1,300 B|plain fragments=0.05 fragments=0.05 --datagram-bytes 1300
reordered|half overtaken by up to 30 ms|plain reorder=0.5,delay=2 reorder=0.5
duplicated|half arrives twice|plain duplicate=0.5 duplicate=0.5
flipped|a bit flipped in 4 %|plain flip=0.04 flip=0.04
all|5 % lost, a fifth overtaken, a fifth twice, 2 % damaged|plain $all $all
answers_lost|80 % of the base's answers lost|plain drop=0 drop=0.8
down_1|link down for 1 s|down 1 $keyframes
down_45|link down for 45 s|down 45 500
down_600|link down for $outage_title|down $outage
base_stopped|base stopped for 10 s|base_stopped
base_killed|base killed $kills times, 5 % lost|base_killed
robot_killed|robot killed $kills times, 5 % lost|robot_killed
robot_disk_full|\`unimapper onboard\`, disk full|robot_disk_full
base_disk_full|base's disk full for 6 s|base_disk_full
same_name|two robots with one name|same_name
five_robots|five robots, 5 % lost|five_robots
default_buffers|receive buffer of 208 KiB, keyframes of 500 kB|default_buffers
many_small|five robots, ${small::-3},${small: -3} small keyframes each|many_small
onboard|\`unimapper onboard\`, 5 % lost|onboard_lossy
keyed_all|with keys, 5 % lost, a fifth overtaken, a fifth twice, 2 % damaged|keyed $all $all
ROWS
}
# row_field NAME NUMBER
row_field() {
  rows | awk -F '|' -v name="$1" -v at="$2" '$1 == name { print $at; found = 1 } END { exit !found }' ||
    { echo "unknown row $1" >&2; return 1; }
}

plain() { # plain [TO_BASE TO_ROBOTS [ROBOT_ARGUMENTS...]]: one robot through a relay
  relay "${1:-}" "${2:-}"
  base
  robot a "${@:3}"
  wait_for robot-a
}

down() { # down SECONDS KEYFRAMES [ROBOT_ARGUMENTS...]: the link, after three seconds
  plain "down=3+$1" "down=3+$1" --keyframes "$2" "${@:3}"
}

keyed() { # keyed TO_BASE TO_ROBOTS
  authenticated a
  plain "$@"
}

base_stopped() {
  relay "" ""
  base
  robot a --keyframes 150
  sleep 2
  send_signal STOP base
  sleep 10
  send_signal CONT base
  wait_for robot-a
}

base_killed() {
  relay drop=0.05 ""
  base
  robot a --keyframes $((12 * kills + 20))
  for ((i = 0; i < kills; ++i)); do
    sleep 1
    kill_process base
    base
  done
  wait_for robot-a
}

robot_killed() { # one spool, a run for each start
  relay drop=0.05 ""
  base
  for ((i = 0; i < kills; ++i)); do
    onboard "a$i" "$row/$i" "$row/spool"
    await '[1-9] keyframes' "robot-a$i.err"
    sleep "0.$((3 * i % 10))"
    kill_process "robot-a$i"
  done
  # A start waits 30 s for earlier sessions at its end; what is left then waits for the next one.
  for ((; i < kills + 4; ++i)); do
    onboard "a$i" "$row/$i" "$row/spool"
    wait_for "robot-a$i"
    awk '/of earlier sessions [0-9]+ of [0-9]+ delivered/ { left = $5 != $7 } END { exit !left }' \
      "$row/robot-a$i.err" || break
  done
}

robot_disk_full() { # that of the spool
  small_disk 2
  relay "" ""
  base
  onboard a "$row" "$disk/spool"
  wait_for robot-a
}

base_disk_full() { # all but 1 MB of it is taken for a while
  small_disk 64
  store=$disk/store
  head -c 63M /dev/zero >"$disk/other"
  relay "" ""
  base
  robot a --keyframes 100
  sleep 6
  rm "$disk/other"
  wait_for robot-a
}

same_name() {
  local session=twin
  base
  robot a
  robot b
  wait_for robot-a robot-b
}

five() { # five ROBOT_ARGUMENTS...: robots
  local name
  base
  for name in a b c d e; do robot $name "$@"; done
  wait_for robot-a robot-b robot-c robot-d robot-e
}

five_robots() {
  relay drop=0.05 drop=0.05
  five --period-ms 200 --keyframes $((keyframes / 2))
}

many_small() { five --keyframes "$small" --bytes 500 --period-ms 2.5 --waits; }

default_buffers() {
  receive_buffer=212992
  plain "" "" --bytes 500000 --period-ms 50
}

onboard_lossy() {
  relay drop=0.05 drop=0.05
  base
  onboard a "$row" "$row/spool"
  wait_for robot-a
}
