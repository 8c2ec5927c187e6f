// Rejection of ground that was seen through
#pragma once

#include <cstdint>

#include "evidence_window.hpp"
#include "src/free_space/ground_patch.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/executor.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Finds ground voxels most of whose cells some image saw through (see `GroundPatch`): taken for
/// ground, a roof keeps all of the car below it from being a candidate. A few cells of each voxel
/// are sampled, spread over it.
class TransparentGround {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Takes the voxels that were seen through out of G. Returns how many.
  /// O(cells + ground voxels x images of the window).
  std::uint32_t reject(const EvidenceWindow& window, const CellTable& cells,
                       CoarseVoxels& voxels) noexcept;
  /// About how many projections that takes, with so many ground voxels and images.
  [[nodiscard]] std::uint32_t projections(std::uint32_t ground_voxels,
                                          std::uint32_t images) const noexcept {
    return share_ > 0.0F ? kSamplesPerVoxel * ground_voxels * images : 0;
  }

 private:
  static constexpr std::uint32_t kSamplesPerVoxel = 8;
  static constexpr std::uint32_t kGroup = 2048;

  struct Samples {
    std::uint32_t size;
    std::uint32_t voxel[kGroup];
    float x[kGroup];
    float y[kGroup];
    float z[kGroup];
    std::int32_t log_odds[kGroup];
  };

  /// Observes the samples of the first `groups` groups, and counts what was seen through.
  void observe(const EvidenceWindow& window, const Grid& grid, std::uint32_t groups) noexcept;

  std::int32_t least_ = 0;  ///< evidence from which on a cell counts as seen through
  float share_ = 0.0F;
  Executor executor_;
  Samples* samples_ = nullptr;      ///< a group for each worker
  GroundPatch* patches_ = nullptr;  ///< by voxel
};

}  // namespace unimapper::onboard
