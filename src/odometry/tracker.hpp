// Scan-to-map tracking: its state between scans, and its steps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "accelerometer.hpp"
#include "gyroscope.hpp"
#include "local_map.hpp"
#include "motion.hpp"
#include "registration.hpp"
#include "scan_thinning.hpp"
#include "src/core/fixed_vector.hpp"
#include "sweep.hpp"
#include "uncertainty.hpp"
#include "unimapper/odometry/odometry.hpp"

namespace unimapper::odometry {

inline constexpr double kLongestPrediction_s = 1.0;  // constant velocity does not hold for longer
inline constexpr double kCoarseVoxels = 3.0;         // edge of the coarse map's, in fine voxels
inline constexpr std::size_t kSampledOneOf = 6;      // points that a search takes

/// What `LidarOdometry` computes. Poses and `result` are in the frame of the local map.
struct Tracker {
  explicit Tracker(const LidarOdometryConfig& c) noexcept : config(c) {}
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

  // Local map.
  void begin_map(const Velocity& v) noexcept;
  void extend_map(std::span<const ScanPoint> points, const Interval& interval,
                  const Pose& T_odometry_now, double now_s) noexcept;

  // Registration (scan_matching.cpp).
  [[nodiscard]] Pose ahead(const Interval& interval, double share = 1.0) const noexcept;
  void learn_velocity(const Velocity& v, double seconds) noexcept;
  [[nodiscard]] Expectation expected(const Interval& interval) const noexcept;
  [[nodiscard]] Registered track(const Interval& interval, const Pose& start) noexcept;
  [[nodiscard]] Registered refine(const Interval& interval, const Pose& start) noexcept;
  [[nodiscard]] Registered match_second(Interval& interval, const Pose& start,
                                        bool is_wide) noexcept;
  void begin_second(Interval& interval, const Pose& T_first_second, Pose& second) noexcept;
  [[nodiscard]] Registered track_second(Interval& interval) noexcept;
  [[nodiscard]] Registered better_second(Interval& interval, const Registered& found,
                                         const Pose& T_first_start, bool is_wide) noexcept;
  [[nodiscard]] Pose search_second(const Interval& interval) noexcept;
  void take_sample() noexcept;
  [[nodiscard]] Registered search(const Interval& interval) noexcept;
  void attempt(const Interval& interval, const Pose& start, int iterations, Pose& best,
               double& best_fit) noexcept;
  [[nodiscard]] Tolerance tolerance() const noexcept;
  void hold_back(const Interval& interval, Registered& found) noexcept;
  [[nodiscard]] double fit(const Registered& found, const Interval& interval) noexcept;
  [[nodiscard]] double deviation_m() const noexcept;
  void learn_deviation(const Pose& predicted, const Pose& pose, double moved_m) noexcept;

  // Gyroscope and accelerometer (imu.cpp).
  [[nodiscard]] std::int64_t time_ns(double after_stamp_s) const noexcept;
  [[nodiscard]] bool may_ask_imu(double seconds) const noexcept;
  void ask_gyroscope(double seconds) noexcept;
  bool turn_in_sweep(double after_middle_s, Eigen::Matrix3d& R_middle_then) const noexcept;
  void ask_accelerometer(const Interval& interval) noexcept;
  [[nodiscard]] bool is_up_known() const noexcept;
  void level(double seconds) noexcept;
  /// The result in the odometry frame, as the caller sees it.
  [[nodiscard]] OdometryResult levelled(const OdometryResult& in_map) const noexcept;

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
  Velocity recent;            // their mean over a shorter one
  WeakMotion weak_motion;
  double squared_deviations_m2 = 0.0;
  std::uint32_t deviations = 0;
  double usual_fit = 0.0;
  std::uint32_t lost_scans = 0;  // in a row
};

}  // namespace unimapper::odometry
