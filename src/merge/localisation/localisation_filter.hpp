// Pose of a robot in the map between loops, with its covariance.
#pragma once

#include <cstddef>

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// An uncertain pose in the map: translation along the map's axes, rotation in the pose's frame.
struct UncertainPose {
  Pose pose;
  Matrix6d covariance = Matrix6d::Zero();
};

/// The pose of a loop's query that the loop and its match, taken as exact, say.
[[nodiscard]] UncertainPose pose_by_loop(const Pose& T_map_match, const LoopConstraint& loop);

/// Squared Mahalanobis distance of two independent poses, 6 degrees of freedom.
[[nodiscard]] double distance_chi2(const UncertainPose& a, const UncertainPose& b);

/// Predicts along the robot's path and corrects by loops.
class MapPoseFilter {
 public:
  /// Starts at keyframe `k`.
  void start(std::size_t k, const UncertainPose& at) {
    k_ = k;
    at_ = at;
  }
  /// Of keyframe `k`, at or after the last correction, by odometry from there.
  [[nodiscard]] UncertainPose predict(std::size_t k, const SessionPath& path) const;
  /// Corrects at keyframe `k`.
  void correct(std::size_t k, const UncertainPose& measured, const SessionPath& path);
  /// The keyframe of the last correction.
  [[nodiscard]] std::size_t keyframe() const { return k_; }

 private:
  std::size_t k_ = 0;
  UncertainPose at_;
};

}  // namespace unimapper::merge
