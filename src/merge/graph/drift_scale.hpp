// Drift of odometry, estimated from loops.
#pragma once

#include <span>
#include <vector>

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// How many times as far as modelled the odometry of each session drifts, at least 1 and at most 5:
/// the most likely scales given inter-session loops that are accepted, by the cycles through two
/// loops that follow each other. Robots of a fleet drift alike, so the prior of a session is what
/// all have in common, and the prior of that is 1. Exactly 1 where the loops do not tell otherwise,
/// and with fewer than six sessions.
[[nodiscard]] std::vector<double> drift_scales(std::span<const LoopConstraint> loops,
                                               std::span<const SessionPath> odometry);

}  // namespace unimapper::merge
