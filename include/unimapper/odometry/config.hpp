// Parameters of the odometry.
#pragma once

#include <concepts>
#include <cstdint>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/parameter_table.hpp"

namespace unimapper {

/// Parameters of `LidarOdometry`.
struct LidarOdometryConfig {
  double max_range_m = 100.0;
  double min_range_m = 1.0;
  double voxel_m = 1.0;
  std::uint32_t max_voxels = 3U << 15U;
  std::uint32_t max_points = 1U << 16U;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<LidarOdometryConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::max_range_m>("[5, 500]", "m", "choice", "Points beyond are left out."),
      parameter<&C::min_range_m>("[0, 20]", "m", "choice",
                                 "Points nearer are left out: the robot itself. Less than "
                                 "max_range_m."),
      parameter<&C::voxel_m>("[0.1, 4]", "m", "measured", "Edge of the local map's voxels."),
      parameter<&C::max_voxels>("[1024, 1048576]", "", "choice",
                                "Capacity: voxels of the local map."),
      parameter<&C::max_points>(
          "[256, 262144]", "", "choice",
          "Capacity: points of one scan after thinning to a quarter of a voxel."));
}

}  // namespace unimapper
