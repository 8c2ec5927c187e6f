#include "occupied_places.hpp"

namespace unimapper::merge {

std::optional<VoxelKey> place_of(const Eigen::Vector3d& point) {
  const Eigen::Array3d scaled = point.array() / static_cast<double>(kPlaceSizeM);
  // Also false for NaN.
  if (!(scaled.abs().maxCoeff() < static_cast<double>(kVoxelAxisLimit - 8))) return std::nullopt;
  const Eigen::Array3d floor = scaled.floor();
  return pack({static_cast<std::int32_t>(floor.x()), static_cast<std::int32_t>(floor.y()),
               static_cast<std::int32_t>(floor.z())});
}

OccupiedPlaces::OccupiedPlaces(const PlacedSession& placed) {
  const auto& keyframes = placed.session->keyframes;
  for (std::uint32_t k = 0; k < keyframes.size(); ++k) {
    for (const auto* cells : {&keyframes[k].static_cells, &keyframes[k].dynamic_cells}) {
      for (const FineCell& cell : *cells) {
        const auto place = place_of(placed.T_map_keyframe[k] * cell.position.cast<double>());
        if (place) add(*place, k);
      }
    }
  }
}

void OccupiedPlaces::add(VoxelKey place, std::uint32_t keyframe) {
  const std::uint32_t number = table_.find_or_insert(place);
  if (number == keyframes_.size()) keyframes_.emplace_back();
  std::vector<std::uint32_t>& met = keyframes_[number];
  if (met.empty() || met.back() != keyframe) met.push_back(keyframe);
}

std::span<const std::uint32_t> OccupiedPlaces::keyframes_at(VoxelKey place) const {
  const std::uint32_t number = table_.find(place);
  if (number == VoxelTable::kNone) return {};
  return keyframes_[number];
}

}  // namespace unimapper::merge
