// Scan-to-map tracking: from one scan to the next.
#include "tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace unimapper::odometry {

namespace {

/// A result like the last one, with the reason why a scan is refused.
OdometryResult refusal(const OdometryResult& last, ErrorCode code, const char* message) noexcept {
  OdometryResult result = last;
  result.error = {code, message};
  return result;
}

}  // namespace

void Tracker::allocate(Arena& arena) noexcept {
  constexpr std::size_t kFewerCoarse = 4;  // they are nine times larger along a plane
  constexpr double kCompact = 0.24;        // points that fill a voxel have 0.29
  const double compact_m = kCompact * config.voxel_m;
  maps[0].allocate(arena, config.max_voxels, config.voxel_m, compact_m);
  maps[1].allocate(arena, config.max_voxels / kFewerCoarse, kCoarseVoxels * config.voxel_m,
                   compact_m);
  gyroscope.allocate(arena);
  accelerometer.allocate(arena);
  thinning.allocate(arena, config);
  source.allocate(arena, config.max_points);
  sample.allocate(arena, config.max_points / kSampledOneOf + 1);
  first.allocate(arena, config.max_points);
}

double Tracker::mean_time_s() const noexcept {
  double sum_s = 0.0;
  for (const std::uint32_t i : thinning.coarse()) {
    sum_s += static_cast<double>(thinning.fine()[i].time_s);
  }
  return sum_s / std::max(1.0, static_cast<double>(thinning.coarse().size()));
}

double Tracker::mean_range_m() const noexcept {
  double sum_m = 0.0;
  for (const SourcePoint& point : source) {
    sum_m += static_cast<double>(point.position_m.norm());
  }
  return sum_m / std::max(1.0, static_cast<double>(source.size()));
}

void Tracker::take_source() noexcept {
  source.clear();
  for (const std::uint32_t i : thinning.coarse()) {
    SourcePoint point;
    point.position_m = thinning.fine()[i].position_m;
    point.time_s = thinning.fine()[i].time_s - static_cast<float>(middle_s);
    source.push_back(point);
  }
}

void Tracker::keep_scan() noexcept {
  first.clear();
  for (const ScanPoint& point : thinning.fine()) first.push_back(point);
  first_middle_s = middle_s;
  T_odometry_first = result.T_odometry_sensor;
}

void Tracker::extend_map(std::span<const ScanPoint> points, const Interval& interval,
                         const Pose& T_odometry_now, double now_s) noexcept {
  const Sweep sweep = Sweep::of(points, interval.T_odometry_before, T_odometry_now,
                                interval.seconds, now_s, interval.turns);
  for (const ScanPoint& point : points) {
    const Eigen::Vector3d place_m =
        sweep.place(point.position_m.cast<double>(), point.time_s).place_m;
    for (LocalMap& map : maps) statistics.points_without_voxel += map.add(place_m) ? 0 : 1;
  }
  for (LocalMap& map : maps) map.forget_far(T_odometry_now.translation, config.max_range_m);
  statistics.voxels = maps[0].size();
  ++scans_in_map;
}

void Tracker::begin_map(const Velocity& v) noexcept {
  for (LocalMap& map : maps) map.clear();
  scans_in_map = 0;
  const Pose T_odometry_now = T_odometry_first * moved(v, first_middle_s);
  constexpr double kAny_s = 1.0;  // any time tells the velocity
  extend_map(first.view(), {T_odometry_now * moved(v, -kAny_s), kAny_s}, T_odometry_now,
             first_middle_s);
}

OdometryResult Tracker::add_scan(std::int64_t now_ns, const PointView& points,
                                 std::span<const float> time_s) noexcept {
  constexpr std::size_t kFewestPoints = 100;
  const bool is_first = statistics.scans == 0;
  if (!time_s.empty() && time_s.size() != points.count) {
    return refusal(result, ErrorCode::kInvalidConfig,
                   "there must be as many times as points, or none");
  }
  if (!is_first && now_ns <= stamp_ns) {
    return refusal(result, ErrorCode::kTimeReversed,
                   "the stamp is not later than that of the scan before");
  }
  thinning.thin(points, time_s);
  if (thinning.coarse().size() < kFewestPoints) {
    return refusal(result, ErrorCode::kEmptyScan,
                   "fewer than a hundred cells hold a point that is finite and within range");
  }
  // Unsigned, as a difference of extreme stamps overflows.
  const auto since_ns = static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(stamp_ns);
  const double now_middle_s = mean_time_s();
  const double seconds = static_cast<double>(since_ns) * 1e-9 + now_middle_s - middle_s;
  if (!is_first && !(seconds > 0.0)) {
    return refusal(result, ErrorCode::kTimeReversed,
                   "the points are not later than those of the scan before");
  }
  ++statistics.scans;
  statistics.points_refused += thinning.refused();
  stamp_ns = now_ns;
  middle_s = now_middle_s;
  return is_first ? begin() : go_on(seconds);
}

OdometryResult Tracker::begin() noexcept {
  result.T_odometry_sensor.rotation = accelerometer.begin(stamp_ns);
  keep_scan();
  begin_map({});
  T_odometry_middle = T_odometry_first;
  result.covariance.setZero();
  result.reason = "the first scan shows no velocity";
  return result;
}

OdometryResult Tracker::go_on(double seconds) noexcept {
  constexpr double kUnusual = 0.95;    // of the usual fit
  constexpr double kSuspicious = 0.9;  // the same
  constexpr double kHopeless = 0.4;    // the same
  take_source();
  ask_gyroscope(seconds);
  Interval interval{T_odometry_middle, seconds, turns_known ? &turns : nullptr};
  const bool is_second = scans_in_map == 1;
  Registered found = is_second ? track_second(interval) : track(interval, ahead(interval));
  if (!is_second) hold_back(interval, found);
  // Among plants the search finds places that fit better and where the robot cannot be. Not by the
  // gyroscope: it may be wrong.
  const Pose steadily =
      interval.T_odometry_before * moved(velocity, std::min(seconds, kLongestPrediction_s));
  const auto is_possible = [&](const Registered& r) {
    return is_second || weak_motion.is_possible(steadily, r.pose, seconds);
  };
  double found_fit = fit(found, interval);
  const auto is_below = [&](double share) {
    return !is_second && (found_fit < share * usual_fit || !is_possible(found));
  };
  const auto take_if_better = [&](const Registered& other) {
    const double other_fit = fit(other, interval);
    // One that fits as usual contradicts what was found, wherever it is.
    if (!(other_fit > found_fit) || !(is_possible(other) || other_fit >= kSuspicious * usual_fit))
      return;
    found = other;
    found_fit = other_fit;
  };
  // Coarse voxels may mislead where the prediction is right.
  if (is_below(kUnusual)) take_if_better(refine(interval, steadily));
  if (is_below(kSuspicious)) take_if_better(search(interval));
  const Velocity v = velocity_of(interval.T_odometry_before.inverse() * found.pose, seconds);
  const bool fits =
      found.is_valid && is_plausible(v) && is_possible(found) && found_fit >= kHopeless * usual_fit;
  result.fit = found_fit;
  return fits ? accept(found, interval, found_fit) : lose(ahead(interval), seconds);
}

OdometryResult Tracker::accept(const Registered& found, const Interval& interval,
                               double found_fit) noexcept {
  constexpr double kForget = 0.1;
  const bool is_second = scans_in_map == 1;
  const Pose& before = interval.T_odometry_before;
  if (!is_second) {
    learn_deviation(ahead(interval), found.pose,
                    (found.pose.translation - before.translation).norm());
  }
  if (turn_seen && !WeakMotion::is_weak(found.determination.share.tail<3>().minCoeff())) {
    gyroscope.learn(interval.T_odometry_before.rotation.transpose() * found.pose.rotation, turn,
                    moved(velocity, interval.seconds).rotation, interval.seconds);
  }
  usual_fit = is_second ? found_fit : usual_fit + kForget * (found_fit - usual_fit);
  lost_scans = 0;
  learn_velocity(velocity_of(interval.T_odometry_before.inverse() * found.pose, interval.seconds),
                 interval.seconds);
  T_odometry_middle = found.pose;
  extend_map(thinning.fine(), interval, found.pose, middle_s);

  Pose T_middle_stamp = moved(velocity, -middle_s);
  Eigen::Matrix3d turn_to_stamp;
  if (turns_known && turn_in_sweep(-middle_s, turn_to_stamp))
    T_middle_stamp.rotation = turn_to_stamp;
  result.T_odometry_sensor = found.pose * T_middle_stamp;
  result.velocity_m_s = velocity.linear_m_s;
  result.angular_velocity_rad_s = velocity.angular_rad_s;
  const Eigen::Matrix3d to_sensor = result.T_odometry_sensor.rotation.transpose();
  result.covariance = weak_motion.add(found, interval.seconds, -middle_s, to_sensor);
  result.weak = weak_motion.axes(to_sensor);
  if (is_second) {
    result.state = OdometryState::kStarting;
    result.reason = "two scans show a velocity, but not whether it is steady";
  } else {
    result.state = result.weak.count > 0 ? OdometryState::kDegenerate : OdometryState::kTracking;
    result.reason = reason_of(result.weak);
  }
  ask_accelerometer(interval);
  return result;
}

OdometryResult Tracker::lose(const Pose& predicted, double seconds) noexcept {
  constexpr std::uint32_t kMostLostScans = 5;
  constexpr double kSlowDown = 0.5;  // whoever is lost had better not go far on
  velocity.linear_m_s *= kSlowDown;
  velocity.angular_rad_s *= kSlowDown;
  steady = velocity;
  steady_s = 0.0;
  recent = velocity;
  T_odometry_middle = predicted;
  result.T_odometry_sensor = predicted * moved(velocity, -middle_s);
  result.velocity_m_s = velocity.linear_m_s;
  result.angular_velocity_rad_s = velocity.angular_rad_s;
  result.covariance = weak_motion.lose(seconds);
  accelerometer.lose(std::min(seconds, kLongestPrediction_s));
  result.weak = {};
  result.state = OdometryState::kLost;
  result.reason = "the scan does not fit the local map";
  // A map of one scan has no velocity, and the time since then would not be that of its motion.
  if (scans_in_map > 1 && ++lost_scans < kMostLostScans) return result;
  lost_scans = 0;
  usual_fit = 0.0;
  deviations = 0;
  squared_deviations_m2 = 0.0;
  velocity = {};
  steady = {};
  recent = {};
  keep_scan();
  begin_map({});
  T_odometry_middle = T_odometry_first;
  ++statistics.restarts;
  result.reason = "scans did not fit the local map: it is begun anew with this one";
  return result;
}

}  // namespace unimapper::odometry
