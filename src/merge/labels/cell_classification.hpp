// Classification of a keyframe's cells from their evidence
#pragma once

#include <cstdint>
#include <vector>

#include "src/core/voxel_key.hpp"

namespace unimapper::merge {

/// The cells of one keyframe that have evidence; structure of arrays.
struct CellEvidence {
  std::vector<std::uint32_t> number;      ///< in the keyframe: static cells, then dynamic ones
  std::vector<VoxelKey> voxel;            ///< of the map frame
  std::vector<std::uint8_t> ground;       ///< labelled ground online
  std::vector<std::uint8_t> low;          ///< so low above the ground that it connects nothing
  std::vector<std::uint8_t> was_dynamic;  ///< labelled dynamic online
  std::vector<std::int32_t> log_odds;     ///< of "dynamic", that label included, thousandths
  std::vector<std::uint8_t> occupied;     ///< other keyframes of the window that occupied its voxel

  [[nodiscard]] std::size_t size() const { return number.size(); }
};

/// 1 for every cell that is dynamic, by the mean evidence around it. Ground is rejected only where
/// most of a patch was seen through (`GroundPatch`); connected cells are classified together
/// (`ComponentLabels`), but a part of a static component that moved is dynamic
/// (`MovedPart`), and the robot's label stays where it knew more: poles that it kept are static
/// (`Outline`). O(cells).
[[nodiscard]] std::vector<std::uint8_t> classify_cells(const CellEvidence& cells,
                                                       float cell_size_m);

}  // namespace unimapper::merge
