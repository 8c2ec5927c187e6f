#include "scan_queue.hpp"

#include <algorithm>

namespace unimapper::onboard {

void ScanQueue::push(const PointView& points, const ScanOrigin& origin, bool restarted) noexcept {
  const std::uint32_t at = (first_ + size_++) % capacity_;
  float* const xyz = xyz_ + std::size_t{3} * max_points_ * at;
  const std::size_t count = std::min<std::size_t>(points.count, max_points_);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f p = points[i];
    xyz[3 * i] = p.x();
    xyz[3 * i + 1] = p.y();
    xyz[3 * i + 2] = p.z();
  }
  PointView copy = PointView::xyz(xyz, points.count, 3 * sizeof(float));
  if (intensities_ != nullptr && points.intensities != nullptr) {
    std::uint8_t* const bytes = intensities_ + std::size_t{max_points_} * at;
    for (std::size_t i = 0; i < count; ++i) {
      bytes[i] = points.intensities[i * points.intensity_stride];
    }
    copy.intensities = bytes;
  }
  scans_[at] = {copy, origin, restarted, false};
}

}  // namespace unimapper::onboard
