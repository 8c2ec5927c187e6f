// Scans from within a closed cabin
#include "src/input/shut_in.hpp"

#include <cmath>

#include "src/core/cabin.hpp"

namespace unimapper::input {

bool is_shut_in(const datasets::Scan& scan) {
  CabinTest cabin(scan.points.size());
  for (const datasets::Scan::Point& point : scan.points) {
    const bool is_return =
        std::isfinite(point.x) && std::isfinite(point.y) && (point.x != 0.0F || point.y != 0.0F);
    if (is_return && !cabin.add(point.x, point.y)) return false;
  }
  return cabin.is_shut_in();
}

}  // namespace unimapper::input
