# Number of object classes that are more than `goal` percent worse in the files after
# labels=refined on the command line than in those before: SA or DA of at least 1,000 points. Input
# as of points.awk.
$1 == "all" { next }
{
  classes[$1] = 1
  all[labels, $1, "SA"] += $2; right[labels, $1, "SA"] += $3
  all[labels, $1, "DA"] += $4; right[labels, $1, "DA"] += $5
}
function accuracy(of, class, figure) {
  return 100 * right[of, class, figure] / all[of, class, figure]
}
function is_below(class, figure) {
  if (all["", class, figure] < 1000 || all["refined", class, figure] < 1000) return 0
  return accuracy("refined", class, figure) < accuracy("", class, figure) - goal
}
END {
  for (class in classes) if (is_below(class, "SA") || is_below(class, "DA")) ++below
  print below + 0
}
