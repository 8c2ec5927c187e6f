// Loop search, first half: from triangles to hypotheses.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "unimapper/place/database.hpp"

namespace unimapper {
namespace {

// Direction of (cosine, sine) as a number in [0, 4) that grows with the angle: no trigonometry.
float turn_of(float cosine, float sine) noexcept {
  const float sum = std::abs(cosine) + std::abs(sine);
  if (!(sum > 0.0F)) return 0.0F;
  const float part = sine / sum;
  if (cosine >= 0.0F) return part >= 0.0F ? part : 4.0F + part;
  return 2.0F - part;
}

// Dice similarity of two occupancy columns.
float similarity_of(std::uint64_t a, std::uint64_t b) noexcept {
  const int common = std::popcount(a & b);
  const int sum = std::popcount(a) + std::popcount(b);
  return sum == 0 ? 0.0F : 2.0F * static_cast<float>(common) / static_cast<float>(sum);
}

// Two triangles put a query at the same spot within this.
constexpr float kSameShift = 2.0F;

}  // namespace

void PlaceDatabase::vote(const PlaceView& query, PlaceId query_id,
                         const SearchScope& scope) noexcept {
  query_.clear();
  stored_keypoints_.clear();
  for (const Keypoint& keypoint : query.keypoints) {
    if (!keypoint.position.allFinite() || !keypoint.normal.allFinite()) continue;
    if (!stored_keypoints_.push_back(keypoint)) break;
    query_.push_back({keypoint.position, 0, keypoint.occupancy});
  }
  build_triangles(stored_keypoints_.view(), config_.triangles, triangles_);
  std::fill_n(votes_, std::size_t{size_} * kYawBins, std::uint16_t{0});
  for (std::uint32_t i = 0; i < size_; ++i) places_[i].used = in_scope(places_[i], query_id, scope);
  matches_.clear();
  matches_.reset_refused();
  for (const Triangle& triangle : triangles_) {
    table_.find(triangle, [&](const TriangleEntry& entry) {
      if (places_[entry.place].used == 0) return;
      const Vertex* stored = vertices_ + std::size_t{entry.place} * config_.max_keypoints;
      float similarity = 0.0F;
      float dot = 0.0F;
      float cross = 0.0F;
      for (int i = 0; i < 3; ++i) {
        similarity += similarity_of(query_[triangle.vertex[i]].code, stored[entry.vertex[i]].code);
      }
      if (similarity < 3.0F * config_.min_code_similarity) return;
      for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1;
        const Eigen::Vector3f p =
            query_[triangle.vertex[j]].position - query_[triangle.vertex[i]].position;
        const Eigen::Vector3f q =
            stored[entry.vertex[j]].position - stored[entry.vertex[i]].position;
        dot += p.x() * q.x() + p.y() * q.y();
        cross += p.x() * q.y() - p.y() * q.x();
      }
      const auto bin = std::min(static_cast<std::uint32_t>(turn_of(dot, cross) * (kYawBins / 4.0F)),
                                kYawBins - 1);
      std::uint16_t& votes = votes_[std::size_t{entry.place} * kYawBins + bin];
      if (votes < 0xFFFF) ++votes;
      matches_.push_back({entry.place,
                          static_cast<std::uint8_t>(bin),
                          {triangle.vertex[0], triangle.vertex[1], triangle.vertex[2]},
                          {entry.vertex[0], entry.vertex[1], entry.vertex[2]},
                          0});
    });
  }
  dropped_ += matches_.refused();
}

// A place is likely if its votes agree on a heading: the excess of the best two neighbouring
// bins over what evenly spread votes would give, in units of the noise of that.
void PlaceDatabase::choose_candidates() noexcept {
  candidates_.clear();
  for (std::uint32_t slot = 0; slot < size_; ++slot) {
    if (places_[slot].used == 0) continue;
    const std::uint16_t* votes = votes_ + std::size_t{slot} * kYawBins;
    std::uint32_t total = 0;
    std::uint32_t best = 0;
    std::uint32_t best_bin = 0;
    for (std::uint32_t bin = 0; bin < kYawBins; ++bin) {
      total += votes[bin];
      const std::uint32_t both = std::uint32_t{votes[bin]} + votes[(bin + 1) % kYawBins];
      if (both > best) {
        best = both;
        best_bin = bin;
      }
    }
    if (best < 2) continue;
    const float expected = 2.0F * static_cast<float>(total) / static_cast<float>(kYawBins);
    const float score = (static_cast<float>(best) - expected) / std::sqrt(expected + 1.0F);
    candidates_.push_back({slot, best_bin, score});
  }
  const auto better = [this](const Candidate& a, const Candidate& b) {
    if (a.score != b.score) return a.score > b.score;
    return comes_before(places_[a.place].id, places_[b.place].id);
  };
  const std::size_t wanted = std::min<std::size_t>(candidates_.size(), config_.max_candidates);
  std::partial_sort(candidates_.begin(), candidates_.begin() + wanted, candidates_.end(), better);
  candidates_.resize_uninitialized(wanted);
}

// Clusters the triangles of a candidate that agree on its heading by the shift they imply, and
// turns the largest clusters into hypotheses.
void PlaceDatabase::form_hypotheses(const Candidate& candidate) noexcept {
  shifts_.clear();
  const Vertex* stored = vertices_ + std::size_t{candidate.place} * config_.max_keypoints;
  for (const Match& match : matches_) {
    if (match.place != candidate.place) continue;
    if (match.yaw_bin != candidate.yaw_bin && match.yaw_bin != (candidate.yaw_bin + 1) % kYawBins) {
      continue;
    }
    Eigen::Vector2f a[3];
    Eigen::Vector2f b[3];
    for (int i = 0; i < 3; ++i) {
      a[i] = query_[match.query[i]].position.head<2>();
      b[i] = stored[match.stored[i]].position.head<2>();
    }
    Shift shift;
    if (!fit_planar(a, b, 3, shift.pose)) continue;
    shift.center = (a[0] + a[1] + a[2]) / 3.0F;
    shift.support = 0;
    shift.taken = 0;
    if (!shifts_.push_back(shift)) break;
  }
  // A triangle supports another's pose if that pose brings its centre to about the same spot.
  const auto agree = [](const Shift& a, const Shift& b) {
    return (a.pose * b.center - b.pose * b.center).squaredNorm() < kSameShift * kSameShift;
  };
  for (std::size_t i = 0; i < shifts_.size(); ++i) {
    for (std::size_t j = 0; j < shifts_.size(); ++j) {
      if (agree(shifts_[i], shifts_[j])) ++shifts_[i].support;
    }
  }
  load_targets(candidate.place);
  for (std::uint32_t round = 0; round < kHypothesesPerPlace; ++round) {
    const Shift* best = nullptr;
    for (const Shift& shift : shifts_) {
      if (shift.taken == 0 && (best == nullptr || shift.support > best->support)) best = &shift;
    }
    if (best == nullptr) return;
    const Shift seed = *best;
    for (Shift& shift : shifts_) {
      if (agree(seed, shift)) shift.taken = 1;
    }
    Hypothesis hypothesis{};
    hypothesis.place = candidate.place;
    hypothesis.votes = seed.support;
    hypothesis.pose = seed.pose;
    improve(hypothesis);
    if (hypothesis.inliers >= config_.min_inliers) hypotheses_.push_back(hypothesis);
  }
}

}  // namespace unimapper
