// Parameters of description and loop search.
#pragma once

#include <cstdint>

#include "unimapper/core/expected.hpp"

namespace unimapper {

/// Parameters of `PlaceDescriber` (paper section V-A).
struct DescriptorConfig {
  float voxel_size_m = 2.0F;             ///< coarse voxels L_c, [0.5, 8]
  std::uint32_t max_cells = 1U << 17U;   ///< static cells of one keyframe
  std::uint32_t max_voxels = 1U << 14U;  ///< coarse voxels of one keyframe
  std::uint32_t max_keypoints = 160;     ///< kept keypoints, [8, 255]
  std::uint32_t max_planes = 2048;       ///< kept plane patches

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

/// Parameters of `PlaceDatabase` (paper section V-B).
struct LoopSearchConfig {
  std::uint32_t max_places = 2000;    ///< stored keyframes
  std::uint32_t max_results = 8;      ///< candidates returned per search
  std::uint32_t max_keypoints = 160;  ///< per place, as in DescriptorConfig
  std::uint32_t max_planes = 2048;    ///< per place, as in DescriptorConfig

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

}  // namespace unimapper
