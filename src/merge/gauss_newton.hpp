// Gauss-Newton method on large pose graphs of one map.
#pragma once

#include <cstdint>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// As `optimize`, for graphs with one anchor: moves free nodes to a minimum of `graph_cost`, until
/// a step lowers it by less than the share `tolerance`. Damped where a step would raise the cost.
/// Several times faster where there are thousands of nodes. Deterministic, one thread. Throws as
/// `optimize`, and for graphs with several anchors.
SolveSummary optimize_one_map(PoseGraph& graph, std::uint32_t max_iterations, double tolerance);

}  // namespace unimapper::merge
