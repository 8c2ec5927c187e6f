# Summary of the tables of docs/results.md, as Markdown: -v table=removal|places|times|workers
#
# README.md and the summary of docs/results.md show what this prints: figures of the runs that wrote the tables.

# number(cell, k): the k-th figure of "99.65 / 93.42 / 96.47".
function number(text, k,   parts) { split(text, parts, "/"); return parts[k] + 0 }

# show(title, name, row): a row's online and refined labels.
function show(title, name, row) {
  printf "| %s | %s | %s |\n", title, cell[name, row, 2], cell[name, row, 4]
}

# The LiDAR of the lowest AA online.
function show_worst(scene, name,   row, worst) {
  worst = 2
  for (row = 2; row <= rows[name]; ++row)
    if (number(cell[name, row, 2], 3) < number(cell[name, worst, 2], 3)) worst = row
  show(scene ", worst of " rows[name] - 1 " LiDARs: " cell[name, worst, 1], name, worst)
}

function removal() {
  print "| SA / DA / AA % | online | refined |\n|---|---|---|"
  show("KITTI raw 0005, labelled points", "removal-recording", 2)
  show_worst("town", "removal-town")
  show_worst("campus", "removal-campus")
}

function places(   row, name, group, drive, count, i) {
  name = "places-groups"
  for (row = 2; row <= rows[name]; ++row) {
    drive = cell[name, row, 1]
    group = cell[name, row, 2]
    if (!(group in known)) { known[group] = 1; groups[++count] = group }
    f1[group, drive] = substr(cell[name, row, 4], 1, 5)
    accepted[drive] += number(cell[name, row, 6], 1)
    wrong[drive] += number(cell[name, row, 6], 2)
  }
  print "| F1 by pose: same direction / reverse | town | campus |\n|---|---|---|"
  for (i = 1; i <= count; ++i)
    printf "| %s | %s / %s | %s / %s |\n", groups[i], f1[groups[i], "town B"],
      f1[groups[i], "town C"], f1[groups[i], "campus B"], f1[groups[i], "campus C"]
  printf "| accepted right / wrong | %d / %d | %d / %d |\n",
    accepted["town B"] + accepted["town C"], wrong["town B"] + wrong["town C"],
    accepted["campus B"] + accepted["campus C"], wrong["campus B"] + wrong["campus C"]
}

# show_times(title): a row of keyframes, with its longest call, and with two workers.
function show_times(title,   row, call, both) {
  for (row = 2; row <= rows["keyframes"] && cell["keyframes", row, 1] != title; ++row) {}
  for (call = 2; call <= rows["latency-calls"] && cell["latency-calls", call, 1] != title; ++call) {}
  for (both = 2; both <= rows["latency-workers"] && cell["latency-workers", both, 1] != title; ++both) {}
  printf "| %s | %s | %s | %s | %s | %s |\n", title, cell["keyframes", row, 7],
    cell["keyframes", row, 5], cell["keyframes", row, 6], last(cell["latency-calls", call, 2]),
    cell["latency-workers", both, 3]
}

function workers(   row) {
  print "| removal and description of a keyframe (a second), p50 on a shared x86-64 server, ms | 1 core | 2 cores |\n|---|---|---|"
  for (row = 2; row <= rows["latency-workers"]; ++row)
    if (cell["latency-workers", row, 1] ~ /^(OS2-128|VLP-16, there and back|KITTI raw 0005, there and back)$/)
      printf "| %s | %s | %s |\n", cell["latency-workers", row, 1], cell["latency-workers", row, 2], cell["latency-workers", row, 3]
}

# The last of "2.4 / 9.8 / 27.3 / 30.6".
function last(figures,   parts) { return parts[split(figures, parts, " / ")] }

function times() {
  print "| ms per keyframe of one second, p50 / p99 | ingest | removal | description | longest call | removal and description, 2 workers: p50 |\n|---|---|---|---|---|---|"
  show_times("OS2-128")
  show_times("OS2-128, dense street (seed 3)")
  show_times("KITTI raw 0005, there and back")
}

/^<!-- table [a-z0-9-]+: / { name = $3; sub(/:$/, "", name) }
/^<!-- end of table -->$/ { name = "" }
name != "" && /^\|/ && !/^\|---/ {
  columns = split($0, parts, / *\| */)
  ++rows[name]
  for (i = 2; i < columns; ++i) cell[name, rows[name], i - 1] = parts[i]
}

END {
  if (table == "removal") removal()
  else if (table == "places") places()
  else if (table == "times") times()
  else if (table == "workers") workers()
  else exit 2
}
