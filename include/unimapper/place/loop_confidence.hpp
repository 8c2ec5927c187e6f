// What the score of a loop candidate is worth.
#pragma once

#include <cstddef>

namespace unimapper {

/// A score and the share of candidates with that score that are right.
struct ScoreWorth {
  float score;
  float probability;
};

/// Measured on 6,280 best answers of all pairs of seven LiDARs in a simulated town and campus (seed
/// 61, both directions), rounded; other seeds are in docs/results.md. Ascending in both.
inline constexpr ScoreWorth kScoreWorth[] = {
    {0.0F, 0.0F},  {0.1F, 0.08F},  {0.2F, 0.25F},  {0.3F, 0.42F}, {0.38F, 0.9F},
    {0.5F, 0.97F}, {0.6F, 0.985F}, {0.7F, 0.998F}, {1.0F, 1.0F},
};

/// The probability that a candidate of this score in [0, 1] is right, between the measured ones by
/// straight lines: strictly rising.
[[nodiscard]] constexpr float probability_of(float score) noexcept {
  constexpr std::size_t kCount = sizeof kScoreWorth / sizeof kScoreWorth[0];
  for (std::size_t i = 1; i < kCount; ++i) {
    const ScoreWorth& low = kScoreWorth[i - 1];
    const ScoreWorth& high = kScoreWorth[i];
    if (score > high.score) continue;
    const float part = (score - low.score) / (high.score - low.score);
    return low.probability + part * (high.probability - low.probability);
  }
  return 1.0F;
}

/// The score that is worth this probability.
[[nodiscard]] constexpr float score_of(float probability) noexcept {
  constexpr std::size_t kCount = sizeof kScoreWorth / sizeof kScoreWorth[0];
  for (std::size_t i = 1; i < kCount; ++i) {
    const ScoreWorth& low = kScoreWorth[i - 1];
    const ScoreWorth& high = kScoreWorth[i];
    if (probability > high.probability) continue;
    const float part = (probability - low.probability) / (high.probability - low.probability);
    return low.score + part * (high.score - low.score);
  }
  return 1.0F;
}

}  // namespace unimapper
