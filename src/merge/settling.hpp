// From the evidence for single cells to decisions about what they belong to.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "unimapper/core/voxel_key.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// The cells of one keyframe that can be judged; structure of arrays.
struct JudgedCells {
  std::vector<std::uint32_t> number;  ///< in the keyframe: static cells, then dynamic ones
  std::vector<VoxelKey> place;
  std::vector<std::uint8_t> ground;  ///< called ground by the robot
  std::vector<std::uint8_t> low;     ///< so low above the ground that it connects nothing
  std::vector<float> log_odds;       ///< evidence for "dynamic"

  [[nodiscard]] std::size_t size() const { return number.size(); }
};

/// 1 for every cell that is dynamic. Cells are judged by the mean evidence around them, ground
/// only where all of a patch was seen through, and what touches stands or falls together.
/// O(cells).
[[nodiscard]] std::vector<std::uint8_t> settle(const JudgedCells& cells,
                                               const RefinementConfig& config);

}  // namespace unimapper::merge
