#include "motion_gate.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// Cells are counted in 21 bits from the keyframe's first scan: steps up to this length keep any
/// keyframe within them.
constexpr double kMaxStepM = 1000.0;

/// Beyond this, double precision is worse than 0.1 um, and no odometry means it.
constexpr double kMaxCoordinateM = 1e8;

/// No LiDAR that works pauses longer; a stamp farther ahead must be confirmed by the next one.
constexpr double kMaxPauseS = 60.0;

constexpr Error kTimeJumped = {
    ErrorCode::kTimeJump,
    "the stamp lies a minute ahead or the clock was set back; mapping continues when the next "
    "stamp follows it or the one before"};

/// In floating point, since the difference of two arbitrary stamps may not fit an integer.
double seconds_between(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  return (static_cast<double>(to_ns) - static_cast<double>(from_ns)) * 1e-9;
}

}  // namespace

Motion MotionGate::check(const Pose& pose, std::int64_t stamp_ns) noexcept {
  if (!pose.is_rigid() || pose.translation.cwiseAbs().maxCoeff() > kMaxCoordinateM) {
    return {{ErrorCode::kInvalidPose,
             "the pose is not finite, its rotation is not a rotation, or it lies beyond 1e8 m"},
            false};
  }
  if (const Error error = check_time(pose, stamp_ns); !error.ok()) return {error, false};
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

Error MotionGate::check_time(const Pose& pose, std::int64_t stamp_ns) noexcept {
  const auto follows = [stamp_ns](const Sample& sample) {
    return sample.known && stamp_ns > sample.stamp_ns &&
           seconds_between(sample.stamp_ns, stamp_ns) <= kMaxPauseS;
  };
  if (!last_.known || follows(last_)) return {};
  const bool is_past = stamp_ns <= last_.stamp_ns;
  if (follows(shifted_)) {
    if (!is_past) return {};
    follow_clock(pose, stamp_ns);
    return kTimeJumped;
  }
  shifted_ = {true, pose.translation, stamp_ns};
  if (!is_past) return kTimeJumped;
  return {ErrorCode::kTimeReversed, "the scan's stamp is not later than the one before"};
}

/// The next scan is measured against this one, in time and, unless the pose has jumped too, in
/// place.
void MotionGate::follow_clock(const Pose& pose, std::int64_t stamp_ns) noexcept {
  // No clock tells how long ago the last accepted scan was: as long as between the refused ones.
  Sample last = last_;
  last.stamp_ns = shifted_.stamp_ns;
  if (reachable(last, pose, stamp_ns)) last.position = pose.translation;
  last.stamp_ns = stamp_ns;
  last_ = last;
  jumped_ = {};
  shifted_ = {};
}

void MotionGate::accept(const Pose& pose, std::int64_t stamp_ns) noexcept {
  last_ = {true, pose.translation, stamp_ns};
  jumped_ = {};
  shifted_ = {};
}

bool MotionGate::reachable(const Sample& from, const Pose& pose,
                           std::int64_t stamp_ns) const noexcept {
  const double seconds = seconds_between(from.stamp_ns, stamp_ns);
  const double allowed = std::min(std::max(max_step_m_, max_speed_mps_ * seconds), kMaxStepM);
  return (pose.translation - from.position).squaredNorm() <= allowed * allowed;
}

}  // namespace unimapper::onboard
