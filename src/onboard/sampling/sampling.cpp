#include "sampling.hpp"

#include <algorithm>

#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {

Sampling sampling_of(const SensorModel& sensor) noexcept {
  const std::uint32_t rings = std::max(sensor.rings, 2U);
  const std::uint32_t columns = std::max(sensor.points_per_scan / rings, 1U);
  return {std::min(sensor.horizontal_fov_deg, 360.0F) / static_cast<float>(columns),
          (sensor.elevation_max_deg - sensor.elevation_min_deg) / static_cast<float>(rings - 1U)};
}

void apply_sampling(const Sampling& sampling, float fine_size_m,
                    FreeSpaceConfig& free_space) noexcept {
  constexpr FreeSpaceConfig kDefaults;
  constexpr float kColumnPerRayGap = 0.85F;
  constexpr float kRowPerRingGap = 0.6F;
  constexpr float kFarthest_m = 500.0F;
  constexpr float kWidest_deg = 30.0F;
  const float cell_m_deg = fine_size_m * static_cast<float>(kDegreesPerRadian);
  free_space.azimuth_resolution_deg = std::clamp(
      kColumnPerRayGap * sampling.azimuth_deg, kDefaults.azimuth_resolution_deg, kCoarsestPixelDeg);
  free_space.elevation_resolution_deg =
      std::clamp(kRowPerRingGap * sampling.elevation_deg, kDefaults.elevation_resolution_deg,
                 kCoarsestPixelDeg);
  free_space.ray_spacing_deg = std::min(sampling.azimuth_deg, kWidest_deg);
  free_space.ring_spacing_deg = std::min(sampling.elevation_deg, kWidest_deg);
  free_space.full_weight_range_m = std::min(
      {2.0F * cell_m_deg / sampling.elevation_deg, cell_m_deg / sampling.azimuth_deg, kFarthest_m});
}

}  // namespace unimapper::onboard
