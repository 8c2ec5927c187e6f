// Angular sampling of a spinning LiDAR, and what follows from it
#pragma once

#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

inline constexpr float kCoarsestPixelDeg = 5.0F;  ///< the widest pixel `FreeSpaceConfig` takes

/// Degrees between neighbouring rays of a spinning sensor.
struct Sampling {
  float azimuth_deg = 0.0F;    ///< on one ring
  float elevation_deg = 0.0F;  ///< from ring to ring
};

/// What the data sheet says: rings and rays spread evenly.
[[nodiscard]] Sampling sampling_of(const SensorModel& sensor) noexcept;

/// Fits pixels and the range of full weight to the rays. A pixel is no narrower than 0.85
/// of the gap between two rays of a ring, and no lower than 0.6 of the gap between rings: its range
/// then rests on the rays on either side, and nothing that stands between two of them counts as
/// seen through. Up to the range at which rings are two fine cells apart and rays of one ring one
/// cell, what is seen through counts in full.
void apply_sampling(const Sampling& sampling, float fine_size_m,
                    FreeSpaceConfig& free_space) noexcept;

}  // namespace unimapper::onboard
