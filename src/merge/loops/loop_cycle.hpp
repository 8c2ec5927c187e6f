// Cycle through two loops and the odometry between them.
#pragma once

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// Covariance of the relative pose of two keyframes by odometry, as a PoseGraph::Edge has it.
/// Translation and rotation are taken as independent: the translation has the lever of the rotation
/// in it already.
[[nodiscard]] Matrix6d odometry_covariance(const SessionPath& path, std::size_t i, std::size_t j);

/// Covariance of a loop, in the same form.
[[nodiscard]] Matrix6d loop_covariance(const LoopConstraint& loop);

/// Cycle through two loops and the odometry of both sessions between them: by how much it does not
/// close, and the covariances that explain it.
struct LoopCycle {
  Eigen::Matrix<double, 6, 1> error;  ///< in the frame of the second loop's query keyframe
  Matrix6d first_loop, query_odometry, match_odometry, second_loop;
  Matrix6d into_error;  ///< takes these to the frame of the error

  /// Covariance of the error if the odometry of both sessions drifts so many times as modelled.
  [[nodiscard]] Matrix6d covariance(double query_scale, double match_scale) const;
};

[[nodiscard]] LoopCycle loop_cycle(const LoopConstraint& a, const Matrix6d& covariance_a,
                                   const LoopConstraint& b, const Matrix6d& covariance_b,
                                   const SessionPath& query, const SessionPath& match);

/// Pairwise cycle: query odometry, one loop forwards, match odometry, the other loop back. Chi
/// square with 6 degrees of freedom, small if the two loops are consistent; each axis is weighed by
/// its own covariance. Needs loops of the same two sessions (or all within one session).
[[nodiscard]] double cycle_chi2(const LoopConstraint& a, const LoopConstraint& b,
                                const SessionPath& query, const SessionPath& match);

/// Chi square of a pairwise cycle with the covariances of both loops at hand.
[[nodiscard]] double cycle_chi2(const LoopConstraint& a, const Matrix6d& covariance_a,
                                const LoopConstraint& b, const Matrix6d& covariance_b,
                                const SessionPath& query, const SessionPath& match);

/// What odometry of both sessions may err between the places of two loops, square metres.
[[nodiscard]] double drift_between(const LoopConstraint& a, const LoopConstraint& b,
                                   const SessionPath& query, const SessionPath& match);

}  // namespace unimapper::merge
