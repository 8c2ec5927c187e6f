// Thickness of the surfaces in several scans together.
#include "ports/datasets/sharpness.hpp"

#include <catch2/catch.hpp>
#include <limits>

using unimapper::datasets::SurfaceThickness;

namespace {

/// Three scans of a floor in one voxel, `rise_m` higher from scan to scan.
SurfaceThickness floor_of_three_scans(double rise_m) {
  SurfaceThickness surfaces;
  for (int scan = 0; scan < 3; ++scan) {
    surfaces.begin_scan();
    for (int i = 0; i < 16; ++i) surfaces.add({0.03 * (i % 4), 0.03 * (i / 4), rise_m * scan});
  }
  return surfaces;
}

}  // namespace

TEST_CASE("Scans that lie beside each other make surfaces thick") {
  CHECK(floor_of_three_scans(0.0).log_thickness() + 1.0 <
        floor_of_three_scans(0.02).log_thickness());
}

TEST_CASE("Points beyond what voxels can count say nothing about surfaces") {
  SurfaceThickness surfaces = floor_of_three_scans(0.01);
  const double before = surfaces.log_thickness();
  for (const double far : {1e9, -1e304, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    for (int scan = 0; scan < 3; ++scan) {
      surfaces.begin_scan();
      for (int i = 0; i < 16; ++i) surfaces.add({far, 0.1 * i, 0.0});
    }
  }
  CHECK(surfaces.log_thickness() == before);
}
