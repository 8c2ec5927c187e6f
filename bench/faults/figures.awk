# Cells of a row: awk -v peaks="BASE / ROBOT" -f figures.awk STORED ROBOT...
#
# STORED has a line "stored NAME" for every keyframe of the base, a robot's file a line "published NAME"
# for each of its own, and what it counted. A keyframe whose bytes differ has another name.
FNR == 1 { ++file }
file == 1 && $1 == "stored" {
  sub(/^stored /, "")
  ++stored[$0]
  next
}
$1 == "published" {
  sub(/^published /, "")
  ++sent
  if ($0 in stored) {
    ++here
    duplicated += stored[$0] - 1
    ++of_robot[file]
  }
  next
}
$1 == "acknowledged" { acknowledged[file] = $2 }
$1 == "catch_up" { times[file] = $2; if ($2 > slowest) slowest = $2 }
$1 == "backlog" { backlogs[file] = 1 }
END {
  if (sent == 0) {
    print "error: no robot published a keyframe" >"/dev/stderr"
    exit 1
  }
  for (file in acknowledged)
    if (acknowledged[file] > of_robot[file]) falsely += acknowledged[file] - of_robot[file]
  for (file in backlogs) {
    ++reported
    if (!(file in times)) never = 1
  }
  catch_up = reported == 0 ? "–" : never ? "never" : sprintf("%.1f", slowest)
  printf "%d | %d | %d | %d | %d | %s | %s", sent, here, sent - here, duplicated, falsely, peaks, catch_up
}
