# Rows of the table of faults: the processes of each, sourced by run.sh.
# shellcheck shell=bash disable=SC2034,SC2154
#
# A row is a function that starts a base, robots and what disturbs them, and waits for the robots.

# Robots of the generator by default: so many keyframes, 80 kB each, ten times as often as a robot
# that moves at 1 m a keyframe would make them.
keyframes=${KEYFRAMES:-60}

plain() { # plain RELAY_ARGUMENTS...: one robot through a relay
  relay "$@"
  base
  robot a
  wait_for robot-a
}

row_none() { plain; }
row_loss_5() { plain --to-base drop=0.05 --to-robots drop=0.05; }
row_loss_30() { plain --to-base drop=0.3 --to-robots drop=0.3; }
row_fragments() {
  relay --to-base fragments=0.05 --to-robots fragments=0.05
  base
  robot a --datagram-bytes 1300
  wait_for robot-a
}
row_reordered() { plain --to-base reorder=0.5,delay=2 --to-robots reorder=0.5; }
row_duplicated() { plain --to-base duplicate=0.5 --to-robots duplicate=0.5; }
row_flipped() { plain --to-base flip=0.04 --to-robots flip=0.04; }
row_all() {
  local faults=drop=0.05,reorder=0.2,duplicate=0.2,flip=0.02,delay=5
  plain --to-base $faults --to-robots $faults
}
row_answers_lost() { plain --to-robots drop=0.8; }

down() { # down SECONDS KEYFRAMES [ROBOT_ARGUMENTS...]: the link, after three seconds
  relay --to-base "down=3+$1" --to-robots "down=3+$1"
  base
  robot a --keyframes "$2" "${@:3}"
  wait_for robot-a
}
row_down_1() { down 1 "$keyframes"; }
row_down_45() { down 45 500; }
row_down_600() {
  if [ -n "${FULL:-}" ]; then
    down 600 620 --period-ms 1000
  else
    down 15 620 --period-ms 25 --bytes 40000
  fi
}

row_base_stopped() {
  relay
  base
  robot a --keyframes 150
  sleep 2
  send_signal STOP base
  sleep 10
  send_signal CONT base
  wait_for robot-a
}
row_base_killed() {
  local kills=5
  [ -z "${FULL:-}" ] || kills=100
  relay --to-base drop=0.05
  base
  robot a --keyframes $((12 * kills + 20))
  for ((i = 0; i < kills; ++i)); do
    sleep 1
    kill_process base
    base
  done
  wait_for robot-a
}
row_robot_killed() {
  local kills=5
  [ -z "${FULL:-}" ] || kills=100
  relay --to-base drop=0.05
  base
  if has_spool; then
    kill_onboard "$kills"
    return
  fi
  for ((i = 0; i < kills; ++i)); do
    robot "a$i" --name a
    sleep 1.2
    kill_process "robot-a$i"
  done
  robot "a$kills" --name a --keyframes 20
  wait_for "robot-a$kills"
}
kill_onboard() { # kill_onboard TIMES: one spool, a run for each start
  drive
  for ((i = 0; i < $1; ++i)); do
    onboard "a$i" "$row/$i" "$row/spool"
    await '[1-9] keyframes' "robot-a$i.err"
    sleep "0.$((3 * i % 10))"
    kill_process "robot-a$i"
    published_by_log "a$i" "$row/$i"
  done
  # A start waits 30 s for earlier sessions at its end; what is left then waits for the next one.
  for ((; i < $1 + 4; ++i)); do
    onboard "a$i" "$row/$i" "$row/spool"
    wait_for "robot-a$i"
    published_by_log "a$i" "$row/$i"
    has_left_earlier "$row/robot-a$i.err" || break
  done
}
# has_left_earlier FILE: whether a robot says that it has not delivered all earlier sessions
has_left_earlier() {
  awk '/of earlier sessions [0-9]+ of [0-9]+ delivered/ { left = $5 != $7 } END { exit !left }' "$1"
}

row_robot_disk_full() {
  drive
  small_disk 2
  relay
  base
  # With a spool its disk is full; without one that of the run, as robots had it before.
  local run=$disk
  ! has_spool || run=$row
  onboard a "$run" "$disk/spool"
  wait_for robot-a
  published_by_log a "$run"
}
row_base_disk_full() {
  small_disk 64
  store=$disk/store
  # All but 1 MB of it is taken for a while.
  head -c 63M /dev/zero >"$disk/other"
  relay
  base
  robot a --keyframes 100
  sleep 6
  rm "$disk/other"
  wait_for robot-a
}

row_same_name() {
  base
  robot a --name twin
  robot b --name twin
  wait_for robot-a robot-b
}
row_five_robots() {
  relay --to-base drop=0.05 --to-robots drop=0.05
  base
  for name in a b c d e; do robot $name --period-ms 200 --keyframes $((keyframes / 2)); done
  wait_for robot-a robot-b robot-c robot-d robot-e
}
row_default_buffers() {
  receive_buffer=212992
  relay
  base
  robot a --bytes 500000 --period-ms 50
  wait_for robot-a
}
row_many_small() {
  local each=3600
  [ -z "${FULL:-}" ] || each=36000
  base
  for name in a b c d e; do
    robot $name --keyframes $each --bytes 500 --period-ms 2.5 --waits
  done
  wait_for robot-a robot-b robot-c robot-d robot-e
}
row_onboard() {
  drive
  relay --to-base drop=0.05 --to-robots drop=0.05
  base
  onboard a "$row" "$row/spool"
  wait_for robot-a
  published_by_log a "$row"
}

forged() { # forged KIND [FORGER_ARGUMENTS...]: one robot and a forger beside it
  base
  forger "$@"
  robot a
  wait_for robot-a
}
forgeries="forged_pieces forged_sessions forged_end forged_ends forged_name forged_keyframes
  replayed flood_pieces flood_keyframes forged_answers"
row_forged_pieces() { forged bad-pieces; }
row_forged_sessions() { forged sessions; }
row_forged_end() { forged ended; }
row_forged_ends() { forged ended-again; }
row_forged_name() { forged renamed; }
row_forged_keyframes() { forged shifted; }
row_replayed() { forged replay --seconds 12; }
row_flood_pieces() { forged pieces --seconds 8; }
row_flood_keyframes() { forged keyframes --seconds 8; }
row_forged_answers() { forged acknowledgements; }

# The same with keys, which the forger has not.
for kind in $forgeries; do
  eval "row_keyed_$kind() { authenticated a; row_$kind; }"
done
row_keyed_all() {
  authenticated a
  row_all
}
# The forger is a robot with a key of its own.
insider() { # insider KIND
  authenticated a outsider
  forged "$1" --key "$row/outsider.robot"
}
row_insider_keyframes() { insider shifted; }
row_insider_answers() { insider acknowledgements; }

# title ROW
title() {
  local minutes="10 min, 40 times as fast"
  [ -z "${FULL:-}" ] || minutes="10 min"
  local times=5 small=3,600
  [ -z "${FULL:-}" ] || times=100 small=36,000
  case "$1" in
    none) echo "none" ;;
    loss_5) echo "5 % of datagrams lost" ;;
    loss_30) echo "30 % of datagrams lost" ;;
    fragments) echo "5 % of Ethernet fragments lost, datagrams of 1,300 B" ;;
    reordered) echo "half overtaken by up to 30 ms" ;;
    duplicated) echo "half arrives twice" ;;
    flipped) echo "a bit flipped in 4 %" ;;
    all) echo "5 % lost, a fifth overtaken, a fifth twice, 2 % damaged" ;;
    answers_lost) echo "80 % of the base's answers lost" ;;
    down_1) echo "link down for 1 s" ;;
    down_45) echo "link down for 45 s" ;;
    down_600) echo "link down for $minutes" ;;
    base_stopped) echo "base stopped for 10 s" ;;
    base_killed) echo "base killed $times times, 5 % lost" ;;
    robot_killed) echo "robot killed $times times, 5 % lost" ;;
    robot_disk_full) echo "\`unimapper onboard\`, disk full" ;;
    base_disk_full) echo "base's disk full for 6 s" ;;
    same_name) echo "two robots with one name" ;;
    five_robots) echo "five robots, 5 % lost" ;;
    default_buffers) echo "receive buffer of 208 KiB, keyframes of 500 kB" ;;
    many_small) echo "five robots, $small small keyframes each" ;;
    onboard) echo "\`unimapper onboard\`, 5 % lost" ;;
    forged_pieces) echo "forged: bad last piece of every keyframe" ;;
    forged_sessions) echo "forged: 200 sessions" ;;
    forged_end) echo "forged: end of the session, once" ;;
    forged_ends) echo "forged: its end, ten times a second" ;;
    forged_name) echo "forged: its start with another name" ;;
    forged_keyframes) echo "forged: its keyframes, 500 m away, first" ;;
    replayed) echo "forged: all again, 20 MB/s" ;;
    flood_pieces) echo "forged: pieces, 20 MB/s" ;;
    flood_keyframes) echo "forged: keyframes of 32 images, 20 MB/s" ;;
    forged_answers) echo "forged: everything is stored" ;;
    keyed_*) echo "with keys, $(title "${1#keyed_}")" ;;
    insider_keyframes) echo "with keys, forged by another robot: its keyframes, 500 m away, first" ;;
    insider_answers) echo "with keys, forged by another robot: everything is stored" ;;
    *) echo "unknown row $1" >&2; return 1 ;;
  esac
}

all_rows="none loss_5 loss_30 fragments reordered duplicated flipped all answers_lost down_1 down_45
  down_600 base_stopped base_killed robot_killed robot_disk_full base_disk_full same_name five_robots
  default_buffers many_small onboard $forgeries keyed_all"
for kind in $forgeries; do all_rows+=" keyed_$kind"; done
all_rows+=" insider_keyframes insider_answers"
