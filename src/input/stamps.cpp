// Stamps and poses of a recording, against each other
#include "src/input/stamps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

// As the pipeline's own limits: keyframe.max_pose_step_m, keyframe.max_speed_mps.
constexpr double kMostStep_m = 10.0;
constexpr double kMostSpeed_mps = 60.0;

double middle(std::vector<double>& values) {
  return values.empty() ? 0.0 : median(std::span(values));
}

/// The largest step of which far coordinates are multiples, if single precision holds them exactly.
double rounding_of(std::vector<double>& values) {
  constexpr double kFar_m = 1e4;
  constexpr std::size_t kFewest = 5;  // different ones
  constexpr double kPerMetre = 1024;  // floats are multiples of powers of two
  double farthest_m = 0.0;
  for (const double value : values) {
    farthest_m = std::max(farthest_m, std::fabs(value));
    if (!(farthest_m < 1e9) || static_cast<double>(static_cast<float>(value)) != value) return 0.0;
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (farthest_m < kFar_m || values.size() < kFewest) return 0.0;
  std::int64_t step = 0;
  for (const double value : values) {
    step = std::gcd(step, static_cast<std::int64_t>((value - values.front()) * kPerMetre));
  }
  return static_cast<double>(step) / kPerMetre;
}

/// Distance from the earth's centre, if the position is earth-centred: near sea level, and so far
/// along z that it is no height. Else 0.
double from_earth_m(const Eigen::Vector3d& position) {
  constexpr double kPole_m = 6.35e6;
  constexpr double kEquator_m = 6.39e6;
  constexpr double kHighest_m = 1e4;
  const double distance_m = position.norm();
  const bool is_near = distance_m > kPole_m && distance_m < kEquator_m;
  return is_near && std::fabs(position.z()) > kHighest_m ? distance_m : 0.0;
}

}  // namespace

bool is_jump(const Track& track, std::size_t i) {
  const double interval_s =
      1e-9 * (static_cast<double>(track.stamp_ns(i + 1)) - static_cast<double>(track.stamp_ns(i)));
  const double step_m = (track.pose(i + 1).translation - track.pose(i).translation).norm();
  return interval_s > 0.0 && step_m > kMostStep_m && step_m > kMostSpeed_mps * interval_s;
}

MotionFigures measure_motion(const Track& track) {
  MotionFigures figures;
  figures.scans = track.size;
  if (track.size < 2) return figures;
  std::vector<double> intervals;
  std::vector<double> steps;
  std::vector<double> speeds;
  std::vector<double> accelerations;
  std::array<std::vector<double>, 3> coordinates;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double climb_m = 0.0;
  Pose before = track.pose(0);
  figures.from_earth_m = from_earth_m(before.translation);
  const auto note_position = [&](const Pose& pose) {
    for (Eigen::Index a = 0; a < 3; ++a) {
      coordinates[static_cast<std::size_t>(a)].push_back(pose.translation[a]);
    }
  };
  note_position(before);
  std::int64_t stamp_before_ns = track.stamp_ns(0);
  for (std::size_t i = 1; i < track.size; ++i) {
    const Pose pose = track.pose(i);
    const std::int64_t stamp_ns = track.stamp_ns(i);
    // As doubles: a difference of stamps may exceed an int64.
    const double interval_s =
        1e-9 * (static_cast<double>(stamp_ns) - static_cast<double>(stamp_before_ns));
    const Eigen::Vector3d step = pose.translation - before.translation;
    figures.path_m += step.norm();
    steps.push_back(step.norm());
    climb_m += std::fabs(step.z());
    intervals.push_back(interval_s);
    figures.reversed += stamp_ns < stamp_before_ns ? 1 : 0;
    figures.repeated += stamp_ns == stamp_before_ns ? 1 : 0;
    if (interval_s > 0.0) {
      const Eigen::Vector3d now = step / interval_s;
      speeds.push_back(now.norm());
      if (speeds.size() > 1) accelerations.push_back((now - velocity).norm() / interval_s);
      velocity = now;
      figures.jumps += is_jump(track, i - 1) ? 1 : 0;
    }
    note_position(pose);
    before = pose;
    stamp_before_ns = stamp_ns;
  }
  figures.duration_s = 1e-9 * (static_cast<double>(track.stamp_ns(track.size - 1)) -
                               static_cast<double>(track.stamp_ns(0)));
  figures.interval_s = middle(intervals);
  figures.step_m = middle(steps);
  figures.longest_gap_s = *std::max_element(intervals.begin(), intervals.end());
  for (const double interval_s : intervals) {
    figures.gaps += interval_s > 3.0 * figures.interval_s && figures.interval_s > 0.0 ? 1 : 0;
  }
  figures.speed_mps = middle(speeds);
  figures.acceleration_mps2 = middle(accelerations);
  for (std::vector<double>& values : coordinates) {
    figures.rounding_m = std::max(figures.rounding_m, rounding_of(values));
  }
  figures.climb = figures.path_m > 0.0 ? climb_m / figures.path_m : 0.0;
  return figures;
}

Finding check_stamp_order(const MotionFigures& motion) {
  const std::size_t out_of_order = motion.reversed + motion.repeated;
  Finding finding{"order of stamps",
                  Severity::kFine,
                  static_cast<double>(out_of_order),
                  "stamps",
                  {},
                  {0.0, 0.5 * static_cast<double>(motion.scans)}};
  if (out_of_order == 0) return finding;
  const bool most = 2 * out_of_order > motion.scans;
  finding.severity = most ? Severity::kWrong : Severity::kSuspicious;
  finding.message = text(
      "%zu of %zu stamps do not increase (%zu equal, %zu earlier than the one before): sort the "
      "scans by time, and check the unit of the stamps (seconds in text files, nanoseconds in "
      "file names)",
      out_of_order, motion.scans, motion.repeated, motion.reversed);
  return finding;
}

Finding check_interval(const MotionFigures& motion) {
  constexpr double kLongest_s = 20.0;      // keyframes of a slow robot
  constexpr double kNoneFollows_s = 60.0;  // the pipeline takes the next scan's stamp for a mistake
  constexpr double kShortest_s = 0.002;    // faster than any LiDAR's frames
  Finding finding{
      "interval", Severity::kFine, motion.interval_s, "s", {}, {kLongest_s, kNoneFollows_s}};
  if (motion.scans < 3 || motion.interval_s <= 0.0) return finding;
  if (motion.interval_s <= kLongest_s && motion.interval_s >= kShortest_s) return finding;
  finding.severity = motion.interval_s > kNoneFollows_s ? Severity::kWrong : Severity::kSuspicious;
  struct Unit {
    const char* name;
    double seconds;
  };
  constexpr Unit kUnits[] = {{"milliseconds", 1e-3},
                             {"microseconds", 1e-6},
                             {"nanoseconds", 1e-9},
                             {"milliseconds read as microseconds", 1e3},
                             {"seconds read as milliseconds", 1e3},
                             {"seconds read as microseconds", 1e6}};
  const char* unit = nullptr;
  for (const Unit& candidate : kUnits) {
    const double interval_s = motion.interval_s * candidate.seconds;
    if (unit == nullptr && interval_s >= 0.01 && interval_s <= 2.0) unit = candidate.name;
  }
  finding.message =
      text("scans are %g s apart by their stamps%s%s; write stamps in seconds", motion.interval_s,
           unit == nullptr ? "" : ", which look like ", unit == nullptr ? "" : unit);
  return finding;
}

Finding check_spacing(const MotionFigures& motion) {
  // 144 km/h at 10 Hz. Measured in a town (even seed): of 81 % of the moving points removed at
  // 0.7 m 59 % are left at 4.2 m and 41 % at 5.1 m.
  constexpr double kMost_m = 4.0;
  Finding finding{"spacing", Severity::kFine, motion.step_m, "m", {}, {kMost_m, kNoLimit}};
  if (motion.scans < 3 || motion.step_m <= kMost_m) return finding;
  finding.severity = Severity::kSuspicious;
  finding.message = text(
      "scans are %.1f m and %.1f s apart (median): too sparse to tell well what moves, as each "
      "place is seen from near only once or twice; map every scan of the LiDAR, not those of "
      "keyframes only",
      motion.step_m, motion.interval_s);
  return finding;
}

Finding check_rounding(const MotionFigures& motion) {
  constexpr double kTold_m = 0.01;
  constexpr double kRefused_m = 0.1;
  Finding finding{"rounding", Severity::kFine, motion.rounding_m, "m", {}, {kTold_m, kRefused_m}};
  if (motion.rounding_m <= kTold_m) return finding;
  finding.severity = motion.rounding_m > kRefused_m ? Severity::kWrong : Severity::kSuspicious;
  finding.message = text(
      "far positions of the poses are rounded to %.2f m, as 32-bit floats or six digits do it: "
      "write them with all digits, or relative to the first pose",
      motion.rounding_m);
  return finding;
}

Finding check_frame(const MotionFigures& motion) {
  Finding finding{"frame", Severity::kFine, motion.from_earth_m, "m", {}, {}};
  if (motion.from_earth_m == 0.0) return finding;
  finding.severity = Severity::kWrong;
  finding.message = text(
      "the poses lie %.0f km from their origin, as earth-centred coordinates (ECEF) do, whose z "
      "axis is not up: convert them to a level frame, as UTM or east, north, up about the first "
      "pose",
      1e-3 * motion.from_earth_m);
  return finding;
}

Finding check_speed(const MotionFigures& motion) {
  Finding finding{"speed", Severity::kFine,           motion.speed_mps, "m/s",
                  {},      {kNoLimit, kMostSpeed_mps}};
  constexpr double kMostAcceleration_mps2 = 60.0;
  constexpr const char* kRemedy =
      "check that poses and scans belong together, that positions are in metres and stamps in "
      "seconds";
  if (motion.scans < 3) return finding;
  if (motion.speed_mps > kMostSpeed_mps || 3 * motion.jumps > motion.scans) {
    finding.severity = Severity::kWrong;
    finding.message = text("by poses and stamps the sensor moves at %.0f m/s (median): %s",
                           motion.speed_mps, kRemedy);
  } else if (motion.jumps > 0) {
    finding.severity = Severity::kSuspicious;
    finding.message = text(
        "the poses jump %zu times by more than 10 m from one scan to the next; the scan after "
        "each is left out: %s",
        motion.jumps, kRemedy);
  } else if (motion.acceleration_mps2 > kMostAcceleration_mps2) {
    finding.severity = Severity::kSuspicious;
    finding.figure = motion.acceleration_mps2;
    finding.unit = "m/s²";
    finding.limits = {kMostAcceleration_mps2, kNoLimit};
    finding.message = text("by poses and stamps the sensor accelerates by %.0f m/s² (median): %s",
                           motion.acceleration_mps2, kRemedy);
  }
  return finding;
}

}  // namespace unimapper::input
