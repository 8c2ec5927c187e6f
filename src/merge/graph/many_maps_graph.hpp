// Pose graph of many sessions in the frame of the map.
#pragma once

#include "map_graph.hpp"

namespace unimapper::merge {

/// As `optimize_maps`, for many sessions: all poses are in the frame of the map, so that no anchor
/// couples all loops of its session, and `kLoopEnds` leaves out keyframes without loops.
bool optimize_many_maps(MapState& state, std::span<const std::size_t> sessions,
                        std::span<const LoopConstraint> loops, const GraphConfig& config,
                        Variables variables);

}  // namespace unimapper::merge
