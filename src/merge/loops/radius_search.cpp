// Loop candidates between nearby keyframes of aligned sessions (paper section VI, R).
#include "radius_search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/core/sensor.hpp"
#include "verification_rounds.hpp"

namespace unimapper::merge {
namespace {

constexpr double kWideFovDeg = 180.0;
/// Path between keyframes that are searched for, metres.
constexpr double kSearchSpacingM = 4.0;

double horizontal_fov_deg(const SessionData& session) {
  const SensorModel* model = find_sensor(session.info.sensor);
  return model == nullptr ? 360.0 : static_cast<double>(model->horizontal_fov_deg);
}

/// Largest relative heading at which two sensors at one position have a common view.
double max_relative_heading(const SessionData& a, const SessionData& b) {
  const double fov = std::min(horizontal_fov_deg(a), horizontal_fov_deg(b));
  const double wider = std::max(horizontal_fov_deg(a), horizontal_fov_deg(b));
  return wider >= kWideFovDeg ? 4.0 : 0.5 * fov / kDegreesPerRadian;
}

struct Neighbor {
  double distance = 0.0;
  std::size_t keyframe = 0;
  friend auto operator<=>(const Neighbor&, const Neighbor&) = default;
};

class RadiusSearch {
 public:
  RadiusSearch(const std::vector<SessionData>& sessions, std::vector<std::vector<Pose>> poses,
               std::span<const LoopConstraint> known, const MergeConfig& config)
      : sessions_(sessions), config_(config), poses_(std::move(poses)) {
    for (const SessionData& session : sessions) path_.push_back(path_lengths_m(session));
    for (const auto& loop : known) {
      const auto [earlier, later] = std::minmax(loop.query, loop.match);
      known_.insert({earlier, later});
      if (!loop.is_intra_session()) held_by_[later].insert(earlier.session);
    }
  }

  void search(std::size_t query, std::size_t match, std::vector<LoopCandidate>& found) const {
    double next_m = 0.0;
    for (std::size_t q = 0; q < poses_[query].size(); ++q) {
      if (path_[query][q] < next_m || is_held({query, q}, match)) continue;
      const auto neighbors = nearest({query, q}, match);
      for (const Neighbor& n : neighbors) {
        LoopCandidate candidate;
        candidate.query = {query, q};
        candidate.match = {match, n.keyframe};
        candidate.T_match_query = poses_[match][n.keyframe].inverse() * poses_[query][q];
        candidate.accepted = true;
        found.push_back(candidate);
      }
      if (!neighbors.empty()) next_m = path_[query][q] + kSearchSpacingM;
    }
  }

 private:
  /// Enough other sessions before the keyframe's hold it by loops.
  [[nodiscard]] bool is_held(KeyframeId query, std::size_t match) const {
    const auto held = held_by_.find(query);
    if (query.session == match || held == held_by_.end()) return false;
    return held->second.size() - held->second.count(match) >= kSessionsPerKeyframe;
  }

  [[nodiscard]] std::vector<Neighbor> nearest(KeyframeId query, std::size_t match) const {
    const Pose& T_map_query = poses_[query.session][query.keyframe];
    const double turn = max_relative_heading(sessions_[query.session], sessions_[match]);
    std::vector<Neighbor> neighbors;
    for (std::size_t m = 0; m < poses_[match].size(); ++m) {
      if (query.session == match &&
          (m >= query.keyframe || query.keyframe - m < config_.loops.min_keyframe_gap ||
           path_[match][query.keyframe] - path_[match][m] < config_.loops.min_path_gap_m)) {
        continue;
      }
      const Pose& T_map_match = poses_[match][m];
      const double distance = (T_map_match.translation - T_map_query.translation).norm();
      if (!(distance < config_.radius.radius_m)) continue;
      if (rotation_angle(T_map_match.rotation.transpose() * T_map_query.rotation) > turn) continue;
      neighbors.push_back({distance, m});
    }
    std::sort(neighbors.begin(), neighbors.end());
    // One loop per keyframe and other session.
    if (neighbors.size() > 1) neighbors.resize(1);
    std::erase_if(neighbors, [&](const Neighbor& n) {
      return known_.count(std::minmax(query, KeyframeId{match, n.keyframe})) != 0;
    });
    return neighbors;
  }

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  std::vector<std::vector<Pose>> poses_;
  std::vector<std::vector<double>> path_;
  std::set<std::pair<KeyframeId, KeyframeId>> known_;
  std::map<KeyframeId, std::set<std::size_t>> held_by_;  ///< earlier sessions, by keyframe
};

}  // namespace

std::vector<LoopCandidate> find_radius_candidates(const std::vector<SessionData>& sessions,
                                                  const Alignment& alignment,
                                                  std::span<const LoopConstraint> known,
                                                  const MergeConfig& config) {
  std::vector<std::vector<Pose>> poses(sessions.size());
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      poses[s].push_back(alignment.T_map_keyframe({s, k}));
    }
  }
  const RadiusSearch search(sessions, std::move(poses), known, config);
  std::vector<LoopCandidate> found;
  for (std::size_t match = 0; match < sessions.size(); ++match) {
    for (std::size_t query = match; query < sessions.size(); ++query) {
      if (alignment.connected[match] && alignment.connected[query]) {
        search.search(query, match, found);
      }
    }
  }
  return found;
}

std::vector<LoopCandidate> find_radius_candidates(const std::vector<SessionData>& sessions,
                                                  std::size_t query, std::size_t match,
                                                  std::vector<Pose> T_common_query_keyframe,
                                                  std::vector<Pose> T_common_match_keyframe,
                                                  const MergeConfig& config) {
  std::vector<std::vector<Pose>> poses(sessions.size());
  poses[query] = std::move(T_common_query_keyframe);
  poses[match] = std::move(T_common_match_keyframe);
  std::vector<LoopCandidate> found;
  RadiusSearch(sessions, std::move(poses), {}, config).search(query, match, found);
  return found;
}

}  // namespace unimapper::merge
