# Plot: cost of a keyframe over its points and over the distance driven.
# gnuplot -e "folder='build/bench/scaling'; image='docs/images/scaling.png'" scaling.gnuplot
set terminal pngcairo size 1100,420 font "sans,11"
set output image
set datafile separator ","
set key top left
set grid
set multiplot layout 1,2

set title "Cost of a keyframe against its points"
set logscale xy
set xlabel "points per keyframe"
set ylabel "ms"
plot folder."/points.csv" skip 1 using 1:2 with linespoints pointtype 7 title "measured", \
     folder."/points.csv" skip 1 using 1:($1 * 3e-5) with lines dashtype 2 title "30 ns per point"

unset logscale
set title "Cost of a keyframe against the distance driven"
set xlabel "km"
set ylabel "ms"
set yrange [0:*]
plot folder."/distance.csv" skip 1 using 2:3 with lines linewidth 2 title "in all", \
     folder."/distance.csv" skip 1 using 2:4 with lines linewidth 2 title "loop search"
unset multiplot
