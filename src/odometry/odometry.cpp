#include "unimapper/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>

#include "accelerometer.hpp"
#include "gyroscope.hpp"
#include "local_map.hpp"
#include "motion.hpp"
#include "registration.hpp"
#include "scan_thinning.hpp"
#include "src/core/cholesky.hpp"
#include "src/core/fixed_vector.hpp"
#include "sweep.hpp"
#include "uncertainty.hpp"

namespace unimapper {

using namespace odometry;

namespace {

constexpr double kLongestPrediction_s = 1.0;  // nobody goes on at constant velocity for longer
constexpr double kCoarseVoxels = 3.0;         // edge of the coarse map's voxels, in fine ones
constexpr int kIterations = 30;
constexpr std::size_t kSampledOneOf = 6;  // points that a search takes

/// A result like the last one, with the reason why a scan is refused.
OdometryResult refusal(const OdometryResult& last, ErrorCode code, const char* message) noexcept {
  OdometryResult result = last;
  result.error = {code, message};
  return result;
}

bool is_plausible(const Velocity& velocity) noexcept {
  constexpr double kFastest_m_s = 100.0;
  constexpr double kFastest_rad_s = 20.0;
  return velocity.linear_m_s.norm() < kFastest_m_s &&
         velocity.angular_rad_s.norm() < kFastest_rad_s;
}

}  // namespace

struct LidarOdometry::State {
  explicit State(const LidarOdometryConfig& c) noexcept : config(c) {}
  void allocate(Arena& arena) noexcept;

  OdometryResult add_scan(std::int64_t stamp_ns, const PointView& points,
                          std::span<const float> time_s) noexcept;
  OdometryResult begin() noexcept;
  OdometryResult go_on(double seconds) noexcept;
  OdometryResult accept(const Registered& found, const Interval& interval, double fit) noexcept;
  OdometryResult lose(const Pose& predicted, double seconds) noexcept;

  // The scan at hand.
  [[nodiscard]] double mean_time_s() const noexcept;
  [[nodiscard]] double mean_range_m() const noexcept;
  void take_source() noexcept;
  void keep_scan() noexcept;

  // Registration.
  [[nodiscard]] std::int64_t time_ns(double after_stamp_s) const noexcept;
  [[nodiscard]] bool may_ask_imu(double seconds) const noexcept;
  void ask_gyroscope(double seconds) noexcept;
  bool turn_in_sweep(double after_middle_s, Eigen::Matrix3d& R_middle_then) const noexcept;
  void ask_accelerometer(const Interval& interval) noexcept;
  [[nodiscard]] bool is_up_known() const noexcept;
  void level(double seconds) noexcept;
  [[nodiscard]] OdometryResult levelled(const OdometryResult& in_map) const noexcept;
  [[nodiscard]] Pose ahead(const Interval& interval, double share = 1.0) const noexcept;
  void learn_velocity(const Velocity& v, double seconds) noexcept;
  [[nodiscard]] Expectation expected(const Interval& interval) const noexcept;
  [[nodiscard]] Registered track(const Interval& interval, const Pose& start) noexcept;
  [[nodiscard]] Registered track_second(Interval& interval) noexcept;
  [[nodiscard]] Registered search(const Interval& interval) noexcept;
  void attempt(const Interval& interval, const Pose& start, Pose& best, double& best_fit) noexcept;
  [[nodiscard]] Tolerance tolerance() const noexcept;
  void hold_back(const Interval& interval, Registered& found) noexcept;
  [[nodiscard]] double fit(const Registered& found, const Interval& interval) noexcept;
  [[nodiscard]] double deviation_m() const noexcept;
  void learn_deviation(const Pose& predicted, const Pose& pose, double moved_m) noexcept;

  // Local map.
  void begin_map(const Velocity& v) noexcept;
  void extend_map(std::span<const ScanPoint> points, const Interval& interval,
                  const Pose& T_odometry_now, double now_s) noexcept;

  LidarOdometry odometry;
  LidarOdometryConfig config;
  OdometryStatistics statistics;
  OdometryResult result;  // the last one, in the frame of the local map

  ScanThinning thinning;
  FixedVector<SourcePoint> source;
  FixedVector<SourcePoint> sample;
  FixedVector<ScanPoint> first;  // the scan that the map was begun with
  Pose T_odometry_first;         // at its stamp
  double first_middle_s = 0.0;   // after its stamp

  LocalMap maps[2];
  std::uint32_t scans_in_map = 0;

  Gyroscope gyroscope;
  Eigen::Matrix3d turn;  // since the scan before, by the gyroscope
  bool turn_seen = false;
  bool turn_known = false;  // and scans do not contradict it
  SweepTurns turns;         // of the scan at hand, likewise
  bool turns_known = false;

  Accelerometer accelerometer;
  Pose T_odometry_map;  // turns as drift of roll and pitch shows
  bool has_first_up = false;
  Eigen::Vector3d first_up;  // odometry frame
  double first_up_sigma_rad = 0.0;

  std::int64_t stamp_ns = 0;  // of the last scan that was accepted
  double middle_s = 0.0;      // its points' mean time, after the stamp
  Pose T_odometry_middle;     // its pose then
  Velocity velocity;          // on the way there
  Velocity steady;            // mean of those before
  double steady_s = 0.0;      // over so long a time
  WeakMotion weak_motion;
  double squared_deviations_m2 = 0.0;
  std::uint32_t deviations = 0;
  double usual_fit = 0.0;
  std::uint32_t lost_scans = 0;  // in a row
};

void LidarOdometry::State::allocate(Arena& arena) noexcept {
  constexpr std::size_t kFewerCoarse = 4;  // they are nine times larger along a plane
  maps[0].allocate(arena, config.max_voxels, config.voxel_m);
  maps[1].allocate(arena, config.max_voxels / kFewerCoarse, kCoarseVoxels * config.voxel_m);
  gyroscope.allocate(arena);
  accelerometer.allocate(arena);
  thinning.allocate(arena, config);
  source.allocate(arena, config.max_points);
  sample.allocate(arena, config.max_points / kSampledOneOf + 1);
  first.allocate(arena, config.max_points);
}

// ---------------------------------------------------------------------------------------------
// The scan at hand

double LidarOdometry::State::mean_time_s() const noexcept {
  double sum_s = 0.0;
  for (const std::uint32_t i : thinning.coarse()) {
    sum_s += static_cast<double>(thinning.fine()[i].time_s);
  }
  return sum_s / std::max(1.0, static_cast<double>(thinning.coarse().size()));
}

double LidarOdometry::State::mean_range_m() const noexcept {
  double sum_m = 0.0;
  for (const SourcePoint& point : source) {
    sum_m += static_cast<double>(point.position_m.norm());
  }
  return sum_m / std::max(1.0, static_cast<double>(source.size()));
}

void LidarOdometry::State::take_source() noexcept {
  source.clear();
  for (const std::uint32_t i : thinning.coarse()) {
    SourcePoint point;
    point.position_m = thinning.fine()[i].position_m;
    point.time_s = thinning.fine()[i].time_s - static_cast<float>(middle_s);
    source.push_back(point);
  }
}

void LidarOdometry::State::keep_scan() noexcept {
  first.clear();
  for (const ScanPoint& point : thinning.fine()) first.push_back(point);
  first_middle_s = middle_s;
  T_odometry_first = result.T_odometry_sensor;
}

// ---------------------------------------------------------------------------------------------
// Local map

void LidarOdometry::State::extend_map(std::span<const ScanPoint> points, const Interval& interval,
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

void LidarOdometry::State::begin_map(const Velocity& v) noexcept {
  for (LocalMap& map : maps) map.clear();
  scans_in_map = 0;
  const Pose T_odometry_now = T_odometry_first * moved(v, first_middle_s);
  constexpr double kAny_s = 1.0;  // any time tells the velocity
  extend_map(first.view(), {T_odometry_now * moved(v, -kAny_s), kAny_s}, T_odometry_now,
             first_middle_s);
}

// ---------------------------------------------------------------------------------------------
// Registration

Pose LidarOdometry::State::ahead(const Interval& interval, double share) const noexcept {
  Pose way = moved(velocity, share * std::min(interval.seconds, kLongestPrediction_s));
  // A start without any motion stays one: for a gyroscope of other axes or units.
  if (turn_known && share != 0.0) way.rotation = turn;
  return interval.T_odometry_before * way;
}

std::int64_t LidarOdometry::State::time_ns(double after_stamp_s) const noexcept {
  return stamp_ns + static_cast<std::int64_t>(after_stamp_s * 1e9);
}

/// Samples tell of so long a time before the scan, and no sum of times overflows.
bool LidarOdometry::State::may_ask_imu(double seconds) const noexcept {
  constexpr std::int64_t kLatest_ns = 1LL << 62U;
  return stamp_ns <= kLatest_ns && stamp_ns >= -kLatest_ns && seconds <= kLongestPrediction_s;
}

/// What the gyroscope says of the time from the scan before to the last point of this one.
void LidarOdometry::State::ask_gyroscope(double seconds) noexcept {
  turn_seen = false;
  turn_known = false;
  turns_known = false;
  if (!may_ask_imu(seconds)) return;
  turn_seen = gyroscope.rotation(time_ns(middle_s - seconds), time_ns(middle_s), turn);
  turn_known = turn_seen && !gyroscope.is_contradicted();
  statistics.scans_by_gyroscope += turn_known ? 1 : 0;
  statistics.scans_against_gyroscope += turn_seen && !turn_known ? 1 : 0;
  turns.first_s = 0.0F;
  turns.last_s = 0.0F;
  for (const ScanPoint& point : thinning.fine()) {
    const float after_s = point.time_s - static_cast<float>(middle_s);
    turns.first_s = std::min(turns.first_s, after_s);
    turns.last_s = std::max(turns.last_s, after_s);
  }
  turns_known = turn_known;
  for (int i = 0; i < SweepTurns::kCount && turns_known; ++i) {
    const double share = static_cast<double>(i) / (SweepTurns::kCount - 1);
    const double after_s = static_cast<double>(turns.first_s) +
                           share * static_cast<double>(turns.last_s - turns.first_s);
    turns_known = turn_in_sweep(after_s, turns.R_middle_then[i]);
  }
}

/// From the middle of the sweep; false where samples leave a gap.
bool LidarOdometry::State::turn_in_sweep(double after_middle_s,
                                         Eigen::Matrix3d& R_middle_then) const noexcept {
  const std::int64_t middle_ns = time_ns(middle_s);
  const std::int64_t then_ns = time_ns(middle_s + after_middle_s);
  const bool is_known =
      gyroscope.rotation(std::min(then_ns, middle_ns), std::max(then_ns, middle_ns), R_middle_then);
  if (then_ns < middle_ns) R_middle_then = Eigen::Matrix3d(R_middle_then.transpose());
  return is_known;
}

void LidarOdometry::State::ask_accelerometer(const Interval& interval) noexcept {
  if (!may_ask_imu(interval.seconds)) {
    accelerometer.lose(0.0);  // the pose is known, but no acceleration since the last one
    return;
  }
  Accelerometer::Motion motion{interval.T_odometry_before, time_ns(middle_s - interval.seconds),
                               T_odometry_middle, time_ns(middle_s)};
  for (std::uint32_t i = 0; i < result.weak.count; ++i) {
    const Eigen::Vector3d axis =
        result.T_odometry_sensor.rotation * result.weak.axes.block<3, 1>(0, static_cast<int>(i));
    motion.weak += axis * axis.transpose();
    motion.is_rotation_weak = motion.is_rotation_weak || axis.isZero();
  }
  accelerometer.move(motion);
  level(interval.seconds);
}

bool LidarOdometry::State::is_up_known() const noexcept {
  return accelerometer.is_known() && !gyroscope.is_contradicted() && !statistics.imu_contradicted();
}

/// Takes back drift of roll and pitch: turns the odometry frame about the sensor, by what up has
/// moved beyond two sigma since it was first known. Less may be the accelerometer's error, and a
/// frame that was tilted from the start stays so: levelled later, the way would be bent.
void LidarOdometry::State::level(double seconds) noexcept {
  constexpr double kSettles_s = 5.0;
  if (!is_up_known()) return;
  const Eigen::Vector3d up = T_odometry_map.rotation * accelerometer.up();
  const double sigma_rad = accelerometer.sigma_of_fit_rad();  // drift does not fit either
  if (!has_first_up) {
    has_first_up = true;
    first_up = up;
    first_up_sigma_rad = sigma_rad;
  }
  const double excess = (up - first_up).norm() - 2.0 * std::max(first_up_sigma_rad, sigma_rad);
  const Eigen::Vector3d axis = up.cross(first_up);
  if (!(excess > 0.0) || !(axis.norm() > 0.0)) return;
  const double back_rad = std::min(1.0, seconds / kSettles_s) * excess;
  const Eigen::Vector3d sensor_m = T_odometry_map * T_odometry_middle.translation;
  T_odometry_map.rotation =
      Eigen::Matrix3d(rotation_of(back_rad * axis.normalized()) * T_odometry_map.rotation);
  T_odometry_map.translation = sensor_m - T_odometry_map.rotation * T_odometry_middle.translation;
}

OdometryResult LidarOdometry::State::levelled(const OdometryResult& in_map) const noexcept {
  OdometryResult seen = in_map;
  if (is_up_known()) {
    seen.up = T_odometry_map.rotation * accelerometer.up();
    seen.up_sigma_rad = accelerometer.sigma_rad();
  }
  seen.T_odometry_sensor = T_odometry_map * in_map.T_odometry_sensor;
  Matrix6d to_odometry = Matrix6d::Identity();
  to_odometry.topLeftCorner<3, 3>() = T_odometry_map.rotation;
  seen.covariance = to_odometry * in_map.covariance * to_odometry.transpose();
  return seen;
}

/// The velocity between two scans has the noise of both. Along a weak axis it would go on for ever:
/// the mean of the last two seconds does.
void LidarOdometry::State::learn_velocity(const Velocity& v, double seconds) noexcept {
  constexpr double kMemory_s = 2.0;
  const double share = seconds / (steady_s + seconds);
  steady_s = std::min(steady_s + seconds, kMemory_s);
  velocity = v;
  steady.linear_m_s += share * (v.linear_m_s - steady.linear_m_s);
  steady.angular_rad_s += share * (v.angular_rad_s - steady.angular_rad_s);
}

Expectation LidarOdometry::State::expected(const Interval& interval) const noexcept {
  Pose way = moved(steady, std::min(interval.seconds, kLongestPrediction_s));
  if (turn_known) way.rotation = turn;
  return {interval.T_odometry_before * way,
          weak_motion.is_velocity_known() && interval.seconds <= kLongestPrediction_s};
}

double LidarOdometry::State::deviation_m() const noexcept {
  constexpr double kUnknown_m = 2.0;
  return deviations == 0 ? kUnknown_m : std::sqrt(squared_deviations_m2 / deviations);
}

void LidarOdometry::State::learn_deviation(const Pose& predicted, const Pose& pose,
                                           double moved_m) noexcept {
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

Tolerance LidarOdometry::State::tolerance() const noexcept {
  constexpr double kReach = 3.0;       // of the usual deviation
  constexpr double kKernel = 1.0 / 3;  // of the usual deviation
  constexpr double kFinest = 0.05;     // kernel, in voxels
  const double deviation = deviation_m();
  return {std::max(kFinest * config.voxel_m, kKernel * deviation), kReach * deviation, false,
          kIterations};
}

Registered LidarOdometry::State::track(const Interval& interval, const Pose& start) noexcept {
  constexpr double kCoarseFrom = 0.5;  // of a voxel: where surfaces near the prediction mislead
  const Expectation expectation = expected(interval);
  Pose begin = start;
  if (deviation_m() > kCoarseFrom * config.voxel_m) {
    Tolerance wide = tolerance();
    wide.kernel_m = deviation_m();
    wide.is_coarse = true;
    const Registered rough =
        register_points(source.view(), maps, interval, start, expectation, wide);
    if (rough.is_valid) begin = rough.pose;
  }
  return register_points(source.view(), maps, interval, begin, expectation, tolerance());
}

Registered LidarOdometry::State::track_second(Interval& interval) noexcept {
  // The first scan was taken at a velocity that only this one shows.
  const bool is_swept = std::any_of(source.begin(), source.end(),
                                    [](const SourcePoint& point) { return point.time_s != 0.0F; });
  const int passes = is_swept ? 5 : 1;
  Registered found;
  found.pose = interval.T_odometry_before;
  for (int pass = 0; pass < passes; ++pass) {
    found = track(interval, found.pose);
    hold_back(interval, found);
    const Pose T_first_second = interval.T_odometry_before.inverse() * found.pose;
    const Velocity v = velocity_of(T_first_second, interval.seconds);
    if (!found.is_valid || !is_plausible(v)) return found;
    interval.T_odometry_before = T_odometry_first * moved(v, first_middle_s);
    found.pose = interval.T_odometry_before * T_first_second;
    begin_map(v);
    take_source();  // the voxels that its points remember are others now
  }
  return found;
}

void LidarOdometry::State::hold_back(const Interval& interval, Registered& found) noexcept {
  constexpr double kAsGood = 0.98;
  if (!found.is_valid || weak_motion.is_velocity_known()) return;
  const Vector6d& share = found.determination.share;
  if (std::none_of(share.begin(), share.end(), WeakMotion::is_weak)) return;
  const Pose& before = interval.T_odometry_before;
  const Registered held =
      register_points(source.view(), maps, interval, before, {before, true}, tolerance());
  if (fit(held, interval) > kAsGood * fit(found, interval)) found = held;
}

double LidarOdometry::State::fit(const Registered& found, const Interval& interval) noexcept {
  constexpr double kKernel = 0.2;  // in voxels
  if (!found.is_valid) return 0.0;
  return fit_of(source.view(), maps, interval, found.pose, kKernel * config.voxel_m);
}

void LidarOdometry::State::attempt(const Interval& interval, const Pose& start, Pose& best,
                                   double& best_fit) noexcept {
  constexpr int kFewIterations = 8;
  const double voxel_m = config.voxel_m;
  const Registered rough = register_points(sample.view(), maps, interval, start, {},
                                           {2.0 * voxel_m, 9.0 * voxel_m, true, kFewIterations});
  if (!rough.is_valid) return;
  const Registered close = register_points(sample.view(), maps, interval, rough.pose, {},
                                           {0.5 * voxel_m, 3.0 * voxel_m, false, kFewIterations});
  if (!close.is_valid) return;
  const double found = fit_of(sample.view(), maps, interval, close.pose, 0.2 * voxel_m);
  if (found <= best_fit) return;
  best_fit = found;
  best = close.pose;
}

Registered LidarOdometry::State::search(const Interval& interval) noexcept {
  sample.clear();
  for (std::size_t i = 0; i < source.size(); i += kSampledOneOf) sample.push_back(source[i]);
  Pose best = ahead(interval);
  double best_fit = -1.0;
  for (const double share : {1.0, 0.0, 0.5, 1.5, -0.5}) {
    attempt(interval, ahead(interval, share), best, best_fit);
  }
  // What is carried by hand turns about the vertical, quickly.
  for (const double yaw_rad : {0.3, -0.3, 0.6, -0.6, 0.9, -0.9}) {
    Pose turned = interval.T_odometry_before;
    turned.rotation = rotation_of({0.0, 0.0, yaw_rad}) * turned.rotation;
    attempt(interval, turned, best, best_fit);
  }
  return register_points(source.view(), maps, interval, best, expected(interval),
                         {0.3 * config.voxel_m, 3.0 * config.voxel_m, false, kIterations});
}

// ---------------------------------------------------------------------------------------------
// Scan by scan

OdometryResult LidarOdometry::State::add_scan(std::int64_t now_ns, const PointView& points,
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

OdometryResult LidarOdometry::State::begin() noexcept {
  result.T_odometry_sensor.rotation = accelerometer.begin(stamp_ns);
  keep_scan();
  begin_map({});
  T_odometry_middle = T_odometry_first;
  result.covariance.setZero();
  result.reason = "the first scan shows no velocity";
  return result;
}

OdometryResult LidarOdometry::State::go_on(double seconds) noexcept {
  constexpr double kSuspicious = 0.8;  // of the usual fit
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
  const double as_usual = kSuspicious * usual_fit;
  if (!is_second && (found_fit < as_usual || !is_possible(found))) {
    const Registered other = search(interval);
    const double other_fit = fit(other, interval);
    // One that fits as usual contradicts what was found, wherever it is.
    if (other_fit > found_fit && (is_possible(other) || other_fit >= as_usual)) {
      found = other;
      found_fit = other_fit;
    }
  }
  const Velocity v = velocity_of(interval.T_odometry_before.inverse() * found.pose, seconds);
  const bool fits =
      found.is_valid && is_plausible(v) && is_possible(found) && found_fit >= kHopeless * usual_fit;
  return fits ? accept(found, interval, found_fit) : lose(ahead(interval), seconds);
}

OdometryResult LidarOdometry::State::accept(const Registered& found, const Interval& interval,
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

OdometryResult LidarOdometry::State::lose(const Pose& predicted, double seconds) noexcept {
  constexpr std::uint32_t kMostLostScans = 5;
  constexpr double kSlowDown = 0.5;  // whoever is lost had better not go far on
  velocity.linear_m_s *= kSlowDown;
  velocity.angular_rad_s *= kSlowDown;
  steady = velocity;
  steady_s = 0.0;
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
  keep_scan();
  begin_map({});
  T_odometry_middle = T_odometry_first;
  ++statistics.restarts;
  result.reason = "scans did not fit the local map: it is begun anew with this one";
  return result;
}

// ---------------------------------------------------------------------------------------------
// What the caller sees

std::size_t LidarOdometry::required_bytes(const LidarOdometryConfig& config) noexcept {
  if (!config.validate().ok()) return 0;
  Arena arena = Arena::measuring();
  arena.allocate<std::byte>(sizeof(State));
  State state(config);
  state.allocate(arena);
  return arena.used();
}

Expected<LidarOdometry*> LidarOdometry::create(const LidarOdometryConfig& config,
                                               std::span<std::byte> memory) noexcept {
  const Error invalid = config.validate();
  if (!invalid.ok()) return invalid;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
    return Error{ErrorCode::kMemoryMisaligned, "the memory must start on a 64-byte boundary"};
  }
  if (memory.size() < required_bytes(config)) {
    return Error{ErrorCode::kMemoryTooSmall,
                 "the memory is smaller than LidarOdometry::required_bytes(config)"};
  }
  Arena arena(memory.data(), memory.size());
  State* const state = new (arena.allocate<std::byte>(sizeof(State))) State(config);
  state->allocate(arena);
  state->odometry.state_ = state;
  return &state->odometry;
}

Error LidarOdometry::add_angular_velocity(std::int64_t stamp_ns,
                                          const Eigen::Vector3d& rad_s) noexcept {
  const Error error = state_->gyroscope.add(stamp_ns, rad_s);
  OdometryStatistics& statistics = state_->statistics;
  ++(error.ok() ? statistics.angular_velocities : statistics.angular_velocities_refused);
  return error;
}

Error LidarOdometry::add_acceleration(std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) noexcept {
  const Error error = state_->accelerometer.add(stamp_ns, m_s2);
  OdometryStatistics& statistics = state_->statistics;
  ++(error.ok() ? statistics.accelerations : statistics.accelerations_refused);
  return error;
}

OdometryResult LidarOdometry::add_scan(std::int64_t stamp_ns, const PointView& points,
                                       std::span<const float> time_s) noexcept {
  return state_->levelled(state_->add_scan(stamp_ns, points, time_s));
}

const OdometryStatistics& LidarOdometry::statistics() const noexcept {
  const Accelerometer& accelerometer = state_->accelerometer;
  state_->statistics.updates_of_up = accelerometer.updates();
  state_->statistics.updates_in_g = accelerometer.updates_in_g();
  state_->statistics.updates_implausible = accelerometer.implausible();
  return state_->statistics;
}

const LidarOdometryConfig& LidarOdometry::config() const noexcept { return state_->config; }

}  // namespace unimapper
