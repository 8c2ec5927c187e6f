// Loop search, first half: from triangles to hypotheses.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "unimapper/place/column_code.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {
namespace {

// Two triangles put a query at the same spot within this.
constexpr float kSameShift = 2.0F;

}  // namespace

void PlaceDatabase::vote(const PlaceView& query, PlaceId query_id,
                         const SearchScope& scope) noexcept {
  keypoints_.clear();
  for (const Keypoint& keypoint : query.keypoints) {
    if (!keypoint.position.allFinite() || !keypoint.normal.allFinite()) continue;
    if (!keypoints_.push_back(keypoint)) break;
  }
  build_triangles(keypoints_.view(), config_.triangles, triangles_);
  std::fill_n(votes_, std::size_t{size_} * kYawBins, std::uint16_t{0});
  for (std::uint32_t i = 0; i < size_; ++i) {
    places_[i].role = in_scope(places_[i], query_id, scope) ? kInScope : kOutOfScope;
  }
  matches_.clear();
  matches_.reset_refused();
  std::uint64_t compared = 0;
  for (const Triangle& triangle : triangles_) {
    if (compared >= config_.max_compared) break;
    compared += table_.find(triangle, [&](const TriangleEntry& entry) {
      if (places_[entry.place].role == kOutOfScope) return;
      constexpr std::uint32_t kHeadingsPerBin = 256 / kYawBins;
      const auto turn = static_cast<std::uint8_t>(entry.heading - triangle.heading);
      const std::uint32_t bin = turn / kHeadingsPerBin;
      // The sides make a vote; products of normals that agree make it count more. They do not
      // decide, because at a corner two walls compete for the normal.
      const auto weight = static_cast<std::uint8_t>(1 + entry.agreeing_dots);
      std::uint16_t& votes = votes_[std::size_t{entry.place} * kYawBins + bin];
      votes = static_cast<std::uint16_t>(std::min(0xFFFF, votes + weight));
      matches_.push_back({entry.place,
                          static_cast<std::uint8_t>(bin),
                          {triangle.vertex[0], triangle.vertex[1], triangle.vertex[2]},
                          {entry.vertex[0], entry.vertex[1], entry.vertex[2]},
                          weight});
    });
  }
  dropped_ += matches_.refused();
}

// A place is likely if its votes agree on a heading: the excess of the best two neighbouring
// bins over what evenly spread votes would give, in units of the noise of that.
void PlaceDatabase::choose_candidates() noexcept {
  candidates_.clear();
  for (std::uint32_t slot = 0; slot < size_; ++slot) {
    if (places_[slot].role == kOutOfScope) continue;
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
    candidates_.push_back({slot, best_bin, 0, score});
  }
  const auto better = [this](const Candidate& a, const Candidate& b) {
    if (a.score != b.score) return a.score > b.score;
    return comes_before(places_[a.place].id, places_[b.place].id);
  };
  const std::size_t wanted = std::min<std::size_t>(candidates_.size(), config_.max_candidates);
  std::partial_sort(candidates_.begin(), candidates_.begin() + wanted, candidates_.end(), better);
  candidates_.resize_uninitialized(wanted);
}

// How alike the columns at the three vertices are, [0, 1].
float PlaceDatabase::mean_similarity(const Match& match) const noexcept {
  const std::size_t first = std::size_t{match.place} * config_.max_keypoints;
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    sum += column_similarity(keypoints_[match.query[i]].occupancy, codes_[first + match.stored[i]]);
  }
  return sum / 3.0F;
}

// Sorts out the matches of the candidates that agree with their heading and look alike.
void PlaceDatabase::gather_matches() noexcept {
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) {
    places_[candidates_[i].place].role = static_cast<std::uint16_t>(kCandidate + i);
  }
  for (const Match& match : matches_) {
    const std::uint16_t role = places_[match.place].role;
    if (role < kCandidate) continue;
    const std::uint32_t index = role - std::uint32_t{kCandidate};
    Candidate& candidate = candidates_[index];
    const bool same_heading =
        match.yaw_bin == candidate.yaw_bin || match.yaw_bin == (candidate.yaw_bin + 1) % kYawBins;
    if (!same_heading || candidate.matches == kMatchesPerPlace) continue;
    if (mean_similarity(match) < config_.min_code_similarity) continue;
    gathered_[index * kMatchesPerPlace + candidate.matches++] = match;
  }
}

// Clusters the triangles of a candidate by the shift they imply, and turns the largest clusters
// into hypotheses.
void PlaceDatabase::form_hypotheses(std::uint32_t index) noexcept {
  shifts_.clear();
  const Candidate& candidate = candidates_[index];
  const Eigen::Vector3f* stored = vertices_ + std::size_t{candidate.place} * config_.max_keypoints;
  for (std::uint32_t m = 0; m < candidate.matches; ++m) {
    const Match& match = gathered_[index * kMatchesPerPlace + m];
    Eigen::Vector2f a[3];
    Eigen::Vector2f b[3];
    for (int i = 0; i < 3; ++i) {
      a[i] = keypoints_[match.query[i]].position.head<2>();
      b[i] = stored[match.stored[i]].head<2>();
    }
    Shift shift;
    if (!fit_planar(a, b, 3, shift.pose)) continue;
    shift.center = (a[0] + a[1] + a[2]) / 3.0F;
    shift.weight = match.weight;
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
      if (agree(shifts_[i], shifts_[j])) shifts_[i].support += shifts_[j].weight;
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
    if (pairs_.size() >= config_.min_inliers) hypotheses_.push_back(hypothesis);
  }
}

}  // namespace unimapper
