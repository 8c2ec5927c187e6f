// Poses that were interpolated between few given ones
#include "src/input/pose_rate.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/core/rotation_vector.hpp"
#include "src/input/pose_noise.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

/// From a scan to the next.
struct Rate {
  double lasts_s = 0.0;
  Eigen::Vector3d moving = Eigen::Vector3d::Zero();   ///< m/s, in the world
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();  ///< rad/s
};

std::vector<Rate> rates_of(const Track& track) {
  std::vector<Rate> rates;
  for (std::size_t i = 1; i < track.size; ++i) {
    Rate& rate = rates.emplace_back();
    rate.lasts_s = static_cast<double>(track.stamp_ns(i) - track.stamp_ns(i - 1)) * 1e-9;
    if (!(rate.lasts_s > 0.0)) continue;
    const Pose before = track.pose(i - 1);
    const Pose after = track.pose(i);
    rate.moving = (after.translation - before.translation) / rate.lasts_s;
    rate.turning = rotation_vector(before.rotation.transpose() * after.rotation) / rate.lasts_s;
  }
  return rates;
}

bool is_moving(const Rate& rate) {
  constexpr double kMoves_mps = 0.05;
  constexpr double kTurns_radps = 0.02;
  return rate.moving.norm() > kMoves_mps || rate.turning.norm() > kTurns_radps;
}

/// Whether the motion goes on as before, but for what files round.
bool is_straight(const Rate& before, const Rate& after) {
  constexpr double kRounded_m = 3e-4;
  constexpr double kRounded_rad = 1e-4;
  return (after.moving - before.moving).norm() * after.lasts_s < kRounded_m &&
         (after.turning - before.turning).norm() * after.lasts_s < kRounded_rad;
}

}  // namespace

PoseRate measure_pose_rate(const Track& track) {
  constexpr std::size_t kFewest = 6;  // given poses
  constexpr std::size_t kLongest = 2;
  const std::vector<Rate> rates = rates_of(track);
  // A given pose lies on a scan, or between two: then motion changes at both.
  std::vector<std::size_t> lengths;
  std::vector<double> intervals_s;
  std::vector<double> off_deg;
  std::vector<double> off_m;
  double since_s = 0.0;
  for (std::size_t k = 1; k < rates.size(); ++k) {
    since_s += rates[k].lasts_s;
    if (!is_moving(rates[k - 1]) || !is_moving(rates[k]) || is_straight(rates[k - 1], rates[k])) {
      continue;
    }
    const std::size_t first = k;
    while (k + 1 < rates.size() && !is_straight(rates[k], rates[k + 1])) ++k;
    lengths.push_back(1 + k - first);
    intervals_s.push_back(since_s);
    since_s = 0.0;
    for (std::size_t n = first + 1; n <= k; ++n) since_s += rates[n].lasts_s;
    const double eighth_s = intervals_s.back() / 8.0;
    off_deg.push_back(kDegreesPerRadian * eighth_s *
                      (rates[k].turning - rates[first - 1].turning).norm());
    off_m.push_back(eighth_s * (rates[k].moving - rates[first - 1].moving).norm());
  }
  if (lengths.size() < kFewest || median(std::span(lengths)) > kLongest) return {};
  // Of three scans one is between.
  constexpr double kFewestScans = 2.5;
  std::vector<double> lasting_s;
  for (const Rate& rate : rates) lasting_s.push_back(rate.lasts_s);
  const double interval_s = median(std::span(intervals_s));
  if (interval_s < kFewestScans * median(std::span(lasting_s))) return {};
  constexpr double kMost = 0.9;
  return {interval_s, quantile(std::span(off_deg), kMost), quantile(std::span(off_m), kMost)};
}

bool is_too_sparse(const PoseRate& rate) {
  constexpr double kOff_deg = 0.1;
  constexpr double kOff_m = 0.03;
  return rate.interval_s > 0.0 && (rate.off_deg > kOff_deg || rate.off_m > kOff_m);
}

Finding check_pose_rate(const PoseRate& rate, const Finding& other) {
  Finding finding{"pose rate", other.severity, rate.interval_s, "s", {}, {}};
  finding.message =
      text(
          "poses are %.2f s apart and were interpolated for the scans between, which is off by up "
          "to %.1f degrees and %.2f m where the robot turns: give the odometry at its own rate, "
          "or only the scans that have a pose of their own; what else is found may be due to "
          "that: ",
          rate.interval_s, rate.off_deg, rate.off_m) +
      other.message;
  return finding;
}

}  // namespace unimapper::input
