#include "ports/datasets/intensity.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::datasets {
namespace {

/// 0 where 99 of 100 points have none.
float range_of(const Scan& scan) {
  std::vector<float> values;
  for (const Scan::Point& point : scan.points) {
    if (std::isfinite(point.intensity)) values.push_back(point.intensity);
  }
  if (values.empty()) return 0.0F;
  const auto high = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), high, values.end());
  if (!(*high > 0.0F)) return 0.0F;
  for (const float range : {1.0F, 255.0F, 4095.0F}) {
    if (*high <= range) return range;
  }
  return 65535.0F;
}

}  // namespace

std::span<const std::uint8_t> IntensityScale::bytes(const Scan& scan) {
  if (range_ == 0.0F) range_ = range_of(scan);
  if (range_ == 0.0F) return {};
  bytes_.clear();
  for (const Scan::Point& point : scan.points) {
    const float scaled = point.intensity * (255.0F / range_) + 0.5F;
    // Also true for NaN.
    bytes_.push_back(!(scaled > 1.0F) ? std::uint8_t{1}
                                      : static_cast<std::uint8_t>(std::min(scaled, 255.0F)));
  }
  return bytes_;
}

}  // namespace unimapper::datasets
