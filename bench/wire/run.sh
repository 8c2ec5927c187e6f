#!/usr/bin/env bash
# Cost of a keyframe on the wire: the table of docs/wire-format.md.
#
#   bench/wire/run.sh     half a minute; needs the recordings in ../shared/data
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench/wire
bin=build/release/bin

measure() {
  local real
  mkdir -p "$out"
  real=$(sh ../shared/data/unpack.sh build/bench/recordings)
  "$bin/unimapper" onboard "$real/kitti_0005a" --sensor hdl-64e --out "$out/kitti" --replace 2>"$out/kitti.log"
  "$bin/bench_wire" "$out/kitti/keyframes.lcmlog" | tee "$out/figures.txt"
}

# figure_cells NAME DIGITS: median and largest of a figure of bench_wire
figure_cells() {
  awk -v name="$1" -v digits="$2" '
    function shown(value) {
      if (value < 1000) return sprintf("%.*f", digits, value)
      return sprintf("%d,%03d", int(value / 1000), value % 1000)
    }
    index($0, name "  ") == 1 { print shown($(NF - 1)) " | " shown($NF) }' "$out/figures.txt"
}

cost_table() {
  echo "| a keyframe of KITTI raw 0005, ten HDL-64E scans | median | largest |"
  rule 3
  row "cells" 2 figure_cells cells 0
  row "bytes, free-space images included" 2 figure_cells bytes 0
  row "bytes per cell, all included" 2 figure_cells "bytes per cell" 2
  row "encode on the robot, quantisation, sorting and images included, ms" 2 \
    figure_cells "encode on the robot ms" 1
  row "encode a record at the base, images checked, ms" 2 figure_cells "encode a record ms" 1
  row "cut into messages, ms" 2 figure_cells "cut into messages ms" 2
  row "decode and check, ms" 2 figure_cells "decode ms" 2
}

only_layout || measure
table wire-cost cost_table
