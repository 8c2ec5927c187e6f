# Functions of the tests that run processes in a namespace of their own; sourced by them.
# shellcheck shell=sh
#
# A test calls enter_namespace first, then make_directory. $directory is its folder, which is
# removed at the end; $logs are the files in it that a failure prints.

# enter_namespace NETWORK_FLAGS ARGUMENT...: runs this script again with its arguments in new
# namespaces ("-n": network; "-nm": mounts too), so that nothing leaves this machine. Exit code 77 (a skipped
# test) where that is not allowed.
enter_namespace() {
  [ -z "${IN_NAMESPACE:-}" ] || return 0
  flags=$1
  shift
  if unshare "$flags" true 2>/dev/null; then
    IN_NAMESPACE=1 exec unshare "$flags" "$0" "$@"
  elif unshare "-r${flags#-}" true 2>/dev/null; then
    IN_NAMESPACE=1 exec unshare "-r${flags#-}" "$0" "$@"
  fi
  echo "SKIPPED: making a namespace is not allowed here (unshare $flags)"
  exit 77
}

# make_directory: $directory, and LCM's multicast on the loopback of this namespace. Only processes
# of this script are ended, each by its number, which it adds to $children.
make_directory() {
  ip link set lo up
  ip route add 224.0.0.0/4 dev lo
  directory=$(mktemp -d)
  children=
  logs=
  trap 'end_test $?' EXIT
}

# end_test STATUS: a test that ends without a word, where a command failed, shows its logs as well.
end_test() {
  end_processes
  if [ "$1" -ne 0 ] && [ "$1" -ne 77 ]; then
    echo "FAILED: ended with $1"
    for log in $logs; do
      echo "--- $log"
      cat "$directory/$log" 2>/dev/null || true
    done
  fi
  rm -rf "$directory"
}

end_processes() {
  for child in $children; do kill -KILL "$child" 2>/dev/null || true; done
}

fail() {
  echo "FAILED: $1"
  exit 1
}

# await PATTERN FILE: returns once a line matches, however slow the machine is today.
await() {
  tries=0
  until grep -q -- "$1" "$directory/$2"; do
    tries=$((tries + 1))
    [ $tries -lt 1000 ] || fail "never seen in $2: $1"
    sleep 0.05
  done
}

# expect_in FILE PATTERN
expect_in() { grep -q -- "$2" "$directory/$1" || fail "expected in $1: $2"; }
