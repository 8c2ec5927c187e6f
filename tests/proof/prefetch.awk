# Prefetch instructions per function, out of `objdump -dr --no-show-raw-insn -C`.
#
#   objdump ... | awk -f prefetch.awk RULES -
#
# RULES: FUNCTION LEAST, see prefetch_rules.txt. Instructions count if they can be reached from the
# function: what nobody calls is no use.

# "unimapper::A::f(int) [clone .part.0]+0x12" -> without offset and addend
function bare(name) {
  sub(/[-+]0x[0-9a-f]+$/, "", name)
  return name
}

# Adds up everything reachable from `name` within `class`, or that is called prefetch-something.
function reach(name, class,    i, to, sum) {
  if (name in seen) return 0
  seen[name] = 1
  sum = prefetches[name]
  for (i = 1; i <= callees[name]; ++i) {
    to = callee[name, i]
    if (index(to, class) || to ~ /prefetch[a-z_]*[(]/) sum += reach(to, class)
  }
  return sum
}

function add_call(to) {
  to = bare(to)
  if (to == current || (current, to) in known) return
  known[current, to] = 1
  callee[current, ++callees[current]] = to
}

FILENAME == ARGV[1] {
  sub(/#.*/, "")
  if (NF == 2) { rule[++rules] = $1; least[rules] = $2 }
  next
}
/^[0-9a-f]+ <.*>:$/ {
  current = $0
  sub(/^[0-9a-f]+ </, "", current)
  sub(/>:$/, "", current)
  function_name[++functions] = current
  next
}
# A call with its target in the same section, and one that the linker will resolve.
/\t(call|jmp|bl|b|blx|b[.][nw])[ \t].*</ { to = $0; sub(/^[^<]*</, "", to); sub(/>[^>]*$/, "", to); add_call(to) }
/\tR_[A-Z0-9_]+[ \t]/ || /: R_[A-Z0-9_]+[ \t]/ { to = $0; sub(/^.*R_[A-Z0-9_]+[ \t]+/, "", to); add_call(to) }
# x86-64, 64-bit ARM, 32-bit ARM
/\t(prefetch[a-z0-9]*|prfu?m|pldw?)[ \t]/ { ++prefetches[current] }

END {
  if (functions == 0) { print "error: no function at all: the listing was not understood"; exit 1 }
  for (r = 1; r <= rules; ++r) {
    class = rule[r]
    sub(/[^:]*$/, "", class)
    found = sum = 0
    split("", seen)
    for (i = 1; i <= functions; ++i) {
      if (!index(function_name[i], rule[r] "(") && !index(function_name[i], rule[r] "<")) continue
      ++found
      sum += reach(function_name[i], class)
    }
    if (!found) {
      print "error: there is no " rule[r]
    } else if (sum < least[r]) {
      print "error: " sum " prefetch instructions in " rule[r] ", not " least[r]
    } else {
      print sum " in " rule[r]
      continue
    }
    failed = 1
  }
  exit failed
}
