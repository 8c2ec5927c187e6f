// Marginal standard deviations of keyframe positions in a merged map.
#include "position_sigma.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "gauss_newton.hpp"
#include "src/merge/sessions/session_path.hpp"

namespace unimapper::merge {
namespace {

/// Shorter stretches of a session are not told: they are the first or last keyframes of a drive.
constexpr double kShortestStretchM = 10.0;

/// Along the axis of a horizontal position that is known least.
double largest_sigma_m(const Eigen::Matrix2d& covariance) {
  const double middle = 0.5 * (covariance(0, 0) + covariance(1, 1));
  const double half = 0.5 * (covariance(0, 0) - covariance(1, 1));
  return std::sqrt(std::max(0.0, middle + std::hypot(half, covariance(0, 1))));
}

/// Keyframes of all sessions in the map; `first_node` of each.
PoseGraph graph_of(const std::vector<SessionData>& sessions, const MergeResult& result,
                   const OdometryNoiseConfig& odometry, std::vector<std::size_t>& first_node) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const MergedSession& merged = result.sessions[s];
    first_node.push_back(graph.nodes.size());
    if (!is_in_map(merged.status)) continue;
    const SessionPath path = odometry_of(sessions[s], odometry).with_drift(merged.drift_scale);
    for (std::size_t k = 0; k < path.size(); ++k) {
      const bool is_origin = merged.status == SessionStatus::kCentral && k == 0;
      const std::size_t node = graph.nodes.size();
      graph.nodes.push_back({merged.T_map_keyframe[k], 0, is_origin});
      if (k == 0) continue;
      graph.edges.push_back(
          {node - 1, node, path[k - 1].inverse() * path[k], path.information(k - 1, k), 0.0});
    }
  }
  for (const LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted) continue;
    // A session that is not in the map has no nodes, and may have loops of its own.
    if (!is_in_map(result.sessions[loop.match.session].status)) continue;
    if (!is_in_map(result.sessions[loop.query.session].status)) continue;
    graph.edges.push_back({first_node[loop.match.session] + loop.match.keyframe,
                           first_node[loop.query.session] + loop.query.keyframe, loop.T_match_query,
                           loop.information, 0.0});
  }
  return graph;
}

}  // namespace

std::vector<std::vector<double>> position_sigmas_m(const std::vector<SessionData>& sessions,
                                                   const MergeResult& result,
                                                   const OdometryNoiseConfig& odometry) {
  std::vector<std::vector<double>> sigmas(sessions.size());
  std::vector<std::size_t> first_node;
  PoseGraph graph = graph_of(sessions, result, odometry, first_node);
  std::vector<std::size_t> central;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (result.sessions[s].status != SessionStatus::kCentral) continue;
    central.resize(sessions[s].keyframes.size());
    std::iota(central.begin(), central.end(), first_node[s]);
  }
  if (central.empty()) return sigmas;
  const std::vector<Eigen::Matrix2d> covariances = position_covariances(std::move(graph), central);
  if (covariances.empty()) return sigmas;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (!is_in_map(result.sessions[s].status)) continue;
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      sigmas[s].push_back(largest_sigma_m(covariances[first_node[s] + k]));
    }
  }
  return sigmas;
}

std::string unsure_text(const SessionData& session, const std::vector<double>& sigmas_m) {
  const std::vector<double> path = path_lengths_m(session);
  std::string text;
  double worst_m = 0.0;
  for (std::size_t first = 0, end = 0; first < sigmas_m.size(); first = end + 1) {
    double sigma_m = 0.0;
    for (end = first; end < sigmas_m.size() && sigmas_m[end] > kUnsureM; ++end) {
      sigma_m = std::max(sigma_m, sigmas_m[end]);
    }
    if (sigma_m <= worst_m) continue;
    const double length_m = path[end - 1] - path[first];
    if (length_m < kShortestStretchM && end - first < sigmas_m.size()) continue;
    worst_m = sigma_m;
    char words[200];
    std::snprintf(words, sizeof words,
                  "positions are sure to %.1f m only in keyframes %u to %u, %.0f m of path, which "
                  "too few loops hold; drive there again, or state a link",
                  sigma_m, static_cast<unsigned>(session.keyframes[first].sequence),
                  static_cast<unsigned>(session.keyframes[end - 1].sequence), length_m);
    text = words;
  }
  return text;
}

}  // namespace unimapper::merge
