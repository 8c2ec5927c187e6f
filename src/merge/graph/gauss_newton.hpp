// Gauss-Newton method on large pose graphs of one map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// As `optimize`, for graphs with one anchor: moves free nodes to a minimum of `graph_cost`, until
/// a step lowers it by less than the share `tolerance`. Damped where a step would raise the cost.
/// Several times faster where there are thousands of nodes. Deterministic, one thread. Throws as
/// `optimize`, and for graphs with several anchors.
SolveSummary optimize_one_map(PoseGraph& graph, std::uint32_t max_iterations, double tolerance);

/// Covariance of each node's horizontal position in a graph with one anchor, square metres,
/// linearised where the nodes are. Relative to the nodes of `frame`: what a shift and a turn about
/// the vertical that fit these best leave of the errors. Empty where the edges leave a node free.
/// Costs two factorisations. Throws as `optimize_one_map`.
std::vector<Eigen::Matrix2d> position_covariances(PoseGraph graph,
                                                  std::span<const std::size_t> frame);

}  // namespace unimapper::merge
