// Loop search: could the query stand somewhere else in the same place?
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "unimapper/place/column_code.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {
namespace {

// Other shifts are looked for in steps of 0.5 m; those within 1.6 m are the same pose.
constexpr float kStep = 0.5F;
constexpr float kSamePose = 1.6F;
constexpr float kMinSimilarity = 0.4F;
constexpr int kPeaks = 3;

}  // namespace

// The pose with the same heading but another shift for which the keypoints speak most; its
// evidence is 0 if there is none. All pairs of like columns vote for the shift they imply.
PlaceDatabase::Hypothesis PlaceDatabase::strongest_rival(const Hypothesis& hypothesis,
                                                         const PlanarPose& pose) noexcept {
  constexpr std::int32_t kReach = kRivalReach;
  constexpr std::int32_t kWidth = 2 * kReach + 1;
  float* votes = rival_votes_;
  std::fill_n(votes, kWidth * kWidth, 0.0F);
  for (const Keypoint& keypoint : keypoints_) {
    const Eigen::Vector2f at = pose * Eigen::Vector2f(keypoint.position.head<2>());
    for (const Target& target : targets_) {
      const float u = std::floor((target.position.x() - at.x()) / kStep + 0.5F);
      const float v = std::floor((target.position.y() - at.y()) / kStep + 0.5F);
      if (!(std::abs(u) < kReach && std::abs(v) < kReach)) continue;
      if ((u * u + v * v) * kStep * kStep < kSamePose * kSamePose) continue;
      const float similarity = column_similarity(keypoint.occupancy, target.code);
      if (similarity < kMinSimilarity) continue;
      // Spread over the neighbours, so that a peak on the border of two steps is seen.
      const std::int32_t center =
          (static_cast<std::int32_t>(v) + kReach) * kWidth + static_cast<std::int32_t>(u) + kReach;
      votes[center] += similarity;
      for (const std::int32_t step : {-1, 1, -kWidth, kWidth}) {
        votes[center + step] += 0.5F * similarity;
      }
    }
  }
  Hypothesis best = hypothesis;
  best.evidence = 0.0F;
  for (int peak = 0; peak < kPeaks; ++peak) {
    const auto at =
        static_cast<std::int32_t>(std::max_element(votes, votes + kWidth * kWidth) - votes);
    if (!(votes[at] > 0.0F)) break;
    const std::int32_t column = at % kWidth;
    const std::int32_t row = at / kWidth;
    for (std::int32_t y = std::max(0, row - 2); y <= std::min(kWidth - 1, row + 2); ++y) {
      for (std::int32_t x = std::max(0, column - 2); x <= std::min(kWidth - 1, column + 2); ++x) {
        votes[y * kWidth + x] = 0.0F;
      }
    }
    Hypothesis rival = hypothesis;
    rival.evidence = 0.0F;
    rival.pose = pose;
    rival.pose.x += static_cast<float>(column - kReach) * kStep;
    rival.pose.y += static_cast<float>(row - kReach) * kStep;
    improve(rival);
    const float dx = rival.pose.x - pose.x;
    const float dy = rival.pose.y - pose.y;
    // Improvement may lead back to where we came from.
    if (dx * dx + dy * dy < kSamePose * kSamePose) continue;
    if (rival.evidence > best.evidence) best = rival;
  }
  return best;
}

}  // namespace unimapper
