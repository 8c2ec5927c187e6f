// Rejection of elevated ground
#pragma once

#include <cstdint>

#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Finds ground voxels that lie a step above the ground around them. What a moving car leaves in
/// the ten scans of a keyframe is often as flat as a road: the swept strip of a bumper, a bonnet, a
/// roof of which nothing below was hit. Taken for ground it is never a candidate, and its
/// neighbours are split by it.
class GroundLevels {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Takes elevated voxels out of G. Returns how many. O(ground voxels x reach^2),
  /// array accesses only.
  std::uint32_t reject_elevated(FixedHashMap<CoarseVoxel>& voxels,
                                const Executor& executor = {}) noexcept;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// Fills in the lowest ground voxel of every column.
  void collect(const FixedHashMap<CoarseVoxel>& voxels) noexcept;
  [[nodiscard]] bool is_elevated(const FixedHashMap<CoarseVoxel>& voxels,
                                 std::uint32_t entry) const noexcept;

  float step_m_ = 0.0F;
  std::int32_t reach_ = 0;           ///< voxels
  std::int32_t width_ = 0;           ///< columns along an edge; column (0, 0) is in the middle
  std::uint32_t* lowest_ = nullptr;  ///< ground voxel of every column, or `kNone`
};

}  // namespace unimapper::onboard
