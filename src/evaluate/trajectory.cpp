#include "unimapper/evaluate/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <stdexcept>

#include "unimapper/core/nearest_rotation.hpp"
#include "unimapper/core/quantile.hpp"

namespace unimapper::evaluate {
std::vector<PosePair> associate(std::span<const StampedPose> estimate,
                                std::span<const StampedPose> truth, std::int64_t tolerance_ns) {
  std::vector<PosePair> pairs;
  if (truth.empty()) return pairs;
  std::size_t t = 0;
  for (const StampedPose& pose : estimate) {
    const auto gap = [&](std::size_t i) { return std::abs(truth[i].stamp_ns - pose.stamp_ns); };
    while (t + 1 < truth.size() && gap(t + 1) <= gap(t)) ++t;
    if (gap(t) <= tolerance_ns) pairs.push_back({pose.T_world_sensor, truth[t].T_world_sensor});
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
