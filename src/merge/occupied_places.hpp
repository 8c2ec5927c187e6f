// Which keyframes of a session met something in a place.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/merge/refinement.hpp"
#include "voxel_table.hpp"

namespace unimapper::merge {

/// Places are cubes of this size in the map frame: the robot's fine cells, metres.
inline constexpr float kPlaceSizeM = 0.2F;

/// The place of a point, or nothing if it is too far away to have one.
[[nodiscard]] std::optional<VoxelKey> place_of(const Eigen::Vector3d& point);

/// The occupied places of one session, of cells static and dynamic alike.
class OccupiedPlaces {
 public:
  /// O(cells).
  explicit OccupiedPlaces(const PlacedSession& placed);

  /// Keyframes that met something there, ascending.
  [[nodiscard]] std::span<const std::uint32_t> keyframes_at(VoxelKey place) const;

 private:
  void add(VoxelKey place, std::uint32_t keyframe);

  VoxelTable table_;
  std::vector<std::vector<std::uint32_t>> keyframes_;  ///< by number in the table
};

}  // namespace unimapper::merge
