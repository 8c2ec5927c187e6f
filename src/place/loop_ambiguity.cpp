// Loop search, ambiguity: competing poses relative to the same place (perceptual aliasing).
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "column_code.hpp"
#include "database_state.hpp"
#include "src/core/popcount.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper {
namespace {

// Shifts are counted in steps of 0.5 m; those within 1.6 m are the same pose.
constexpr float kStep = 0.5F;
constexpr float kInverseStep = 2.0F;
constexpr float kMinSimilarity = 0.4F;
constexpr std::uint32_t kMaxSketchDifference = 2;
constexpr int kPeaks = 3;

}  // namespace

// The pose with the same heading but another shift that has most evidence of the keypoints; 0 if
// there is none. All pairs of similar columns vote for the shift they imply.
PlaceDatabase::State::Hypothesis PlaceDatabase::State::best_shifted(
    const Hypothesis& hypothesis, const PlanarPose& pose) noexcept {
  constexpr std::int32_t kReach = kShiftReach;
  constexpr std::int32_t kWidth = 2 * kReach + 1;
  constexpr float kFarthest = kStep * static_cast<float>(kReach - 1);
  float* votes = shift_votes_;
  std::fill_n(votes, kWidth * kWidth, 0.0F);
  std::uint8_t sketches[KeypointGrid::kMaxPoints];
  for (std::uint32_t i = 0; i < targets_.size(); ++i) sketches[i] = column_sketch(targets_[i].code);
  for (const Keypoint& keypoint : keypoints_) {
    const std::uint8_t sketch = column_sketch(keypoint.occupancy);
    const Eigen::Vector2f at = pose * Eigen::Vector2f(keypoint.position.head<2>());
    for (std::uint32_t i = 0; i < targets_.size(); ++i) {
      // Most columns differ so much that eight bits suffice.
      if (popcount(std::uint64_t{sketch} ^ sketches[i]) > kMaxSketchDifference) continue;
      const KeypointGrid::Point& target = targets_[i];
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
    Hypothesis shifted = hypothesis;
    shifted.evidence = 0.0F;
    shifted.pose = pose;
    shifted.pose.x += static_cast<float>(column - kReach) * kStep;
    shifted.pose.y += static_cast<float>(row - kReach) * kStep;
    refine(shifted);
    const float dx = shifted.pose.x - pose.x;
    const float dy = shifted.pose.y - pose.y;
    // Refinement may lead back to the pose it started from.
    if (dx * dx + dy * dy < kSamePose * kSamePose) continue;
    if (shifted.evidence > best.evidence) best = shifted;
  }
  return best;
}

}  // namespace unimapper
