// Gauss-Newton method on large pose graphs of one map.
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// As `optimize`, for graphs with one anchor: moves free nodes to a minimum of `graph_cost`, until
/// a step lowers it by less than the share `tolerance`. Damped where a step would raise the cost.
/// Several times faster where there are thousands of nodes. Deterministic, one thread. Throws as
/// `optimize`, and for graphs with several anchors.
SolveSummary optimize_one_map(PoseGraph& graph, std::uint32_t max_iterations, double tolerance);

/// Marginal covariance of each node of a graph with one anchor, by translations in the map frame
/// and rotations applied on the right, metres and radians, linearised where the nodes are; zero for
/// fixed nodes and those without edges. Empty where the edges leave a node free. Costs two
/// factorisations. Throws as `optimize_one_map`.
std::vector<Matrix6d> node_covariances(PoseGraph graph);

}  // namespace unimapper::merge
