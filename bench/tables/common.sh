# Functions of the scripts that write tables of figures; sourced by them in the project's folder.
#
# With LAYOUT=1 such a script runs no measurement and prints the tables that it writes with `*` in
# place of every figure: bench/tables/check.sh compares the documents with that.
# shellcheck shell=bash
shopt -s inherit_errexit

only_layout() { [ -n "${LAYOUT:-}" ]; }

# enter_namespace LETTERS ARGUMENTS...: the script once more, in namespaces of its own (unshare's
# letters), with multicast on its own loopback. Ends with 77 where making them is not allowed.
enter_namespace() {
  local letters=$1 flags
  shift
  only_layout && return
  if [ -n "${IN_NAMESPACE:-}" ]; then
    ip link set lo up
    ip route add 224.0.0.0/4 dev lo
    return
  fi
  for flags in "-$letters" "-r$letters"; do
    if unshare "$flags" true 2>/dev/null; then
      IN_NAMESPACE=1 exec unshare "$flags" "$0" "$@"
    fi
  done
  echo "SKIPPED: making a namespace is not allowed here (unshare -$letters)"
  exit 77
}

# table NAME COMMAND...: what COMMAND prints, as the table NAME; nothing is written if it fails
table() {
  local rows
  rows=$("${@:2}")
  only_layout || echo
  bench/tables/table.sh "$1" <<<"$rows"
}

# row TITLE COUNT COMMAND...: a line of a table; COMMAND prints its COUNT cells, "a | b | c"
row() {
  local cells='*' i
  if only_layout; then
    for ((i = 1; i < $2; ++i)); do cells+=' | *'; done
  else
    cells=$("${@:3}")
  fi
  echo "| $1 | $cells |"
}

# rule COLUMNS: the line below a table's header
rule() {
  local line='|' i
  for ((i = 0; i < $1; ++i)); do line+='---|'; done
  echo "$line"
}

# Name of a LiDAR in the documents.
lidar() {
  case "$1" in
    aeva-aeries2) echo "Aeva Aeries II" ;;
    livox-avia) echo "Livox Avia" ;;
    livox-mid-360) echo "Livox Mid-360" ;;
    *) echo "${1^^}" ;;
  esac
}

# The first number behind a key of a JSON file.
number() { grep -m1 "\"$2\"" "$1" | grep -oE -- '-?[0-9.]+(e-?[0-9]+)?|null' | tail -1; }
