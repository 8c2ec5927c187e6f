// Scans from within a closed cabin
#include "src/input/shut_in.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace unimapper::input {
namespace {

constexpr float kCabin_m = 3.5F;
constexpr std::size_t kFewestPoints = 200;
constexpr std::size_t kOneBeyondOf = 50;
constexpr std::size_t kSides = 8;
constexpr std::size_t kFewestOfSide = 100;  // one in so many of all points

}  // namespace

bool is_shut_in(const datasets::Scan& scan) {
  std::array<std::size_t, kSides> by_side{};
  std::size_t points = 0;
  std::size_t beyond = 0;
  for (const datasets::Scan::Point& point : scan.points) {
    const float range_m = std::hypot(point.x, point.y);
    if (!std::isfinite(range_m) || range_m == 0.0F) continue;
    ++points;
    beyond += range_m > kCabin_m ? 1 : 0;
    const float turn = std::atan2(point.y, point.x) / (2.0F * static_cast<float>(M_PI)) + 0.5F;
    const auto side = static_cast<std::size_t>(turn * static_cast<float>(kSides));
    ++by_side[std::min(side, kSides - 1)];
  }
  if (points < kFewestPoints || beyond * kOneBeyondOf > points) return false;
  const auto is_seen = [&](std::size_t of_side) { return of_side * kFewestOfSide >= points; };
  return std::all_of(by_side.begin(), by_side.end(), is_seen);
}

}  // namespace unimapper::input
