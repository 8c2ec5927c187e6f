# Tables of docs/results.md out of those that the benchmark of places prints: -v table=NAME
#
# Besides: -v scenes, seeds, sizes and recordings (words), variants (lines); layout=1 reads nothing
# and shows `*` for every figure.
BEGIN {
  FS = " *[|] *"
  group_count = split("same LiDAR,wide-wide,wide-narrow,narrow-narrow", groups, ",")
}

# A table's first cell is its title, without what is the same in all of its kind.
!/^[|]/ { title = ""; next }
title == "" {
  title = $2
  sub(/: database$/, "", title)
  sub(/ \(counts: sum\)$/, "", title)
  sub(/, among .*/, ", ablation", title)
  next
}
/^[|]---/ { next }
{
  key = title ~ /, mean$/ ? $2 " " $3 : $2
  for (i = 2; i < NF; ++i) cell[title, key, i] = $i
}

function known(title, key) { return layout || (title, key, 2) in cell }
# at(title, key, k): the k-th field of a row; the first cell is the second.
function at(title, key, k) { return layout ? "*" : cell[title, key, k] }
function line(text) { print "| " text " |" }
function rule(columns,   text) { for (text = "|"; columns-- > 0;) text = text "---|"; print text }

# means(columns): a row per scene, route and group, "k" being a column of ours, "sk" one of STD's
function means(columns,   s, r, g, c, n, scene_count, scene, routes, column, ours, key, text) {
  n = split(columns, column, " ")
  scene_count = split(scenes, scene, " ")
  split("B C", routes, " ")
  for (s = 1; s <= scene_count; ++s) for (r = 1; r <= 2; ++r) for (g = 1; g <= group_count; ++g) {
    ours = scene[s] ", mean"
    key = groups[g] " " routes[r]
    if (!known(ours, key)) continue
    text = scene[s] " " routes[r] " | " groups[g]
    for (c = 1; c <= n; ++c)
      text = text " | " (column[c] ~ /^s/ ? at(scene[s] ", STD, mean", key, substr(column[c], 2)) \
                                          : at(ours, key, column[c]))
    line(text)
  }
}

function ours() {
  line("seed " seeds ", route | LiDARs | rows | by pose: F1 / AUC / R at P = 1 | by view | by distance, 10 m | accepted right / wrong | error m / deg | repeatability 0.5 / 0.3 m")
  rule(9)
  means("4 8 9 6 11 12 13")
}

function unseen() {
  line("seed " seeds ", route | LiDARs | by pose: F1 / AUC / R at P = 1 | by view | accepted right / wrong")
  rule(5)
  means("8 9 11")
}

function baseline() {
  line("seed " seeds ", route | LiDARs | STD by pose: F1 / AUC / R at P = 1 | accepted right / wrong | error m / deg | repeatability | ms describe / search | ours by pose | right / wrong | ms")
  rule(10)
  means("s8 s11 s12 s13 s14 8 11 14")
}

function parts(   s, v, n, scene_count, scene, variant, title) {
  line("F1 by pose / by view / R at P = 1 by view | same LiDAR | wide-wide | wide-narrow | narrow-narrow | search ms")
  rule(6)
  scene_count = split(scenes, scene, " ")
  n = split(variants, variant, "\n")
  for (s = 1; s <= scene_count; ++s) for (v = 1; v <= n; ++v) {
    title = scene[s] ", ablation"
    if (!known(title, variant[v])) continue
    line(scene[s] ": " variant[v] " | " at(title, variant[v], 3) " | " at(title, variant[v], 4) \
      " | " at(title, variant[v], 5) " | " at(title, variant[v], 6) " | " at(title, variant[v], 8))
  }
}

function recorded(   n, i, name, title, key, positives) {
  line("database and queries, and how far a true place may be | queries with a true place | accepted right / wrong | STD: right / wrong")
  rule(4)
  n = split(recordings, name, " ")
  for (i = 1; i <= n; ++i) {
    title = name[i]
    key = title == "hilti_hall" ? "generic" : "hdl-64e"
    if (!known(title, key)) continue
    positives = at(title, key, 5)
    sub(/ .*/, "", positives)
    line(shown[name[i]] " | " positives " | " at(title, key, 11) " | " at(title ", STD", key, 11))
  }
}
BEGIN {
  shown["kitti_0001"] = "KITTI raw 0001, even against odd scans; 10 m"
  shown["kitti_0005a"] = "KITTI raw 0005, even against odd scans; 10 m"
  shown["hilti_hall"] = "indoor hall, first against second half; 8 m"
}

function thousands(count) {
  return count < 1000 ? count : int(count / 1000) sprintf(",%03d", count % 1000)
}
function time_and_share(title, places) {
  if (layout) return "* | *"
  if (!known(title, places)) return " | "
  return at(title, places, 4) " / " at(title, places, 5) " | " at(title, places, 6)
}
function scale(   n, i, size) {
  line("places | robot: query p50 / p99 ms | found % | base: query p50 / p99 ms | found %")
  rule(5)
  n = split(sizes, size, " ")
  for (i = 1; i <= n; ++i) {
    if (!known("base, places", size[i])) continue
    line(thousands(size[i]) " | " time_and_share("onboard, places", size[i]) " | " \
      time_and_share("base, places", size[i]))
  }
}

END {
  if (table == "groups") ours()
  else if (table == "unseen") unseen()
  else if (table == "std") baseline()
  else if (table == "parts") parts()
  else if (table == "recordings") recorded()
  else if (table == "scale") scale()
  else exit 2
}
