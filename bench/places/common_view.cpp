#include "bench/places/common_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "unimapper/core/voxel_key.hpp"

namespace unimapper::bench {
namespace {

constexpr float kViewVoxel = 1.0F;

void sort_and_unify(std::vector<std::uint64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  keys.shrink_to_fit();  // many cells share a column, and dozens of drives are kept
}

std::uint64_t column_of(double x, double y, double size_m) {
  return pack({static_cast<std::int32_t>(std::floor(x / size_m)),
               static_cast<std::int32_t>(std::floor(y / size_m)), 0});
}

struct RepeatCount {
  double common = 0.0;
  double repeated = 0.0;
};

RepeatCount count_repeated(const KeypointView& from, const KeypointView& to, double radius_m) {
  RepeatCount count;
  for (const Eigen::Vector3d& keypoint : from.keypoints) {
    if (!to.occupied.near(keypoint)) continue;
    count.common += 1.0;
    const bool repeated =
        std::any_of(to.keypoints.begin(), to.keypoints.end(), [&](const Eigen::Vector3d& other) {
          return (other - keypoint).head<2>().norm() <= radius_m;
        });
    count.repeated += repeated ? 1.0 : 0.0;
  }
  return count;
}

}  // namespace

ViewVoxels view_voxels(std::span<const FineCell> cells, const Pose& T_world_keyframe) {
  ViewVoxels voxels;
  const Eigen::Matrix3f rotation = T_world_keyframe.rotation.cast<float>();
  const Eigen::Vector3f shift = T_world_keyframe.translation.cast<float>();
  for (const FineCell& cell : cells) {
    if (cell.ground != 0) continue;
    voxels.push_back(pack(voxel_index(rotation * cell.position + shift, 1.0F / kViewVoxel)));
  }
  sort_and_unify(voxels);
  return voxels;
}

double common_view(const ViewVoxels& a, const ViewVoxels& b) {
  if (a.empty() || b.empty()) return 0.0;
  std::size_t common = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    common += *i == *j ? 1 : 0;
    const bool first = *i <= *j;
    const bool second = *j <= *i;
    i += first ? 1 : 0;
    j += second ? 1 : 0;
  }
  return static_cast<double>(common) / static_cast<double>(std::min(a.size(), b.size()));
}

OccupiedColumns::OccupiedColumns(std::span<const FineCell> cells, const Pose& T_world_keyframe,
                                 double size_m)
    : size_m_(size_m) {
  for (const FineCell& cell : cells) {
    if (cell.ground != 0) continue;
    const Eigen::Vector3d p = T_world_keyframe * Eigen::Vector3d(cell.position.cast<double>());
    columns_.push_back(column_of(p.x(), p.y(), size_m));
  }
  sort_and_unify(columns_);
}

bool OccupiedColumns::near(const Eigen::Vector3d& world_point) const {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const std::uint64_t column =
          column_of(world_point.x() + dx * size_m_, world_point.y() + dy * size_m_, size_m_);
      if (std::binary_search(columns_.begin(), columns_.end(), column)) return true;
    }
  }
  return false;
}

std::vector<Eigen::Vector2d> OccupiedColumns::centers() const {
  std::vector<Eigen::Vector2d> centers;
  for (const std::uint64_t column : columns_) {
    const VoxelIndex index = unpack(column);
    centers.emplace_back((index.x + 0.5) * size_m_, (index.y + 0.5) * size_m_);
  }
  return centers;
}

double repeatability(const KeypointView& a, const KeypointView& b, double radius_m) {
  const RepeatCount there = count_repeated(a, b, radius_m);
  const RepeatCount back = count_repeated(b, a, radius_m);
  const double common = there.common + back.common;
  if (common == 0.0) return std::numeric_limits<double>::quiet_NaN();
  return (there.repeated + back.repeated) / common;
}

}  // namespace unimapper::bench
