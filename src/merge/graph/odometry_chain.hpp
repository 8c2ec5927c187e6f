// Odometry over several keyframes as one measurement.
#pragma once

#include <cstddef>
#include <vector>

#include "src/merge/sessions/session_path.hpp"

namespace unimapper::merge {

/// Information of T_i_j that the odometry edges between neighbours from `i` to `j` (later than `i`)
/// have together, to first order, as a PoseGraph::Edge has it: what is left of them in a pose graph
/// when the keyframes between are marginalised out. O(j - i).
[[nodiscard]] Matrix6d chain_information(const SessionPath& odometry, std::size_t i, std::size_t j);

/// Sets the poses between `i` and `j` to the most likely ones given those two, to first order: the
/// other half of the marginalisation. O(j - i).
void interpolate_chain(const SessionPath& odometry, std::size_t i, std::size_t j,
                       std::vector<Pose>& T_session_keyframe);

}  // namespace unimapper::merge
