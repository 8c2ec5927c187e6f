#include "ports/datasets/sweep_motion.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::datasets {

SweepMotion::SweepMotion(const SensorMotion& poses, std::int64_t stamp_ns, const Scan& scan,
                         const TimeReading& reading) {
  const auto [first, last] = std::minmax_element(scan.time_s.begin(), scan.time_s.end());
  first_s_ = *first;
  constexpr float kStep_s = 0.001F;
  constexpr float kMostSteps = 2000.0F;
  const float steps = std::clamp(std::ceil((*last - *first) / kStep_s), 1.0F, kMostSteps);
  steps_per_s_ = *last > *first ? steps / (*last - *first) : 0.0F;
  const Pose T_stamp_odometry = poses.at(stamp_ns).inverse();
  for (int step = 0; step <= static_cast<int>(steps); ++step) {
    const double share = step / static_cast<double>(steps);
    const double time_s = *first + share * (static_cast<double>(*last) - *first);
    const double since_stamp_s = reading.sign * time_s + reading.offset_s;
    const Pose moved =
        T_stamp_odometry * poses.at(stamp_ns + static_cast<std::int64_t>(1e9 * since_stamp_s));
    T_stamp_time_.push_back({moved.rotation.cast<float>(), moved.translation.cast<float>()});
  }
}

Eigen::Vector3f SweepMotion::operator()(const Scan::Point& point, float time_s) const {
  // Between poses a millisecond apart the chord is as good as the arc.
  const float at = std::clamp((time_s - first_s_) * steps_per_s_, 0.0F,
                              static_cast<float>(T_stamp_time_.size() - 1));
  const auto before = std::min(static_cast<std::size_t>(at), T_stamp_time_.size() - 2);
  const float share = at - static_cast<float>(before);
  const Eigen::Vector3f p(point.x, point.y, point.z);
  const auto moved = [&](const Step& step) -> Eigen::Vector3f {
    return step.rotation * p + step.translation;
  };
  return (1.0F - share) * moved(T_stamp_time_[before]) + share * moved(T_stamp_time_[before + 1]);
}

void deskew(const SensorMotion& poses, std::int64_t stamp_ns, Scan& scan) {
  if (scan.time_s.size() != scan.points.size() || scan.points.empty()) return;
  const SweepMotion motion(poses, stamp_ns, scan);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    Scan::Point& point = scan.points[i];
    const Eigen::Vector3f moved = motion(point, scan.time_s[i]);
    if (!moved.allFinite()) continue;
    point.x = moved.x();
    point.y = moved.y();
    point.z = moved.z();
  }
  // The points are those of the stamp now.
  scan.time_s.clear();
}

}  // namespace unimapper::datasets
