// Loop search, second half: from hypotheses to verified poses.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "unimapper/place/database.hpp"

namespace unimapper {
namespace {

// Shapes the confidence so that 0.5 stands for evidence of 0.18: on recordings of places never
// visited before, the best of all wrong answers reached 0.11.
constexpr float kEvenEvidence = 0.28F;

}  // namespace

// Lays out the keypoints of a stored place by x, so that neighbours are found in a narrow band.
void PlaceDatabase::load_targets(std::uint32_t slot) noexcept {
  targets_.clear();
  const Eigen::Vector3f* stored = vertices_ + std::size_t{slot} * config_.max_keypoints;
  for (std::uint32_t i = 0; i < places_[slot].keypoints; ++i) targets_.push_back(stored[i]);
  std::sort(targets_.begin(), targets_.end(),
            [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
              return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
            });
}

// Pairs every query keypoint with the nearest target that a pose brings it to; a target is used
// once, by the first (strongest) query keypoint.
std::uint32_t PlaceDatabase::consensus(const PlanarPose& pose, float radius_m) noexcept {
  pairs_.clear();
  std::uint64_t used[4] = {0, 0, 0, 0};
  for (const Keypoint& keypoint : keypoints_) {
    const Eigen::Vector2f at = pose * Eigen::Vector2f(keypoint.position.head<2>());
    const Eigen::Vector3f* first =
        std::lower_bound(targets_.begin(), targets_.end(), at.x() - radius_m,
                         [](const Eigen::Vector3f& target, float x) { return target.x() < x; });
    float best_distance = radius_m * radius_m;
    const Eigen::Vector3f* best = nullptr;
    for (const Eigen::Vector3f* target = first; target != targets_.end(); ++target) {
      const float dx = target->x() - at.x();
      if (dx > radius_m) break;
      const float dy = target->y() - at.y();
      const float distance = dx * dx + dy * dy;
      if (distance >= best_distance) continue;
      best_distance = distance;
      best = target;
    }
    if (best == nullptr) continue;
    const auto index = static_cast<std::size_t>(best - targets_.begin());
    if (((used[index / 64U] >> (index % 64U)) & 1U) != 0) continue;
    used[index / 64U] |= 1ULL << (index % 64U);
    pairs_.push_back({keypoint.position.cast<double>(), best->cast<double>()});
  }
  return static_cast<std::uint32_t>(pairs_.size());
}

// Alternates between pairing and fitting with a shrinking radius.
void PlaceDatabase::improve(Hypothesis& hypothesis) noexcept {
  const float radius = config_.inlier_distance_m;
  for (const float scale : {2.0F, 1.5F, 1.0F}) {
    hypothesis.inliers = consensus(hypothesis.pose, radius * scale);
    if (hypothesis.inliers < 3) return;
    Eigen::Vector2f a[255];
    Eigen::Vector2f b[255];
    const std::uint32_t count = std::min(hypothesis.inliers, 255U);
    for (std::uint32_t i = 0; i < count; ++i) {
      a[i] = pairs_[i].a.head<2>().cast<float>();
      b[i] = pairs_[i].b.head<2>().cast<float>();
    }
    if (!fit_planar(a, b, count, hypothesis.pose)) return;
  }
  hypothesis.inliers = consensus(hypothesis.pose, radius);
}

void PlaceDatabase::load_planes(std::uint32_t slot) noexcept {
  match_planes_.clear();
  const StoredPlane* planes = planes_ + std::size_t{slot} * config_.max_planes;
  for (std::uint32_t i = 0; i < places_[slot].planes; ++i) {
    PlanePatch patch;
    for (int axis = 0; axis < 3; ++axis) {
      patch.center(axis) = static_cast<float>(planes[i].center_cm[axis]) * 0.01F;
      patch.normal(axis) = static_cast<float>(planes[i].normal[axis]);
    }
    const float norm = patch.normal.norm();
    if (!(norm > 0.0F)) continue;
    patch.normal /= norm;
    match_planes_.push_back(patch);
  }
  overlap_.set_match(match_planes_.view());
}

bool PlaceDatabase::verify(const Hypothesis& hypothesis, LoopCandidate& result) noexcept {
  load_targets(hypothesis.place);
  consensus(hypothesis.pose, config_.inlier_distance_m);
  Pose pose;
  if (!fit_rigid(pairs_.view(), pose)) return false;
  // Both frames are level, so their z axes must agree.
  const double level = std::cos(static_cast<double>(config_.max_tilt_rad));
  if (pose.rotation(2, 2) < level) return false;
  load_planes(hypothesis.place);
  pose = overlap_.refine(pose);
  if (pose.rotation(2, 2) < level) return false;
  const OverlapResult overlap = overlap_.compare(pose);

  const auto inliers = static_cast<float>(pairs_.size());
  const auto smaller = static_cast<float>(
      std::min<std::size_t>(keypoints_.size(), places_[hypothesis.place].keypoints));
  result.match = places_[hypothesis.place].id;
  result.votes = hypothesis.votes;
  result.inliers = static_cast<std::uint32_t>(pairs_.size());
  result.plane_overlap = overlap.overlap;
  result.T_match_query = pose;
  const float share = smaller > 0.0F ? inliers / smaller : 0.0F;
  // Each factor saturates: none can make up for the lack of another.
  const float by_count = inliers / (inliers + 10.0F);
  const float by_share = share / (share + 0.15F);
  const float evidence = by_count * by_share * overlap.overlap;
  result.confidence = (1.0F + kEvenEvidence) * evidence / (evidence + kEvenEvidence);
  result.accepted = result.confidence >= config_.accept_confidence;
  return true;
}

}  // namespace unimapper
