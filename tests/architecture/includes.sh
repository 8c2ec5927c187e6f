#!/usr/bin/env bash
# Layering check of the #include lines: includes.sh [SOURCE_TREE]
#
# Reads the layers from rooms.txt beside this file, prints every include that does not follow them,
# and ends with 1 if there is one. Installed headers may include no header of src. Rooms that run on
# the robot may, besides, include nothing but Eigen and the standard library.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${1:-$here/../..}"

files=$(find . -path './build*' -prune -o -regex '\./\(include\|src\|ports\|bench\)/.*\.[ch]\(pp\)?' -print |
  sed 's#^\./##' | LC_ALL=C sort)
# shellcheck disable=SC2086
awk '
  function room_of(path,   folder, best) {
    best = ""
    for (folder in owner)
      if ((path == folder || index(path, folder "/") == 1) && length(folder) > length(best))
        best = folder
    return best
  }
  function normal(path,   parts, kept, n, i, k) {  # removes "x/.." and "."
    n = split(path, parts, "/"); k = 0
    for (i = 1; i <= n; ++i) {
      if (parts[i] == "." || parts[i] == "") continue
      if (parts[i] == ".." && k > 0) { --k; continue }
      kept[++k] = parts[i]
    }
    path = kept[1]
    for (i = 2; i <= k; ++i) path = path "/" kept[i]
    return path
  }
  function complain(text) { printf "%s:%d: %s\n", FILENAME, FNR, text; ++faults }
  function check(target,   to) {
    to = room_of(target)
    if (to == "") return complain(target " belongs to no room of rooms.txt")
    if (FILENAME ~ /^(include|ports)\/.*\.h(pp)?$/ && target ~ /^src\//)
      return complain("an installed header must not include " target)
    if (owner[to] == owner[from] || (owner[from], target) in allowed) return
    if (layer[owner[to]] >= layer[owner[from]])
      return complain(owner[from] " must not include " target " (" owner[to] " is not below it)")
    if (hidden[to] && (owner[from] != "bench" || owner[to] == "apps"))
      complain(target " is private to " owner[to])
  }
  FILENAME == rooms {
    if ($0 ~ /^#/ || NF == 0) next
    if ($1 == "!") { allowed[$2, $3] = 1; next }
    layer[$2] = $1; secret = 0
    for (i = 3; i <= NF; ++i)
      if ($i == ":") secret = 1; else { owner[$i] = $2; hidden[$i] = secret }
    next
  }
  FILENAME == list { exists[$0] = 1; files[++count] = $0; next }
  FNR == 1 {
    from = room_of(FILENAME)
    if (from == "") complain("this file belongs to no room of rooms.txt")
    onboard = owner[from] ~ /^(core|free_space|odometry|place|onboard)$/
  }
  from == "" { next }
  /^[ \t]*#[ \t]*include[ \t]*["<]/ {
    ++includes
    name = $0; sub(/^[^"<]*["<]/, "", name); sub(/[">].*/, "", name)
    beside = FILENAME; sub(/[^\/]*$/, "", beside); beside = normal(beside name)
    if (beside in exists) check(beside)
    else if (("include/" name) in exists) check("include/" name)
    else if (normal(name) in exists) check(normal(name))
    else if ($0 ~ /include[ \t]*"/ || name ~ /^unimapper\//) complain("there is no " name)
    else if (onboard && name ~ /[.\/]/ && name !~ /^Eigen\//)
      complain(owner[from] " runs on the robot and must not include <" name ">")
  }
  END {
    printf "%d includes in %d files, %d against the layers\n", includes, count, faults
    exit faults > 0
  }
' rooms="$here/rooms.txt" list=- "$here/rooms.txt" - $files <<<"$files"
