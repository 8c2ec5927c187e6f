// Loop search, voting: from matched triangles to pose hypotheses.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "database_state.hpp"

namespace unimapper {
namespace {

// Fewer agreeing keypoints are no hypothesis; measured.
constexpr std::size_t kMinInliers = 5;

}  // namespace

void PlaceDatabase::State::load_query(const PlaceView& query) noexcept {
  keypoints_.clear();
  query_up_ = query.up;
  for (const Keypoint& keypoint : query.keypoints) {
    if (!keypoint.position.allFinite() || !keypoint.normal.allFinite()) continue;
    if (!keypoints_.push_back(keypoint)) break;
  }
  build_triangles(keypoints_.view(), config_.triangles, triangles_);
}

// Triangles of near neighbours come first; where the search would compare more than it may, those
// of farther ones are left out. (Searching for the rarest shapes first finds fewer: what is rare is
// less repeatable.) Stops after so many comparisons; false once no triangle is left.
bool PlaceDatabase::State::vote_some() noexcept {
  const std::uint64_t pause = search_.compared + kComparedPerStep;
  while (search_.next < triangles_.size() && search_.compared < pause) {
    const Triangle& triangle = triangles_[search_.next++];
    search_.compared += table_.entries_near(triangle);
    if (search_.compared > config_.max_compared) {
      search_.next = triangles_.size();
      break;
    }
    table_.find(triangle, [&](const TriangleEntry& entry) {
      if (!in_scope(places_[entry.slot])) return;
      // The sides make a vote; products of normals that agree make it count more. They do not
      // decide, because at a corner two walls compete for the normal.
      votes_.add({entry.slot,
                  static_cast<std::uint16_t>(entry.heading - triangle.heading),
                  {triangle.center_cm[0], triangle.center_cm[1]},
                  {entry.center_cm[0], entry.center_cm[1]},
                  static_cast<std::uint16_t>(1 + entry.agreeing_dots)});
    });
  }
  if (search_.next < triangles_.size()) return true;
  dropped_ += votes_.refused();
  return false;
}

// The poses with the most votes, relative to how many triangles the place has: a place with many
// gathers more by chance.
void PlaceDatabase::State::form_hypotheses() noexcept {
  hypotheses_.clear();
  for (const PosePeak& peak : votes_.peaks()) {
    const auto triangles = static_cast<float>(places_[peak.slot].triangles);
    Hypothesis hypothesis{};
    hypothesis.slot = peak.slot;
    hypothesis.votes = peak.support;
    hypothesis.score = static_cast<float>(peak.support) / std::sqrt(triangles + 1.0F);
    hypothesis.pose = peak.T_place_query;
    hypotheses_.push_back(hypothesis);
  }
  const auto better = [this](const Hypothesis& a, const Hypothesis& b) {
    if (a.score != b.score) return a.score > b.score;
    // Two peaks of one place may have as many votes.
    if (a.slot == b.slot) return a.pose.x != b.pose.x ? a.pose.x < b.pose.x : a.pose.y < b.pose.y;
    return places_[a.slot].id < places_[b.slot].id;
  };
  std::sort(hypotheses_.begin(), hypotheses_.end(), better);
  limit_candidates();
}

// Fits the poses of some hypotheses to the keypoints and keeps those on which enough agree; false
// once none is left.
bool PlaceDatabase::State::refine_some() noexcept {
  const std::size_t end = std::min(hypotheses_.size(), search_.next + kPosesPerStep);
  for (; search_.next < end; ++search_.next) {
    Hypothesis& hypothesis = hypotheses_[search_.next];
    load_targets(hypothesis.slot);
    refine(hypothesis);
    if (pairs_.size() >= kMinInliers) hypotheses_[search_.kept++] = hypothesis;
  }
  return search_.next < hypotheses_.size();
}

void PlaceDatabase::State::rank_hypotheses() noexcept {
  hypotheses_.resize_uninitialized(search_.kept);
  std::sort(hypotheses_.begin(), hypotheses_.end(),
            [this](const Hypothesis& a, const Hypothesis& b) {
              if (a.evidence != b.evidence) return a.evidence > b.evidence;
              if (a.votes != b.votes) return a.votes > b.votes;
              return places_[a.slot].id < places_[b.slot].id;
            });
}

// Keeps the first candidates, of each session no more than allowed.
void PlaceDatabase::State::limit_candidates() noexcept {
  std::size_t kept = 0;
  for (const Hypothesis& candidate : hypotheses_) {
    if (kept == config_.max_candidates) break;
    const std::uint32_t session = places_[candidate.slot].id.session;
    const auto of_session = static_cast<std::size_t>(std::count_if(
        hypotheses_.begin(), hypotheses_.begin() + kept,
        [&](const Hypothesis& other) { return places_[other.slot].id.session == session; }));
    if (config_.max_per_session != 0 && of_session >= config_.max_per_session) continue;
    hypotheses_[kept++] = candidate;
  }
  hypotheses_.resize_uninitialized(kept);
}

}  // namespace unimapper
