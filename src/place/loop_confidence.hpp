// Calibration of loop scores to probabilities.
#pragma once

#include <cstddef>

namespace unimapper::place {

/// A score and the share of candidates with that score that are right.
struct ScoreCalibration {
  float score;
  float probability;
};

/// Measured on 6,280 best answers of all pairs of seven LiDARs in a simulated town and campus (seed
/// 61, both directions), rounded; other seeds are in docs/results.md. Ascending in both.
inline constexpr ScoreCalibration kCalibration[] = {
    {0.0F, 0.0F},  {0.1F, 0.08F},  {0.2F, 0.25F},  {0.3F, 0.42F}, {0.38F, 0.9F},
    {0.5F, 0.97F}, {0.6F, 0.985F}, {0.7F, 0.998F}, {1.0F, 1.0F},
};

/// The probability that a candidate of this score in [0, 1] is right: piecewise linear between the
/// measured ones, strictly rising.
[[nodiscard]] constexpr float probability_of(float score) noexcept {
  constexpr std::size_t kCount = sizeof kCalibration / sizeof kCalibration[0];
  for (std::size_t i = 1; i < kCount; ++i) {
    const ScoreCalibration& low = kCalibration[i - 1];
    const ScoreCalibration& high = kCalibration[i];
    if (score > high.score) continue;
    const float part = (score - low.score) / (high.score - low.score);
    return low.probability + part * (high.probability - low.probability);
  }
  return 1.0F;
}

/// The score with this probability: the inverse.
[[nodiscard]] constexpr float score_of(float probability) noexcept {
  constexpr std::size_t kCount = sizeof kCalibration / sizeof kCalibration[0];
  for (std::size_t i = 1; i < kCount; ++i) {
    const ScoreCalibration& low = kCalibration[i - 1];
    const ScoreCalibration& high = kCalibration[i];
    if (probability > high.probability) continue;
    const float part = (probability - low.probability) / (high.probability - low.probability);
    return low.score + part * (high.score - low.score);
  }
  return 1.0F;
}

}  // namespace unimapper::place
