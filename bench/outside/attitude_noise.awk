# Poses of a KITTI recording with noise of roll and pitch: -v degrees=D -v seconds=S.
# Independent per scan with S = 0, else correlated over S. The first pose has none. The random
# numbers are computed here, for those of awk differ between machines.
function uniform() { state = (state * 16807) % 2147483647; return state / 2147483647 }
function normal(   sum, i) { for (i = 0; i < 12; ++i) sum += uniform(); return sum - 6 }
BEGIN { state = 4; carried = seconds > 0 ? exp(-0.1 / seconds) : 0; fresh = sqrt(1 - carried * carried) }
{
  if (NR > 1) {
    roll = carried * roll + fresh * normal()
    pitch = carried * pitch + fresh * normal()
  }
  radians = degrees * 0.017453292519943295
  cr = cos(roll * radians); sr = sin(roll * radians)
  cp = cos(pitch * radians); sp = sin(pitch * radians)
  for (r = 0; r < 3; ++r) {
    x = $(4 * r + 1); y = $(4 * r + 2); z = $(4 * r + 3)
    # Columns turned about x, then about y.
    turned_y = cr * y + sr * z
    turned_z = cr * z - sr * y
    printf "%s%.9f %.9f %.9f %s", r ? " " : "", cp * x - sp * turned_z, turned_y, \
      sp * x + cp * turned_z, $(4 * r + 4)
  }
  print ""
}
