#!/usr/bin/awk -f
# Times of test cases out of ctest's log: case_times.awk LastTest.log
#
# Prints "SECONDS, tab, TEST, tab, CASE" for every case of Catch, and without CASE for other tests,
# slowest first. A case that is entered once for each of its sections counts with the sum.
BEGIN { sort = "sort -rn" }
/^[0-9]+\/[0-9]+ Test: / { test = $0; sub(/^[^:]*: /, "", test); cases = 0; delete time; next }
/^[0-9]+\.[0-9]+ s: / {
  name = $0
  sub(/^[^:]*: /, "", name)
  time[name] += $1
  ++cases
  next
}
/^Test time = / {
  if (cases == 0) printf "%.3f\t%s\t\n", $4, test | sort
  for (name in time) printf "%.3f\t%s\t%s\n", time[name], test, name | sort
}
