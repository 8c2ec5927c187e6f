// Small hand-made PCD files.
#pragma once

#include "tests/ports/datasets/fixtures.hpp"

namespace unimapper::datasets {

/// Two points, intensity 0 and 1: (1, 2, 3) and (4, 2, 3).
inline std::string binary_cloud(const std::string& viewpoint = "0 0 0 1 0 0 0") {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\n"
         "SIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT " +
         viewpoint + "\nPOINTS 2\nDATA binary\n" +
         hex("0000803f 00000040 00004040 00000000  00008040 00000040 00004040 0000803f");
}

/// Twice the point (1, 2, 3): for each axis four literal bytes and a reference to them.
inline std::string compressed_cloud() {
  return "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary_compressed\n" +
         hex("15000000 18000000  03 0000803f 4003  03 00000040 4003  03 00004040 4003");
}

}  // namespace unimapper::datasets
