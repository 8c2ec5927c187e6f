#!/bin/sh
# Robots that hear where they are in a map: base_localise_test.sh UNIMAPPER plain|keys|merging
#
# One robot's run is merged to a map; another one drives while `unimapper base --localise` listens,
# and the last it hears must be what `unimapper localise` says of the same keyframe. Merging: both
# drive at once, and `unimapper base --merge` makes the map of what they send. Runs in a
# network namespace of its own, so that nothing leaves this machine. Exit code 77 (a skipped test)
# where making one is not allowed.
set -eu

unimapper=$1
scenario=$2
url='udpm://239.255.76.67:7667?ttl=0'

# shellcheck source=tests/network_namespace.sh
. "$(dirname "$0")/../network_namespace.sh"
enter_namespace -n "$@"
make_directory
logs="said out err robot answers"
store=$directory/store
touch "$directory/out" "$directory/err"

# run ARGUMENT...: ends well.
run() { "$unimapper" "$@" >"$directory/said" 2>&1 || fail "unimapper $1 ended with $?"; }

# record NAME ROUTE SCANS: a simulated recording of the same streets.
record() {
  run simulate --scene streets --sensor vlp-16 --seed 1 --route "$2" --scans "$3" \
    --out "$directory/$1-data"
}

# start OPTION...: the base; returns once it hears.
start() {
  "$unimapper" base --store "$store" --listen "$url" "$@" \
    >>"$directory/out" 2>>"$directory/err" &
  base=$!
  children="$children $base"
  await 'listening on' err
}

# start_localising [OPTION...]: returns once the base has looked for a map.
start_localising() {
  start --localise "$@"
  await 'robots are \(not \)\{0,1\}localised' err
}

# stop: the base ends well.
stop() {
  kill -TERM $base
  wait $base || fail "the base ended with $?"
}

# last_value KEY FILE: of the last such key in a JSON file.
last_value() { sed -n "s/.*\"$1\": \"\{0,1\}\([^\",]*\).*/\1/p" "$directory/$2" | tail -n 1; }

# position FILE KEYFRAME: x y z of T_map_odometry by that keyframe.
position() {
  awk -v keyframe="$2" '
    /"keyframe":/ { here = $2 + 0 == keyframe }
    here && /"T_map_odometry":/ { getline x; getline y; getline z; print x + 0, y + 0, z + 0; exit }
  ' "$directory/$1"
}

record monday A 140
record tuesday B 140

if [ "$scenario" = merging ]; then
  start --merge
  for name in monday tuesday; do
    "$unimapper" onboard "$directory/$name-data" --out "$directory/$name" --realtime \
      --publish "$url" >"$directory/robot-$name" 2>&1 &
    children="$children $!"
    eval "$name=\$!"
  done
  wait "$monday" || fail "a robot ended with $?"
  wait "$tuesday" || fail "a robot ended with $?"
  stop
  logs="$logs robot-monday robot-tuesday"
  # How far the base is by then is a matter of this machine.
  expect_in robot-monday "in the base's map: "
  expect_in robot-tuesday "in the base's map: "
  expect_in err 'epoch 1: merged 2 of 2 sessions'
  expect_in err 'merged [0-9]* times, .* s after it was stored at the latest'
  run map check --store "$store"
  run map export --store "$store" --out "$directory/map"
  echo "passed"
  exit 0
fi

run onboard "$directory/monday-data" --out "$directory/monday"
run map create --store "$store"

# Without a map the base says so, and receives as ever.
start_localising
stop
expect_in err 'robots are not localised: .*unimapper map merge'

run map add --store "$store" "$directory/monday"
run map merge --store "$store"
set --
if [ "$scenario" = keys ]; then
  run keys new robot7 --out "$directory/robot7.robot" --keys "$directory/keys"
  start_localising --keys "$directory/keys"
  set -- --key "$directory/robot7.robot"
else
  start_localising
fi
"$unimapper" onboard "$directory/tuesday-data" --out "$directory/tuesday" --realtime \
  --publish "$url" "$@" >"$directory/robot" 2>&1 || fail "the robot ended with $?"
stop
expect_in robot "in the base's map: localised in the map of epoch 2 by"
expect_in err 'tuesday (robot [0-9]*) is localised in the map of epoch 2 by .* m, after'
expect_in err 'localised by [0-9]* keyframes; [0-9]* came after later ones and 0 could not be used'

# The robot was told what its run says afterwards, 0.3 m at most beside it.
sed -n '/"map_pose": {/,/^    }/p' "$directory/tuesday/stats.json" >"$directory/told"
[ "$(last_value state told)" = localised ] || fail "the robot is not localised"
keyframe=$(last_value keyframe told)
"$unimapper" localise "$directory/tuesday" --store "$store" --epoch 2 --json \
  >"$directory/answers" 2>"$directory/said" || fail "unimapper localise ended with $?"
echo "$(position told "$keyframe") $(position answers "$keyframe")" | awk '
  NF != 6 { exit 1 }
  { far = sqrt(($1 - $4) ^ 2 + ($2 - $5) ^ 2 + ($3 - $6) ^ 2); print far " m apart"; exit far > 0.3 }
' || fail "the robot was told another place"
echo "passed"
