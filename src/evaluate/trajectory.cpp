#include "unimapper/evaluate/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <stdexcept>

#include "src/core/nearest_rotation.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::evaluate {

std::vector<std::optional<std::size_t>> nearest_in_time(std::span<const std::int64_t> stamps_ns,
                                                        std::span<const StampedPose> poses,
                                                        std::int64_t tolerance_ns) {
  std::vector<std::optional<std::size_t>> nearest(stamps_ns.size());
  if (poses.empty()) return nearest;
  std::size_t n = 0;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    const auto gap = [&](std::size_t of) { return std::abs(poses[of].stamp_ns - stamps_ns[i]); };
    while (n + 1 < poses.size() && gap(n + 1) <= gap(n)) ++n;
    if (gap(n) <= tolerance_ns) nearest[i] = n;
  }
  return nearest;
}

std::vector<PosePair> associate(std::span<const StampedPose> estimate,
                                std::span<const StampedPose> truth, std::int64_t tolerance_ns) {
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(estimate.size());
  for (const StampedPose& pose : estimate) stamps_ns.push_back(pose.stamp_ns);
  const auto nearest = nearest_in_time(stamps_ns, truth, tolerance_ns);
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    if (!nearest[i]) continue;
    pairs.push_back({estimate[i].T_world_sensor, truth[*nearest[i]].T_world_sensor});
  }
  return pairs;
}

Alignment align(std::span<const PosePair> pairs) {
  if (pairs.empty()) throw std::invalid_argument("no poses to align a trajectory with");
  // Below this spread the rotation would be determined by noise, not by the path.
  constexpr double kMinSpreadM = 1.0;
  const auto count = static_cast<double>(pairs.size());
  Eigen::Vector3d mean_estimate = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_truth = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    mean_estimate += pair.estimate.translation / count;
    mean_truth += pair.truth.translation / count;
  }
  Eigen::Matrix3d positions = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d orientations = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    positions += (pair.truth.translation - mean_truth) *
                 (pair.estimate.translation - mean_estimate).transpose();
    orientations += pair.truth.rotation * pair.estimate.rotation.transpose();
  }
  NearestRotation fit = nearest_rotation(positions);
  Alignment alignment;
  if (std::sqrt(fit.deciding_value / count) < kMinSpreadM) {
    // The same least squares with the axes of every pose as three further unit vectors.
    fit = nearest_rotation(positions + orientations);
    alignment.used_orientations = true;
  }
  alignment.T_truth_estimate = {fit.rotation, mean_truth - fit.rotation * mean_estimate};
  return alignment;
}

ErrorStatistics statistics(std::vector<double> errors) {
  ErrorStatistics s;
  s.count = errors.size();
  if (errors.empty()) return s;
  std::sort(errors.begin(), errors.end());
  const auto count = static_cast<double>(errors.size());
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (const double e : errors) {
    sum += e;
    sum_of_squares += e * e;
  }
  s.min = errors.front();
  s.max = errors.back();
  s.mean = sum / count;
  s.rmse = std::sqrt(sum_of_squares / count);
  double variance = 0.0;
  for (const double e : errors) variance += (e - s.mean) * (e - s.mean) / count;
  s.std = std::sqrt(variance);
  const std::span values(errors);
  s.median = 0.5 * (quantile(values, 0.5) + median(values));  // of an even number, both middle ones
  return s;
}

TrajectoryError trajectory_error(std::span<const PosePair> pairs, const Pose& T_truth_estimate) {
  std::vector<double> translations;
  std::vector<double> rotations;
  std::vector<double> tilts;
  for (const PosePair& pair : pairs) {
    const Pose error = pair.truth.inverse() * (T_truth_estimate * pair.estimate);
    translations.push_back(error.translation.norm());
    rotations.push_back(rotation_angle(error.rotation) * kDegreesPerRadian);
    const Eigen::Vector3d up = pair.estimate.rotation * pair.truth.rotation.row(2).transpose();
    tilts.push_back(std::atan2(up.head<2>().norm(), up.z()) * kDegreesPerRadian);
  }
  return {statistics(std::move(translations)), statistics(std::move(rotations)),
          statistics(std::move(tilts))};
}

}  // namespace unimapper::evaluate
