#include "motion_gate.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// Cells are counted in 21 bits from the keyframe's first scan: steps up to this length keep any
/// keyframe within them.
constexpr double kMaxStepM = 1000.0;

/// Beyond this, double precision is worse than 0.1 um, and no odometry means it.
constexpr double kMaxCoordinateM = 1e8;

}  // namespace

Motion MotionGate::check(const Pose& pose, std::int64_t stamp_ns) noexcept {
  if (!pose.is_rigid() || pose.translation.cwiseAbs().maxCoeff() > kMaxCoordinateM) {
    return {{ErrorCode::kInvalidPose,
             "the pose is not finite, its rotation is not a rotation, or it lies beyond 1e8 m"},
            false};
  }
  if (last_.known && stamp_ns <= last_.stamp_ns) {
    return {{ErrorCode::kTimeReversed, "the scan's stamp is not later than the one before"}, false};
  }
  if (!last_.known || reachable(last_, pose, stamp_ns)) return {};
  if (jumped_.known && stamp_ns > jumped_.stamp_ns && reachable(jumped_, pose, stamp_ns)) {
    return {{}, true};
  }
  jumped_ = {true, pose.translation, stamp_ns};
  return {{ErrorCode::kPoseJump,
           "the pose moved farther than possible since the last scan; mapping continues when the "
           "next pose confirms either of them"},
          false};
}

void MotionGate::accept(const Pose& pose, std::int64_t stamp_ns) noexcept {
  last_ = {true, pose.translation, stamp_ns};
  jumped_ = {};
}

bool MotionGate::reachable(const Sample& from, const Pose& pose,
                           std::int64_t stamp_ns) const noexcept {
  const double seconds =
      (static_cast<double>(stamp_ns) - static_cast<double>(from.stamp_ns)) * 1e-9;
  const double allowed = std::min(std::max(max_step_m_, max_speed_mps_ * seconds), kMaxStepM);
  return (pose.translation - from.position).squaredNorm() <= allowed * allowed;
}

}  // namespace unimapper::onboard
