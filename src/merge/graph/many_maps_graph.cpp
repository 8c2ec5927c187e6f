// Pose graph of many sessions, its chains of odometry condensed.
#include "many_maps_graph.hpp"

#include <algorithm>
#include <numeric>

#include "gauss_newton.hpp"
#include "odometry_chain.hpp"

namespace unimapper::merge {
namespace {

/// Shares of the cost by which iterations improve it at least: in the end, and in trials, which
/// only find out which loops agree.
constexpr double kFinalTolerance = 1e-9;
constexpr double kTrialTolerance = 1e-5;

/// The keyframes of every session that are variables, ascending, and their nodes.
class Nodes {
 public:
  Nodes(const MapState& state, std::span<const std::size_t> sessions,
        std::span<const LoopConstraint> loops, Variables variables)
      : keyframes_(state.odometry.size()), first_node_(state.odometry.size(), 0) {
    std::size_t node = 0;
    for (const LoopConstraint& loop : loops) {
      for (const KeyframeId k : {loop.query, loop.match}) {
        keyframes_[k.session].push_back(k.keyframe);
      }
    }
    for (const std::size_t s : sessions) {
      std::vector<std::size_t>& keyframes = keyframes_[s];
      if (variables == Variables::kAllKeyframes) {
        keyframes.resize(state.odometry[s].size());
        std::iota(keyframes.begin(), keyframes.end(), std::size_t{0});
      } else {
        keyframes.push_back(0);
        std::sort(keyframes.begin(), keyframes.end());
        keyframes.erase(std::unique(keyframes.begin(), keyframes.end()), keyframes.end());
      }
      first_node_[s] = node;
      node += keyframes.size();
    }
  }

  [[nodiscard]] const std::vector<std::size_t>& of(std::size_t session) const {
    return keyframes_[session];
  }
  [[nodiscard]] std::size_t first(std::size_t session) const { return first_node_[session]; }
  [[nodiscard]] std::size_t operator[](KeyframeId k) const {
    const auto& keyframes = keyframes_[k.session];
    const auto found = std::lower_bound(keyframes.begin(), keyframes.end(), k.keyframe);
    return first_node_[k.session] + static_cast<std::size_t>(found - keyframes.begin());
  }

 private:
  std::vector<std::vector<std::size_t>> keyframes_;
  std::vector<std::size_t> first_node_;
};

PoseGraph build_graph(const MapState& state, std::span<const std::size_t> sessions,
                      std::span<const LoopConstraint> loops, const Nodes& nodes,
                      double cauchy_scale) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  for (const std::size_t s : sessions) {
    const SessionPath& odometry = state.odometry[s];
    const std::vector<std::size_t>& keyframes = nodes.of(s);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      const std::size_t k = keyframes[i];
      graph.nodes.push_back({state.T_map_keyframe({s, k}), 0, s == state.central && k == 0});
      if (i == 0) continue;
      const std::size_t before = keyframes[i - 1];
      const std::size_t node = nodes.first(s) + i;
      graph.edges.push_back({node - 1, node, odometry[before].inverse() * odometry[k],
                             chain_information(odometry, before, k), 0.0});
    }
  }
  for (const auto& loop : loops) {
    graph.edges.push_back(
        {nodes[loop.match], nodes[loop.query], loop.T_match_query, loop.information, cauchy_scale});
  }
  return graph;
}

/// Poses of a session out of those of its nodes: the first one defines its frame, those between
/// follow, those after the last one follow odometry.
void take_session(const PoseGraph& graph, const Nodes& nodes, std::size_t session,
                  MapState& state) {
  const SessionPath& odometry = state.odometry[session];
  const std::vector<std::size_t>& keyframes = nodes.of(session);
  std::vector<Pose>& poses = state.T_session_keyframe[session];
  const auto in_map = [&](std::size_t i) {
    return graph.nodes[nodes.first(session) + i].T_session_node;
  };
  Pose& T_map_session = state.T_map_session[session];
  if (session != state.central) T_map_session = in_map(0) * poses[0].inverse();
  const Pose T_session_map = T_map_session.inverse();
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    poses[keyframes[i]] = T_session_map * in_map(i);
    interpolate_chain(odometry, keyframes[i - 1], keyframes[i], poses);
  }
  for (std::size_t k = keyframes.back() + 1; k < poses.size(); ++k) {
    poses[k] = poses[k - 1] * (odometry[k - 1].inverse() * odometry[k]);
  }
}

}  // namespace

bool optimize_many_maps(MapState& state, std::span<const std::size_t> sessions,
                        std::span<const LoopConstraint> loops, const GraphConfig& config,
                        Variables variables) {
  const Nodes nodes(state, sessions, loops, variables);
  PoseGraph graph = build_graph(state, sessions, loops, nodes, config.cauchy_scale);
  const double tolerance =
      variables == Variables::kAllKeyframes ? kFinalTolerance : kTrialTolerance;
  if (!optimize_one_map(graph, config.max_iterations, tolerance).usable) return false;
  for (const std::size_t s : sessions) take_session(graph, nodes, s, state);
  return true;
}

}  // namespace unimapper::merge
