#include "occupied_voxels.hpp"

namespace unimapper::merge {

std::optional<VoxelKey> observed_voxel(const Eigen::Vector3d& point, float size_m) {
  const Eigen::Array3d scaled = point.array() / static_cast<double>(size_m);
  // Also false for NaN.
  if (!(scaled.abs().maxCoeff() < static_cast<double>(kVoxelAxisLimit - 8))) return std::nullopt;
  const Eigen::Array3d floor = scaled.floor();
  return pack({static_cast<std::int32_t>(floor.x()), static_cast<std::int32_t>(floor.y()),
               static_cast<std::int32_t>(floor.z())});
}

OccupiedVoxels::OccupiedVoxels(const PosedSession& posed, float size_m) {
  const auto& keyframes = posed.session->keyframes;
  for (std::uint32_t k = 0; k < keyframes.size(); ++k) {
    for (const auto* cells : {&keyframes[k].static_cells, &keyframes[k].dynamic_cells}) {
      for (const FineCell& cell : *cells) {
        const auto voxel =
            observed_voxel(posed.T_map_keyframe[k] * cell.position.cast<double>(), size_m);
        if (voxel) add(*voxel, k);
      }
    }
  }
}

void OccupiedVoxels::add(VoxelKey voxel, std::uint32_t keyframe) {
  const std::uint32_t number = table_.find_or_insert(voxel);
  if (number == keyframes_.size()) keyframes_.emplace_back();
  std::vector<std::uint32_t>& observers = keyframes_[number];
  if (observers.empty() || observers.back() != keyframe) observers.push_back(keyframe);
}

std::span<const std::uint32_t> OccupiedVoxels::keyframes_at(VoxelKey voxel) const {
  const std::uint32_t number = table_.find(voxel);
  if (number == VoxelTable::kNone) return {};
  return keyframes_[number];
}

}  // namespace unimapper::merge
