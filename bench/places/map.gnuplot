# Plot: retrieved loops of two drives, the query trajectory shifted up and right.
# gnuplot -e "data='build/bench/places/results/town/map-0'; image='map.png'; name='town'" map.gnuplot
set terminal pngcairo size 1500,720 font "sans,10"
set output image
set datafile separator ","
set size ratio -1
set grid
set key outside bottom center horizontal
set xlabel "m"
stats data."-database.csv" skip 1 using 2 name "north" nooutput
lift = 0.35 * (north_max - north_min) + 20
slant = 0.3 * lift
# Loops of which `column` is set, right or wrong ones.
start(column_number, right) = column(column_number) == 1 && column(5) == right ? column(1) + slant : NaN

set multiplot layout 1,2 title name noenhanced
do for [side in "7 6"] {
  chosen = int(side)
  set title chosen == 7 ? "before the first wrong one" : "accepted by default"
  plot data."-database.csv" skip 1 using 1:2 with lines linewidth 2 linecolor "gray40" title "database", \
       data."-queries.csv" skip 1 using ($1 + slant):($2 + lift) with lines linewidth 2 linecolor "navy" title "queries, lifted", \
       data."-loops.csv" skip 1 using (start(chosen, 1)):($2 + lift):($3 - $1 - slant):($4 - $2 - lift) \
         with vectors nohead linecolor "forest-green" title "right", \
       data."-loops.csv" skip 1 using (start(chosen, 0)):($2 + lift):($3 - $1 - slant):($4 - $2 - lift) \
         with vectors nohead linewidth 2 linecolor "red" title "wrong"
}
unset multiplot
