#include "scan_thinning.hpp"

namespace unimapper::odometry {
namespace {

/// Adds `value` if nothing has that key.
template <typename Value>
void add_first(FixedHashMap<Value>& map, VoxelKey key, const Value& value) noexcept {
  const std::uint32_t before = map.size();
  const std::uint32_t entry = map.find_or_insert(key);
  if (map.size() > before) map[entry] = value;
}

/// Cells per voxel of the second thinning.
float cells_per_voxel(float distance_voxels) noexcept {
  constexpr float kNear_voxels = 6.0F;
  if (distance_voxels < kNear_voxels) return 4.0F;
  if (distance_voxels < 2.0F * kNear_voxels) return 2.0F;
  return distance_voxels < 4.0F * kNear_voxels ? 1.0F : 0.5F;
}

}  // namespace

void ScanThinning::allocate(Arena& arena, const LidarOdometryConfig& config) noexcept {
  fine_.allocate(arena, config.max_points);
  coarse_.allocate(arena, config.max_points);
  voxels_per_m_ = static_cast<float>(1.0 / config.voxel_m);
  min_squared_m2_ = static_cast<float>(config.min_range_m * config.min_range_m);
  max_squared_m2_ = static_cast<float>(config.max_range_m * config.max_range_m);
}

void ScanThinning::thin(const PointView& points, std::span<const float> time_s) noexcept {
  constexpr float kCellsPerVoxel = 4.0F;
  constexpr float kLongestSweep_s = 2.0F;
  fine_.clear();
  coarse_.clear();
  VoxelKey last = ~VoxelKey{0};  // neighbours in a ring mostly lie in one cell
  for (std::size_t i = 0; i < points.count; ++i) {
    const Eigen::Vector3f p = points[i];
    const float squared_m2 = p.x() * p.x() + p.y() * p.y() + p.z() * p.z();
    if (!(squared_m2 >= min_squared_m2_ && squared_m2 <= max_squared_m2_)) continue;  // NaN, too
    const VoxelKey key = pack(voxel_index(p, kCellsPerVoxel * voxels_per_m_));
    if (key == last) continue;
    const float time = time_s.empty() ? 0.0F : time_s[i];
    if (!(time >= -kLongestSweep_s && time <= kLongestSweep_s)) continue;
    last = key;
    add_first(fine_, key, ScanPoint{p, time});
  }
  for (std::uint32_t i = 0; i < fine_.size(); ++i) {
    const Eigen::Vector3f scaled = fine_[i].position_m * voxels_per_m_;
    add_first(coarse_, pack(voxel_index(scaled, cells_per_voxel(scaled.norm()))), i);
  }
}

}  // namespace unimapper::odometry
