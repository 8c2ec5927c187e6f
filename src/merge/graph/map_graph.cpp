// Anchor-node pose graph of several sessions.
#include "map_graph.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "many_maps_graph.hpp"
#include "site_frame.hpp"
#include "src/core/cholesky.hpp"
#include "src/merge/registration/weak_axis.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Growth of a session's plausible deformation along its path, metres per metre.
constexpr double kDeformationPerM = 0.005;

/// Graph of the given sessions; `first_node` of each session, kNone for the others.
PoseGraph build_graph(const MapState& state, std::span<const std::size_t> sessions,
                      std::span<const LoopConstraint> loops, double cauchy_scale,
                      std::vector<std::size_t>& first_node) {
  PoseGraph graph;
  first_node.assign(state.odometry.size(), kNone);
  for (const std::size_t s : sessions) {
    const std::size_t anchor = graph.anchors.size();
    graph.anchors.push_back({state.T_map_session[s], s == state.central || sessions.size() == 1});
    first_node[s] = graph.nodes.size();
    const SessionPath& odometry = state.odometry[s];
    for (std::size_t k = 0; k < odometry.size(); ++k) {
      graph.nodes.push_back({state.T_session_keyframe[s][k], anchor, k == 0});
      if (k == 0) continue;
      const std::size_t node = first_node[s] + k;
      graph.edges.push_back({node - 1, node, odometry[k - 1].inverse() * odometry[k],
                             odometry.information(k - 1, k), 0.0});
    }
  }
  for (const auto& loop : loops) {
    const std::size_t match = first_node[loop.match.session];
    const std::size_t query = first_node[loop.query.session];
    if (match == kNone || query == kNone) continue;
    graph.edges.push_back({match + loop.match.keyframe, query + loop.query.keyframe,
                           loop.T_match_query, loop.information, cauchy_scale});
  }
  return graph;
}

}  // namespace

std::vector<std::size_t> MapState::connected_sessions() const {
  std::vector<std::size_t> sessions;
  for (std::size_t s = 0; s < connected.size(); ++s) {
    if (connected[s]) sessions.push_back(s);
  }
  return sessions;
}

MapState make_map_state(std::vector<SessionPath> odometry) {
  MapState state;
  for (const auto& path : odometry) state.T_session_keyframe.push_back(path.poses());
  state.T_map_session.resize(odometry.size());
  state.connected.assign(odometry.size(), false);
  state.up.assign(odometry.size(), Eigen::Vector3d::UnitZ());
  state.odometry = std::move(odometry);
  return state;
}

LoopConstraint flipped(const LoopConstraint& loop) {
  LoopConstraint other = loop;
  std::swap(other.query, other.match);
  other.T_match_query = loop.T_match_query.inverse();
  const Eigen::Matrix3d& r = loop.T_match_query.rotation;
  // Errors (dt, theta) of the measurement map to errors of its inverse by the Jacobian
  //   [-r^T, skew(t); 0, -r], whose inverse is
  Matrix6d back = Matrix6d::Zero();
  back.topLeftCorner<3, 3>() = -r;
  back.topRightCorner<3, 3>() = -r * skew(other.T_match_query.translation) * r.transpose();
  back.bottomRightCorner<3, 3>() = -r.transpose();
  other.information = back.transpose() * loop.information * back;
  other.information = 0.5 * (other.information + other.information.transpose()).eval();
  return other;
}

double loop_chi2(const MapState& state, const LoopConstraint& loop) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  graph.nodes.push_back({state.T_map_keyframe(loop.match), 0, true});
  graph.nodes.push_back({state.T_map_keyframe(loop.query), 0, false});
  Matrix6d information = loop.information;
  if (free_axis(information)) {
    information = Cholesky<6>(bounded_by_start(Cholesky<6>(information).inverse())).inverse();
  }
  return edge_chi2(graph, {0, 1, loop.T_match_query, information, 0.0});
}

bool optimize_maps(MapState& state, std::span<const std::size_t> sessions,
                   std::span<const LoopConstraint> loops, const GraphConfig& config,
                   Variables variables) {
  if (sessions.size() > kFewSessions && positions_of(state, sessions).empty()) {
    return optimize_many_maps(state, sessions, loops, config, variables);
  }
  std::vector<std::size_t> first_node;
  PoseGraph graph = build_graph(state, sessions, loops, config.cauchy_scale, first_node);
  const SiteNode site(state, sessions, first_node, config.cauchy_scale, graph);
  if (!optimize(graph, config.max_iterations).usable) return false;
  state.T_map_site = site.T_map_site(graph);
  std::size_t anchor = 0;
  for (const std::size_t s : sessions) {
    state.T_map_session[s] = graph.anchors[anchor++].T_map_session;
    for (std::size_t k = 0; k < state.T_session_keyframe[s].size(); ++k) {
      state.T_session_keyframe[s][k] = graph.nodes[first_node[s] + k].T_session_node;
    }
  }
  return true;
}

bool deformation_is_plausible(const MapState& before, const MapState& after, std::size_t session,
                              const GraphConfig& config) {
  const SessionPath& odometry = before.odometry[session];
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const double moved = (after.T_session_keyframe[session][k].translation -
                          before.T_session_keyframe[session][k].translation)
                             .norm();
    const double sigma = std::sqrt(odometry.variance(0, k).translation);
    const double limit =
        std::max(3.0 * sigma, config.deformation_floor_m + kDeformationPerM * odometry.path_m(k));
    if (!(moved <= limit)) return false;
  }
  return true;
}

}  // namespace unimapper::merge
