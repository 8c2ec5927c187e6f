# Worst-case stack depth from the call graphs that GCC writes (-fcallgraph-info=su,da).
#
#   awk -v entries='REGEX' -v limit=BYTES -f stack.awk RULES GRAPH.ci...
#
# Prints, for every function whose demangled name matches `entries`, the deepest chain of calls
# below it. Fails above `limit`, and on everything that makes a bound impossible: recursion, frames
# of unknown size, calls through pointers, functions whose code is not here. RULES lists the
# exceptions and their cost (see stack_rules.txt).

function complain(text) {
  if (text in said) return
  said[text] = 1
  print "error: " text
  failed = 1
}

# The text between the quotes after `key`.
function field(line, key,    at, rest) {
  at = index(line, key ": \"")
  if (at == 0) return ""
  rest = substr(line, at + length(key) + 3)
  return substr(rest, 1, index(rest, "\"") - 1)
}

# Labels of compiler-made clones lack their name.
function readable(name) { return label[name] ~ /^[A-Za-z_]/ ? label[name] : name }

# An explicit instantiation is listed under its file, called under its name alone.
# A complete constructor is often the same code as the one for a base class; the graph knows one.
function defined_name(name,    other) {
  if (name in frame) return name
  if (name in instance) return instance[name]
  other = name
  if ((sub(/C1E/, "C2E", other) || sub(/D1E/, "D2E", other)) && other in frame) return other
  return name
}

function add_node(line,    name, short, text, part, count, bytes) {
  name = field(line, "title")
  text = field(line, "label")
  count = split(text, part, "\\\\n")
  if (count < 3 || part[3] !~ / bytes \(/) return  # only declared here
  bytes = part[3] + 0
  label[name] = part[1]
  short = name
  if (sub(/^.*:_Z/, "_Z", short)) instance[short] = name
  if (!(name in frame) || bytes > frame[name]) frame[name] = bytes
  if (part[3] ~ /\(dynamic\)/) unbounded[name] = 1
}

function add_edge(line,    from, to) {
  from = field(line, "sourcename")
  to = field(line, "targetname")
  if (to == "__indirect_call") to = to " at " field(line, "label")
  if ((from, to) in known) return
  known[from, to] = 1
  callee[from, ++callees[from]] = to
}

function indirect_cost(from, to,    i, name, worst, cost) {
  for (i = 1; i <= indirects; ++i) {
    if (readable(from) !~ indirect_caller[i] && to !~ indirect_caller[i]) continue
    if (indirect_target[i] == "user") return external_bytes
    worst = 0
    for (name in frame) {
      if (readable(name) !~ indirect_target[i]) continue
      if (name in active) { complain("recursion: " readable(from) " and " readable(name)); continue }
      cost = depth_of(name)
      if (cost > worst) { worst = cost; below[from, to] = name }
    }
    if (worst == 0) complain("no function matches the rule for the indirect call in " readable(from))
    return worst + between[i]
  }
  complain("call through a pointer in " readable(from) to)
  return 0
}

function levels_of(name,    i) {
  for (i = 1; i <= recursions; ++i) if (name ~ recursion_name[i]) return recursion_levels[i]
  complain("recursion: " readable(name))
  return 1
}

function depth_of(name,    i, to, cost, worst, levels) {
  if (name in depth) return depth[name]
  if (!(name in frame)) {
    if (!(name in external)) complain("nothing is known about " name)
    return depth[name] = external_bytes
  }
  if (name in unbounded) complain("the frame has no fixed size: " readable(name))
  active[name] = 1
  levels = 1
  worst = 0
  for (i = 1; i <= callees[name]; ++i) {
    to = callee[name, i]
    if (to ~ /^__indirect_call/) {
      cost = indirect_cost(name, to)
    } else {
      to = defined_name(to)
      if (to == name) { levels = levels_of(name); continue }
      if (to in active) { complain("recursion: " readable(name) " and " readable(to)); continue }
      cost = depth_of(to)
    }
    if (cost > worst) { worst = cost; deepest[name] = to }
  }
  delete active[name]
  frames[name] = frame[name] * levels
  return depth[name] = frames[name] + worst
}

function print_path(name) {
  while (name != "") {
    printf "  %7d  %s\n", (name in frame) ? frames[name] : depth[name], readable(name)
    if (!(name in frame)) return
    name = ((name, deepest[name]) in below) ? below[name, deepest[name]] : deepest[name]
  }
}

FILENAME == ARGV[1] {
  sub(/#.*/, "")
  if ($1 == "external") { external_bytes = $2; for (i = 3; i <= NF; ++i) external[$i] = 1 }
  if ($1 == "recursion") { recursion_name[++recursions] = $2; recursion_levels[recursions] = $3 }
  if ($1 == "indirect") { indirect_caller[++indirects] = $2; indirect_target[indirects] = $3; between[indirects] = $4 }
  next
}
/^node:/ { add_node($0) }
/^edge:/ { add_edge($0) }

END {
  for (name in frame) {
    if (label[name] !~ entries) continue
    ++count
    total = depth_of(name)
    if (total > limit) complain(total " bytes, more than " limit ": " label[name])
    if (total > worst_total) { worst_total = total; worst_name = name }
  }
  if (count == 0) complain("no function matches " entries)
  printf "%d functions; the deepest needs %d bytes of %d:\n", count, worst_total, limit
  print_path(worst_name)
  exit failed
}
