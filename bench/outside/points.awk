# Points by class of a result of `unimapper evaluate dynamic`, as lines
# "CLASS STATIC KEPT DYNAMIC REMOVED": counted since objects moved, or all where that is not known.
{
  if (!match($0, /[^ ]/)) next
  depth = (RSTART - 1) / 2
  if (!match($0, /"[^"]*": /)) next
  key[depth] = substr($0, RSTART + 1, RLENGTH - 4)
  value = substr($0, RSTART + RLENGTH)
  if (depth == 1 && key[1] == "since_motion" && value ~ /^\{/) since = 1
  if (key[depth] !~ /^(static_points|static_kept|dynamic_points|dynamic_removed)$/) next
  path = ""
  for (i = 1; i < depth; ++i) path = path key[i] "."
  count[path, key[depth]] = value + 0
  if (!(path in seen)) { seen[path] = 1; paths[++n] = path }
}
END {
  prefix = since ? "since_motion." : ""
  for (i = 1; i <= n; ++i) {
    name = paths[i]
    if (index(name, prefix) != 1) continue
    name = substr(name, length(prefix) + 1)
    if (name == "") name = "all."
    else if (!sub(/^by_class\./, "", name)) continue
    sub(/\.$/, "", name)
    print name, count[paths[i], "static_points"], count[paths[i], "static_kept"], \
      count[paths[i], "dynamic_points"], count[paths[i], "dynamic_removed"]
  }
}
