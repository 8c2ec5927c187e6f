// Registration of a scan to the local map: prediction, refinement and search.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tracker.hpp"

namespace unimapper::odometry {

namespace {

constexpr int kIterations = 30;

}  // namespace

bool is_plausible(const Velocity& velocity) noexcept {
  constexpr double kFastest_m_s = 100.0;
  constexpr double kFastest_rad_s = 20.0;
  return velocity.linear_m_s.norm() < kFastest_m_s &&
         velocity.angular_rad_s.norm() < kFastest_rad_s;
}

Pose Tracker::ahead(const Interval& interval, double share) const noexcept {
  Pose way = moved(velocity, share * std::min(interval.seconds, kLongestPrediction_s));
  // A start without any motion stays one: for a gyroscope of other axes or units.
  if (turn_known && share != 0.0) way.rotation = turn;
  return interval.T_odometry_before * way;
}

/// The velocity between two scans has the noise of both. Along a weak axis it would go on for ever:
/// the mean of the last two seconds does. It lags where the robot accelerates, which that of half a
/// second shows.
void Tracker::learn_velocity(const Velocity& v, double seconds) noexcept {
  constexpr double kMemory_s = 2.0;
  constexpr double kShortMemory_s = 0.5;
  const double share = seconds / (steady_s + seconds);
  const double short_share = seconds / (std::min(steady_s, kShortMemory_s) + seconds);
  steady_s = std::min(steady_s + seconds, kMemory_s);
  velocity = v;
  steady.linear_m_s += share * (v.linear_m_s - steady.linear_m_s);
  steady.angular_rad_s += share * (v.angular_rad_s - steady.angular_rad_s);
  recent.linear_m_s += short_share * (v.linear_m_s - recent.linear_m_s);
}

Expectation Tracker::expected(const Interval& interval) const noexcept {
  const double seconds = std::min(interval.seconds, kLongestPrediction_s);
  Pose way = moved(steady, seconds);
  if (turn_known) way.rotation = turn;
  return {interval.T_odometry_before * way,
          weak_motion.is_velocity_known() && interval.seconds <= kLongestPrediction_s,
          seconds * (recent.linear_m_s - steady.linear_m_s).norm()};
}

double Tracker::deviation_m() const noexcept {
  constexpr double kUnknown_m = 2.0;
  return deviations == 0 ? kUnknown_m : std::sqrt(squared_deviations_m2 / deviations);
}

void Tracker::learn_deviation(const Pose& predicted, const Pose& pose, double moved_m) noexcept {
  constexpr double kLeast_m = 0.1;  // a robot that stands says nothing about one that drives
  // By a gyroscope hardly any prediction is off by more, and the width would stay that of an
  // unknown deviation. Narrower than this, the Livox Avia loses its way among plants.
  constexpr double kLeastByGyroscope_m = 0.3;
  constexpr double kMoves_m = 0.02;  // less is standing
  const Pose off = predicted.inverse() * pose;
  // Length of the chord of a rotation at the mean distance of the points.
  const double chord = std::sqrt(std::max(0.0, 3.0 - off.rotation.trace()));
  double deviation = off.translation.norm() + mean_range_m() * chord;
  if (turn_known && moved_m >= kMoves_m) deviation = std::max(deviation, kLeastByGyroscope_m);
  if (deviation < kLeast_m) return;
  squared_deviations_m2 += deviation * deviation;
  ++deviations;
}

Tolerance Tracker::tolerance() const noexcept {
  constexpr double kReach = 3.0;       // of the usual deviation
  constexpr double kKernel = 1.0 / 3;  // of the usual deviation
  constexpr double kFinest = 0.05;     // kernel, in voxels
  // An error along a direction that few points determine goes on: a kernel as narrow would drop
  // them all once the prediction is off.
  constexpr double kSparse = 0.15;
  const double deviation = deviation_m();
  const double kernel_m = std::max(kFinest * config.voxel_m, kKernel * deviation);
  return {kernel_m, std::max(kSparse * config.voxel_m, kernel_m), kReach * deviation, false,
          kIterations};
}

Registered Tracker::track(const Interval& interval, const Pose& start) noexcept {
  constexpr double kCoarseFrom = 0.5;  // of a voxel: where surfaces near the prediction mislead
  const Expectation expectation = expected(interval);
  Pose begin = start;
  if (deviation_m() > kCoarseFrom * config.voxel_m) {
    Tolerance wide = tolerance();
    wide.kernel_m = wide.sparse_m = deviation_m();
    wide.is_coarse = true;
    const Registered rough =
        register_points(source.view(), maps, interval, start, expectation, wide);
    if (rough.is_valid) begin = rough.pose;
  }
  return register_points(source.view(), maps, interval, begin, expectation, tolerance());
}

Registered Tracker::refine(const Interval& interval, const Pose& start) noexcept {
  return register_points(
      source.view(), maps, interval, start, expected(interval),
      {0.3 * config.voxel_m, 0.3 * config.voxel_m, 3.0 * config.voxel_m, false, kIterations});
}

Registered Tracker::match_second(Interval& interval, const Pose& start, bool is_wide) noexcept {
  // The first scan was taken at a velocity that only this one shows.
  const bool is_swept = std::any_of(source.begin(), source.end(),
                                    [](const SourcePoint& point) { return point.time_s != 0.0F; });
  const int passes = is_swept ? 5 : 1;
  Registered found;
  found.pose = start;
  for (int pass = 0; pass < passes; ++pass) {
    found = is_wide && pass == 0 ? track(interval, found.pose) : refine(interval, found.pose);
    hold_back(interval, found);
    const Pose T_first_second = interval.T_odometry_before.inverse() * found.pose;
    found.is_valid = found.is_valid && is_plausible(velocity_of(T_first_second, interval.seconds));
    if (!found.is_valid) return found;
    begin_second(interval, T_first_second, found.pose);
  }
  return found;
}

void Tracker::begin_second(Interval& interval, const Pose& T_first_second, Pose& second) noexcept {
  const Velocity v = velocity_of(T_first_second, interval.seconds);
  interval.T_odometry_before = T_odometry_first * moved(v, first_middle_s);
  second = interval.T_odometry_before * T_first_second;
  begin_map(v);
  take_source();  // the voxels that its points remember are others now
}

Registered Tracker::better_second(Interval& interval, const Registered& found,
                                  const Pose& T_first_start, bool is_wide) noexcept {
  const double found_fit = fit(found, interval);
  const Pose T_first_second = interval.T_odometry_before.inverse() * found.pose;
  Pose start;
  begin_second(interval, T_first_start, start);
  const Registered other = match_second(interval, start, is_wide);
  if (fit(other, interval) >= found_fit) return other;
  Registered kept = found;
  begin_second(interval, T_first_second, kept.pose);
  return kept;
}

Registered Tracker::track_second(Interval& interval) noexcept {
  constexpr double kFar_s = 0.35;  // a robot goes farther than the coarse voxels show
  // Among plants a wide search finds velocities that bend both sweeps so that they fit somehow.
  Registered found = match_second(interval, interval.T_odometry_before, false);
  found = better_second(interval, found, {}, true);
  if (interval.seconds <= kFar_s) return found;
  return better_second(interval, found, search_second(interval), false);
}

Pose Tracker::search_second(const Interval& interval) noexcept {
  constexpr double kStep_m = 1.0;
  constexpr double kMost_m = 12.0;
  constexpr double kMost_m_s = 12.0;
  constexpr double kDiagonal = 0.7071;
  constexpr int kManyIterations = 16;  // the way from a start may be half a metre, and a turn
  take_sample();
  const Pose& before = interval.T_odometry_before;
  Pose best = before;
  double best_fit = -1.0;
  const double most_m = std::min(kMost_m, kMost_m_s * interval.seconds);
  for (double way_m = kStep_m; way_m <= most_m; way_m += kStep_m) {
    for (const auto& [x, y] : {std::pair{1.0, 0.0},
                               {kDiagonal, kDiagonal},
                               {0.0, 1.0},
                               {-kDiagonal, kDiagonal},
                               {-1.0, 0.0},
                               {-kDiagonal, -kDiagonal},
                               {0.0, -1.0},
                               {kDiagonal, -kDiagonal}}) {
      Pose start = before;
      start.translation += before.rotation * Eigen::Vector3d(x * way_m, y * way_m, 0.0);
      attempt(interval, start, kManyIterations, best, best_fit);
    }
  }
  return before.inverse() * best;
}

void Tracker::hold_back(const Interval& interval, Registered& found) noexcept {
  constexpr double kAsGood = 0.98;
  if (!found.is_valid || weak_motion.is_velocity_known()) return;
  const Vector6d& share = found.determination.share;
  if (std::none_of(share.begin(), share.end(), WeakMotion::is_weak)) return;
  const Pose& before = interval.T_odometry_before;
  const Registered held =
      register_points(source.view(), maps, interval, before, {before, true, 0.0}, tolerance());
  if (fit(held, interval) > kAsGood * fit(found, interval)) found = held;
}

double Tracker::fit(const Registered& found, const Interval& interval) noexcept {
  constexpr double kKernel = 0.2;  // in voxels
  if (!found.is_valid) return 0.0;
  return fit_of(source.view(), maps, interval, found.pose, kKernel * config.voxel_m);
}

void Tracker::attempt(const Interval& interval, const Pose& start, int iterations, Pose& best,
                      double& best_fit) noexcept {
  const double voxel_m = config.voxel_m;
  const Registered rough =
      register_points(sample.view(), maps, interval, start, {},
                      {2.0 * voxel_m, 2.0 * voxel_m, 9.0 * voxel_m, true, iterations});
  if (!rough.is_valid) return;
  const Registered close =
      register_points(sample.view(), maps, interval, rough.pose, {},
                      {0.5 * voxel_m, 0.5 * voxel_m, 3.0 * voxel_m, false, iterations});
  if (!close.is_valid) return;
  const double found = fit_of(sample.view(), maps, interval, close.pose, 0.2 * voxel_m);
  if (found <= best_fit) return;
  best_fit = found;
  best = close.pose;
}

void Tracker::take_sample() noexcept {
  sample.clear();
  for (std::size_t i = 0; i < source.size(); i += kSampledOneOf) sample.push_back(source[i]);
}

Registered Tracker::search(const Interval& interval) noexcept {
  constexpr int kFewIterations = 8;
  constexpr double kTurn_rad = 0.3;
  constexpr int kTurns = 3;  // to either side
  constexpr int kAllTurns = 10;
  take_sample();
  Pose best = ahead(interval);
  double best_fit = -1.0;
  for (const double share : {1.0, 0.0, 0.5, 1.5, -0.5}) {
    attempt(interval, ahead(interval, share), kFewIterations, best, best_fit);
  }
  // What is carried by hand turns about the vertical, quickly.
  const int most = interval.seconds > kLongestPrediction_s ? kAllTurns : kTurns;
  for (int i = 1; i <= most; ++i) {
    for (const double yaw_rad : {kTurn_rad * i, -kTurn_rad * i}) {
      Pose turned = interval.T_odometry_before;
      turned.rotation = rotation_of({0.0, 0.0, yaw_rad}) * turned.rotation;
      attempt(interval, turned, kFewIterations, best, best_fit);
    }
  }
  return refine(interval, best);
}

}  // namespace unimapper::odometry
