# Plot: search time and recall over the size of the database.
# gnuplot -e "folder='build/bench/places/results/scale'; image='scale.png'" scale.gnuplot
set terminal pngcairo size 1100,420 font "sans,11"
set output image
set datafile separator ","
set key top left
set grid
set logscale x
set xlabel "places"
set format x "%.0f"
set multiplot layout 1,2

set title "Query time"
set ylabel "ms"
set yrange [0:*]
plot folder."/scale-onboard.csv" skip 1 using 1:3 with linespoints pointtype 7 title "onboard, p50", \
     folder."/scale-onboard.csv" skip 1 using 1:4 with linespoints pointtype 6 title "onboard, p99", \
     folder."/scale-base.csv" skip 1 using 1:3 with linespoints pointtype 5 title "base, p50", \
     folder."/scale-base.csv" skip 1 using 1:4 with linespoints pointtype 4 title "base, p99"

set title "Queries with the right top candidate"
set ylabel "%"
set yrange [0:100]
set key bottom left
plot folder."/scale-onboard.csv" skip 1 using 1:(100 * $5) with linespoints pointtype 7 title "onboard", \
     folder."/scale-base.csv" skip 1 using 1:(100 * $5) with linespoints pointtype 5 title "base", \
     folder."/scale-base.csv" skip 1 using 1:(100 * $6) with linespoints pointtype 4 title "base, accepted"
unset multiplot
