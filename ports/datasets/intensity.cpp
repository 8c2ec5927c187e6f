#include "ports/datasets/intensity.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::datasets {

IntensityScale::IntensityScale(const Dataset& dataset) {
  constexpr std::size_t kScans = 10;
  const std::size_t scans = dataset.scan_count();
  std::vector<float> values;
  Scan scan;
  for (std::size_t i = 0; i < std::min(kScans, scans); ++i) {
    dataset.read_scan(i * scans / std::min(kScans, scans), scan);
    for (const Scan::Point& point : scan.points) {
      if (std::isfinite(point.intensity)) values.push_back(point.intensity);
    }
  }
  if (values.empty()) return;
  const auto high = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), high, values.end());
  if (!(*high > 0.0F)) return;
  range_ = 65535.0F;
  for (const float range : {4095.0F, 255.0F, 1.0F}) {
    if (*high <= range) range_ = range;
  }
}

std::span<const std::uint8_t> IntensityScale::bytes(const Scan& scan) {
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
