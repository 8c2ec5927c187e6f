# Plot: a failed query from above, left at its true pose, right at the retrieved pose.
# gnuplot -e "data='build/bench/places/results/town/worst-0'; image='worst.png'; name='town'" worst.gnuplot
set terminal pngcairo size 1400,760 font "sans,10"
set output image
set datafile separator ","
set size ratio -1
set grid
set key outside bottom center horizontal
set xlabel "m"
set xrange [-70:70]
set yrange [-70:70]
is(kind) = column(1) == kind ? column(2) : NaN

set multiplot layout 1,2 title name noenhanced
do for [side in "2 4"] {
  first = int(side)
  set title first == 2 ? "true pose" : "estimated pose"
  colour = first == 2 ? "forest-green" : "red"
  plot data.".csv" skip 1 using (is(0)):3 with dots linecolor "gray30" title "database", \
       data.".csv" skip 1 using (is(first)):3 with dots linecolor rgb colour title "query", \
       data.".csv" skip 1 using (is(1)):3 with points pointtype 6 pointsize 1.2 linecolor "black" title "keypoints", \
       data.".csv" skip 1 using (is(first + 1)):3 with points pointtype 2 pointsize 0.8 linecolor rgb colour title "of the query"
}
unset multiplot
