// Loop search: could the query stand somewhere else in the same place?
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "unimapper/core/voxel_key.hpp"
#include "unimapper/place/column_code.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {
namespace {

// Other shifts are looked for in steps of 0.5 m; those within 1.6 m are the same pose.
constexpr float kStep = 0.5F;
constexpr float kInverseStep = 2.0F;
constexpr float kMinSimilarity = 0.4F;
constexpr std::uint32_t kMaxSketchDifference = 2;
constexpr int kPeaks = 3;

}  // namespace

// The pose with the same heading but another shift for which the keypoints speak most; its
// evidence is 0 if there is none. All pairs of like columns vote for the shift they imply.
PlaceDatabase::Hypothesis PlaceDatabase::shifted_rival(const Hypothesis& hypothesis,
                                                       const PlanarPose& pose) noexcept {
  constexpr std::int32_t kReach = kRivalReach;
  constexpr std::int32_t kWidth = 2 * kReach + 1;
  constexpr float kFarthest = kStep * static_cast<float>(kReach - 1);
  float* votes = rival_votes_;
  std::fill_n(votes, kWidth * kWidth, 0.0F);
  std::uint8_t sketches[KeypointGrid::kMaxSpots];
  for (std::uint32_t i = 0; i < targets_.size(); ++i) sketches[i] = column_sketch(targets_[i].code);
  for (const Keypoint& keypoint : keypoints_) {
    const std::uint8_t sketch = column_sketch(keypoint.occupancy);
    const Eigen::Vector2f at = pose * Eigen::Vector2f(keypoint.position.head<2>());
    for (std::uint32_t i = 0; i < targets_.size(); ++i) {
      // Most columns differ so much that eight bits tell.
      if (count_ones(std::uint64_t{sketch} ^ sketches[i]) > kMaxSketchDifference) continue;
      const KeypointGrid::Spot& target = targets_[i];
      const float dx = target.x - at.x();
      const float dy = target.y - at.y();
      if (!(std::abs(dx) < kFarthest && std::abs(dy) < kFarthest)) continue;
      if (dx * dx + dy * dy < kSamePose * kSamePose) continue;
      const float similarity = column_similarity(keypoint.occupancy, target.code);
      if (similarity < kMinSimilarity) continue;
      // Spread over the neighbours, so that a peak on the border of two steps is seen.
      const std::int32_t column = floor_to_int(dx * kInverseStep + 0.5F) + kReach;
      const std::int32_t row = floor_to_int(dy * kInverseStep + 0.5F) + kReach;
      const std::int32_t center = row * kWidth + column;
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
