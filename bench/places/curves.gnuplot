# Plot: precision-recall curves by group of LiDARs.
# gnuplot -e "folder='build/bench/places/results/town'; image='curves.png'; name='town'" curves.gnuplot
set terminal pngcairo size 1500,760 font "sans,10"
set output image
set datafile separator ","
set grid
set key bottom left
set xrange [0:1.02]
set yrange [0:1.05]
set xlabel "recall"
set ylabel "precision"
groups = "same-LiDAR wide-wide wide-narrow narrow-narrow"
file(group, method) = sprintf("%s/curve-%s-%s.csv", folder, group, method)
# Lines of one criterion of a file of two.
of(criterion) = strcol(1) eq criterion ? column(3) : NaN

set multiplot layout 2,4 title name.": right by pose, all rows of a group under one threshold"
do for [criterion in "pose view"] {
  positives = criterion eq "pose" ? "queries within 10 m" : "queries with a common view"
  do for [group in groups] {
    set title group.", ".positives noenhanced
    plot file(group, "ours") skip 1 using (of(criterion)):4 with lines linewidth 2 title "ours", \
         file(group, "STD") skip 1 using (of(criterion)):4 with lines linewidth 2 title "STD"
  }
}
unset multiplot
