// Noise of given poses, from scan to scan
#include "src/input/pose_noise.hpp"

#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace unimapper::input {

Twist measure_pose_noise(const Track& track) {
  constexpr std::size_t kMost = 400;
  std::array<std::vector<double>, 6> magnitudes;
  const std::size_t step = 1 + track.size / kMost;
  for (std::size_t i = 2; i + 2 < track.size; i += step) {
    const Twist difference = fourth_difference({track.pose(i - 2), track.pose(i - 1), track.pose(i),
                                                track.pose(i + 1), track.pose(i + 2)});
    for (std::size_t c = 0; c < 6; ++c) {
      magnitudes[c].push_back(std::fabs(difference[static_cast<Eigen::Index>(c)]));
    }
  }
  Twist sigmas;
  for (std::size_t c = 0; c < 6; ++c) {
    sigmas[static_cast<Eigen::Index>(c)] = scale_of(std::span(magnitudes[c]));
  }
  return sigmas;
}

}  // namespace unimapper::input
