#include "ports/datasets/sensor_motion.hpp"

#include <algorithm>

#include "src/core/pose_interpolation.hpp"

namespace unimapper::datasets {

SensorMotion::SensorMotion(const Dataset& dataset) : dataset_(dataset) {
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    if (!stamps_ns_.empty() && dataset.stamp_ns(i) <= stamps_ns_.back()) continue;
    stamps_ns_.push_back(dataset.stamp_ns(i));
    poses_.push_back(dataset.pose(i));
  }
}

Pose SensorMotion::at(std::int64_t stamp_ns) const {
  if (const auto own = dataset_.pose_at(stamp_ns)) return *own;
  if (poses_.size() < 2) return poses_.empty() ? Pose() : poses_.front();
  const auto found = std::upper_bound(stamps_ns_.begin() + 1, stamps_ns_.end() - 1, stamp_ns);
  const auto after = static_cast<std::size_t>(found - stamps_ns_.begin());
  const auto since = static_cast<double>(stamp_ns - stamps_ns_[after - 1]);
  const auto interval = static_cast<double>(stamps_ns_[after] - stamps_ns_[after - 1]);
  return interpolate(poses_[after - 1], poses_[after], std::clamp(since / interval, -1.0, 2.0));
}

}  // namespace unimapper::datasets
