# Processes of a row of the table of faults, sourced by run.sh.
# shellcheck shell=bash disable=SC2034,SC2154
#
# Each runs below fault_process, which writes its number, its end and its memory to NAME.process in
# the row's folder $row, and ends it if this script ends. Output is in NAME.out and NAME.err.

robots_group=239.255.76.67:7667
base_group=239.255.76.68:7668
declare -A wrappers=()

# start NAME COMMAND...
start() {
  local name=$1
  "$bin/fault_process" "$row/$name.process" "${@:2}" >"$row/$name.out" 2>"$row/$name.err" </dev/null &
  wrappers[$name]=$!
}

# await PATTERN FILE: returns once a line of the file matches
await() {
  local tries
  for ((tries = 0; tries < 1000; ++tries)); do
    grep -qs -- "$1" "$row/$2" && return
    sleep 0.02
  done
  echo "error: \"$1\" never appeared in $row/$2" >&2
  return 1
}

runs() { kill -0 "${wrappers[$1]}" 2>/dev/null; }

# send_signal SIGNAL NAME
send_signal() {
  [ "$2" != base ] || set -- "$1" "$current_base"
  await '^pid' "$2.process"
  kill "-$1" "$(awk '$1 == "pid" { print $2 }' "$row/$2.process")" 2>/dev/null || true
}

# wait_for NAME...: until they end; false if one was still there after $longest seconds and was killed
wait_for() {
  local name ended=0 end=$((SECONDS + longest))
  for name; do
    while runs "$name" && [ $SECONDS -lt $end ]; do sleep 0.05; done
    if runs "$name"; then
      echo "error: $name of $row did not end within $longest s" >&2
      send_signal KILL "$name"
      ended=1
    fi
    wait "${wrappers[$name]}" || true
  done
  return $ended
}

kill_process() {
  local name=$1
  [ "$name" != base ] || name=$current_base
  send_signal KILL "$name"
  wait "${wrappers[$name]}" || true
}

# relay ARGUMENTS...: between robots and base
relay() {
  base_url="udpm://$base_group?ttl=0"
  start relay "$bin/fault_relay" --robots $robots_group --base $base_group --seed "$seed" "$@"
  await '^relaying' relay.out
}

# authenticated NAME...: these robots have keys, and the base takes nothing else
authenticated() {
  local name
  keys=$row/keys
  for name; do
    "$bin/unimapper" keys new "$name" --out "$row/$name.robot" --keys "$keys" >>"$row/keys.log"
  done
}

# base: started, or started again with what it has stored
base() {
  local url=$base_url
  [ -z "$receive_buffer" ] || url="$url&recv_buf_size=$receive_buffer"
  current_base=base-$((++bases))
  start "$current_base" "$bin/unimapper" base --store "$store" --listen "$url" \
    ${keys:+--keys "$keys"}
  await 'listening' "$current_base.err"
}

# robot NAME [--name SESSION] [ARGUMENTS...]: of the generator
robot() {
  local process=robot-$1 name=$1
  shift
  if [ "${1:-}" = --name ]; then
    name=$2
    shift 2
  fi
  case " $* " in
    *" --keyframes "*) ;;
    *) set -- --keyframes "$keyframes" "$@" ;;
  esac
  [ -z "$keys" ] || set -- --key "$row/$name.robot" "$@"
  start "$process" "$bin/fault_robot" "$robots_url" "$name" --finish-s 20 --seed "$seed" "$@"
}

# drive: a simulated recording
drive() {
  [ -e "$out/drive/dataset.json" ] || "$bin/unimapper" simulate --scene town --sensor vlp-16 \
    --route A --scans 150 --seed 3 --out "$out/drive" >"$out/drive.log" 2>&1
}

has_spool() { grep -q -- '--spool ' <<<"$("$bin/unimapper" onboard --help)"; }

# onboard NAME FOLDER SPOOL: the real robot, with that drive; keyframes kept in SPOOL if it can do that
onboard() {
  local spool=()
  ! has_spool || spool=(--spool "$3")
  start "robot-$1" "$bin/unimapper" onboard "$out/drive" --out "$2/run" --publish "$robots_url" \
    "${spool[@]}"
}

# published_by_log NAME FOLDER: what that robot says it made, as fault_robot writes it
published_by_log() {
  {
    "$bin/fault_base" log "$2/run/keyframes.lcmlog" || true
    # The first is this session's, those below are of its parts and of earlier sessions.
    sed -n '/^ *"keyframes_acknowledged": *\([0-9]*\),*$/ { s//acknowledged \1/p; q }' \
      "$2/run/stats.json" || true
  } >"$row/robot-$1.out" 2>>"$row/robot-$1.err"
}

# forger KIND [ARGUMENTS...]
forger() {
  start forger "$bin/fault_forger" "$robots_url" "$@"
  await '^forging' forger.out
  [ "$1" != sessions ] || sleep 0.5
}

# small_disk MEGABYTES: as $disk
small_disk() {
  disk=$row/disk
  mkdir -p "$disk"
  mount -t tmpfs -o "size=${1}m" tmpfs "$disk"
}

# end_row: whatever still runs. A base that is still there is told to stop, so that it says what it has.
end_row() {
  local name
  base_fell=
  runs "$current_base" || base_fell=yes
  send_signal TERM "$current_base"
  for name in "${!wrappers[@]}"; do
    [ "$name" = "$current_base" ] || send_signal TERM "$name"
  done
  longest=60
  wait_for "${!wrappers[@]}"
  "$bin/fault_base" store "$store" >"$row/$current_base.out"
  [ -z "$disk" ] || umount "$disk"
}
