// Tests of which side of a LiDAR's path is driven on.
#include "src/input/axes.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "src/input/recognition.hpp"

using namespace unimapper;
using namespace unimapper::input;

namespace {

/// A drive along x, a metre a scan, of which two scans show the same.
Side up_along(const datasets::Scan& scan, double lowest_deg, SheetSide sheet) {
  const Track track{60,
                    [](std::size_t i) {
                      Pose pose;
                      pose.translation.x() = static_cast<double>(i);
                      return pose;
                    },
                    [](std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }};
  const std::vector<std::size_t> indices = {10, 20};
  const std::vector<const datasets::Scan*> scans = {&scan, &scan};
  return find_up(measure_driven_surface(track, lowest_deg, indices, scans), sheet);
}

/// A drive along what lies `below_m` under it and `above_m` over it; 0: nothing. Both are level but
/// for steps of 0.2 m in the one above.
Side up_between(double below_m, double above_m, bool over = false,
                SheetSide sheet = SheetSide::kUnknown, double lowest_deg = -45.0) {
  const double sign = over ? -1.0 : 1.0;
  datasets::Scan scan;
  for (int k = 20; k < 220; ++k) {
    const float x = 0.1F * static_cast<float>(k);
    const double step_m = k / 30 % 2 == 0 ? 0.0 : 0.2;
    if (below_m > 0.0) scan.points.push_back({x, 0.0F, static_cast<float>(-sign * below_m), 0.0F});
    if (above_m > 0.0) {
      scan.points.push_back({x, 0.0F, static_cast<float>(sign * (above_m + step_m)), 0.0F});
    }
  }
  return up_along(scan, lowest_deg, sheet);
}

}  // namespace

TEST_CASE("the side that is driven on is near to the path, and equally far from it") {
  CHECK(up_between(1.8, 0.0) == Side::kAbove);
  CHECK(up_between(30.0, 0.0) == Side::kAbove);  // under a drone
  CHECK(up_between(1.5, 1.6) == Side::kAbove);
  CHECK(up_between(0.4, 5.0) == Side::kAbove);
  CHECK(up_between(1.9, 0.7) == Side::kAbove);  // on a back, in a corridor
  CHECK(up_between(1.8, 0.0, true) == Side::kBelow);
  CHECK(up_between(1.5, 1.6, true) == Side::kUnknown);
  CHECK(up_between(0.4, 5.0, true) == Side::kUnknown);
}

TEST_CASE("people beside a robot whose LiDAR is upside down do not make it look upright") {
  datasets::Scan scan;
  for (int k = 0; k < 220; ++k) {
    const float x = 0.1F * static_cast<float>(k);
    scan.points.push_back({x, 0.0F, 1.0F, 0.0F});
    if (k < 120) scan.points.push_back({x, 0.0F, -0.1F - 0.1F * static_cast<float>(k % 6), 0.0F});
  }
  // A ground with people on it, below a low ceiling, shows the same.
  CHECK(up_along(scan, -17.0, SheetSide::kUnknown) == Side::kUnknown);
}

TEST_CASE("cars that drive ahead below a low ceiling stand on the ground") {
  const auto up_behind_cars = [](double sign, double lowest_deg) {
    datasets::Scan scan;
    for (int k = 20; k < 220; ++k) {
      const float x = 0.1F * static_cast<float>(k);
      const bool is_car = k >= 50 && k < 110;
      const double below_m = is_car ? 0.4 : 1.5;
      const double step_m = k / 30 % 2 == 0 ? 0.0 : 0.2;
      scan.points.push_back({x, 0.0F, static_cast<float>(-sign * below_m), 0.0F});
      scan.points.push_back({x, 0.0F, static_cast<float>(sign * (1.6 + step_m)), 0.0F});
    }
    return up_along(scan, lowest_deg, SheetSide::kUnknown);
  };
  CHECK(up_behind_cars(1.0, -45.0) == Side::kAbove);
  CHECK(up_behind_cars(-1.0, -45.0) == Side::kUnknown);
}

TEST_CASE("carts along a quarter of the path do not make a ceiling more even than the ground") {
  datasets::Scan scan;
  for (int k = 20; k < 220; ++k) {
    const float x = 0.1F * static_cast<float>(k);
    scan.points.push_back({x, 0.0F, k / 10 % 4 == 0 ? -1.2F : -1.9F, 0.0F});
    scan.points.push_back({x, 0.0F, k / 10 % 4 == 0 ? 3.1F : 3.0F, 0.0F});
  }
  CHECK(up_along(scan, -45.0, SheetSide::kUnknown) == Side::kAbove);
}

TEST_CASE("a trailer is no surface that the robot drives below") {
  datasets::Scan scan;
  for (int k = -160; k < 220; ++k) {
    const float x = 0.1F * static_cast<float>(k);
    const bool is_trailer = k < -10;
    if (is_trailer) scan.points.push_back({x, 0.0F, 0.2F, 0.0F});
    // Rough: three metres in four are level.
    const float rough_m = 0.4F * static_cast<float>(k / 10 % 4 == 0);
    if (k > 40) scan.points.push_back({x, 0.0F, rough_m - 1.2F, 0.0F});
  }
  CHECK(up_along(scan, -15.0, SheetSide::kUnknown) == Side::kAbove);
}

TEST_CASE("a LiDAR that hardly looks down is told by its data sheet") {
  constexpr double kHardly_deg = -2.0;
  const auto mirrored = SheetSide::kMirrored;
  CHECK(up_between(1.8, 0.0, true, mirrored, kHardly_deg) == Side::kBelow);
  CHECK(up_between(0.0, 5.0, true, mirrored, kHardly_deg) == Side::kUnknown);
  CHECK(up_between(1.8, 0.0, false, mirrored) ==
        Side::kAbove);  // hangs, and is turned over already
  CHECK(up_between(0.0, 2.0, false, SheetSide::kUpright, kHardly_deg) == Side::kAbove);
  SensorFigures figures;
  figures.points = 20'000;
  figures.width_deg = 360.0;
  const auto side = [&](double lowest_deg, double highest_deg) {
    figures.lowest_deg = lowest_deg;
    figures.highest_deg = highest_deg;
    return sheet_side(figures);
  };
  CHECK(side(-51.0, 6.5) == SheetSide::kMirrored);
  CHECK(side(-6.5, 51.0) == SheetSide::kUpright);
  CHECK(side(-5.9, 25.5) == SheetSide::kUnknown);  // a Mid-360 that sees no ceiling
  figures.ring_spacing_deg = 0.4;
  CHECK(side(-24.5, 1.8) == SheetSide::kUpright);
  CHECK(side(-1.8, 24.5) == SheetSide::kMirrored);
  CHECK(side(-15.0, 15.0) == SheetSide::kUnknown);
  CHECK(side(-15.0, 4.0) == SheetSide::kUnknown);
}
