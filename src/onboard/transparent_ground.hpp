// Ground that was seen through.
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "coarse_voxels.hpp"
#include "evidence.hpp"
#include "image_judge.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Finds ground voxels most of whose cells some image saw through. Where a sensor hardly sees the
/// ground, the roof of a passing car is the lowest plane there is: taken for ground, all of the
/// car below it is never a candidate. A few cells of each voxel are asked, spread over it: single
/// cells of a real road are seen through, too, where rays graze it.
class TransparentGround {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Takes the voxels that were seen through out of G. Returns how many.
  /// O(cells + ground voxels x images of the window).
  std::uint32_t reject(const EvidenceWindow& window, const ImageProjection& projection,
                       const CellTable& cells, CoarseVoxels& voxels) noexcept;

 private:
  static constexpr std::uint32_t kSamplesPerVoxel = 8;
  static constexpr std::uint32_t kGroup = 2048;

  struct Tally {
    std::uint16_t asked;
    std::uint16_t seen_through;
  };
  struct Samples {
    std::uint32_t voxel[kGroup];
    float x[kGroup];
    float y[kGroup];
    float z[kGroup];
    std::int32_t log_odds[kGroup];
  };

  void ask(const EvidenceWindow& window, const ImageProjection& projection,
           const Grid& grid) noexcept;

  ImageJudge judge_;
  std::int32_t least_ = 0;  ///< evidence from which on a cell counts as seen through
  float share_ = 0.0F;
  std::uint32_t size_ = 0;
  Samples* samples_ = nullptr;
  Tally* tally_ = nullptr;  ///< by voxel
};

}  // namespace unimapper::onboard
