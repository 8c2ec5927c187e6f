# Processes of a row of the table of faults, sourced by run.sh.
# shellcheck shell=bash disable=SC2034,SC2154
#
# Each ends with this script. In the row's folder $row are its output, NAME.out and NAME.err, and its
# memory in NAME.peak.

robots_group=239.255.76.67:7667
base_group=239.255.76.68:7668
declare -A pids=()

# start NAME COMMAND...
start() {
  setpriv --pdeathsig KILL "${@:2}" >"$row/$1.out" 2>"$row/$1.err" </dev/null &
  pids[$1]=$!
  watch_memory $! >"$row/$1.peak" 2>/dev/null &
}

# watch_memory PID: its peak memory, kB, five times a second until it ends
watch_memory() {
  local key value rest peak=1
  while [ -n "$peak" ]; do
    peak=
    while read -r key value rest; do [ "$key" != VmHWM: ] || peak=$value; done <"/proc/$1/status" || return 0
    echo "$peak"
    sleep 0.2
  done
}

# await PATTERN FILE: returns once a line of the file matches
await() {
  local end=$((SECONDS + 180))
  while [ $SECONDS -lt $end ]; do
    grep -qs -- "$1" "$row/$2" && return
    sleep 0.02
  done
  echo "error: \"$1\" never appeared in $row/$2" >&2
  return 1
}

# pid_of NAME: "base" is the latest one
pid_of() {
  [ "$1" != base ] || set -- "$current_base"
  echo "${pids[$1]}"
}

# send_signal SIGNAL NAME
send_signal() { kill "-$1" "$(pid_of "$2")" 2>/dev/null || true; }

# wait_for NAME...: until they end; false if one was still there after $longest seconds and was killed
wait_for() {
  local name late=0 end=$((SECONDS + longest))
  for name; do
    while kill -0 "${pids[$name]}" 2>/dev/null && [ $SECONDS -lt $end ]; do sleep 0.05; done
    if kill -KILL "${pids[$name]}" 2>/dev/null; then
      echo "error: $name of $row did not end within $longest s" >&2
      late=1
    fi
    wait "${pids[$name]}" || true
  done
  return $late
}

kill_process() {
  send_signal KILL "$1"
  wait "$(pid_of "$1")" 2>/dev/null || true
}

# relay TO_BASE TO_ROBOTS: between robots and base, with these faults
relay() {
  base_url="udpm://$base_group?ttl=0"
  start relay bench/faults/relay.py $robots_group $base_group "$seed" "$1" "$2"
  await '^relaying' relay.out
}

# authenticated NAME...: these robots have keys, and the base takes nothing else
authenticated() {
  local name
  keys=$row/keys
  for name; do "$bin/unimapper" keys new "$name" --out "$row/$name.robot" --keys "$keys" >>"$row/keys.log"; done
}

# base: started, or started again with what it has stored
base() {
  current_base=base-$((++bases))
  start "$current_base" "$bin/unimapper" base --store "$store" \
    --listen "$base_url${receive_buffer:+&recv_buf_size=$receive_buffer}" ${keys:+--keys "$keys"}
  await 'listening' "$current_base.err"
}

# robot NAME [ARGUMENTS...]: of the generator; its session is called $session, or as the robot
robot() {
  local name=${session:-$1} arguments=("${@:2}")
  [[ " $* " == *" --keyframes "* ]] || arguments+=(--keyframes "$keyframes")
  [ -z "$keys" ] || arguments+=(--key "$row/$name.robot")
  robots+=("$row/robot-$1.out")
  start "robot-$1" "$bin/fault_robot" "$robots_url" "$name" --seed "$seed" "${arguments[@]}"
}

# onboard NAME FOLDER SPOOL: the real robot, with a simulated drive
onboard() {
  [ -e "$out/drive/dataset.json" ] || "$bin/unimapper" simulate --scene town --sensor vlp-16 \
    --route A --scans 150 --seed 3 --out "$out/drive" >"$out/drive.log" 2>&1
  robots+=("$2/run")
  start "robot-$1" "$bin/unimapper" onboard "$out/drive" --out "$2/run" --publish "$robots_url" --spool "$3"
}

# small_disk MEGABYTES: as $disk
small_disk() {
  disk=$row/disk
  mkdir -p "$disk"
  mount -t tmpfs -o "size=${1}m" tmpfs "$disk"
}

# end_row: whatever still runs. A base that is still there is told to stop.
end_row() {
  local name
  base_fell=
  kill -0 "$(pid_of base)" 2>/dev/null || base_fell=" (base ended early)"
  for name in "${!pids[@]}"; do send_signal TERM "$name"; done
  longest=60
  wait_for "${!pids[@]}"
}

# peak base|robot: the largest of them, MB
peak() { sort -n "$row/$1"-*.peak | awk 'END { printf "%.0f", $1 / 1024 }'; }
