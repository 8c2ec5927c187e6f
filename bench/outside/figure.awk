# One figure, in percent, of all points in the files that points.awk wrote: -v figure=NAME.
BEGIN {
  if (figure == "poles") classes["pole"] = classes["traffic-sign"] = 1
  else if (figure == "ceiling") classes["building"] = classes["structure"] = 1
  else if (figure == "trucks") classes["truck"] = 1
  else if (figure == "walkers") classes["pedestrian"] = 1
  else classes["all"] = 1
  removed = figure == "DA" || figure == "walkers"
}
$1 in classes { fixed += $2; kept += $3; moved += $4; taken += $5 }
END {
  if (figure == "AA" ? fixed * moved == 0 : (removed ? moved : fixed) == 0) { print "–"; exit }
  if (figure == "AA") printf "%.2f\n", 100 * sqrt(kept / fixed * taken / moved)
  else printf "%.2f\n", 100 * (removed ? taken / moved : kept / fixed)
}
