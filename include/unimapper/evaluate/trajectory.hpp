// Absolute trajectory error of merged sessions (paper section VII-B).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::evaluate {

/// A pose with its stamp.
struct StampedPose {
  std::int64_t stamp_ns = 0;  ///< time of the pose
  Pose T_world_sensor;        ///< sensor frame to world frame, metres
};

/// An estimated pose and its ground truth at the same instant.
struct PosePair {
  Pose estimate;  ///< the estimated pose
  Pose truth;     ///< the true pose
};

/// Poses farther apart in time are not of the same instant.
inline constexpr std::int64_t kSameInstantNs = 10'000'000;

/// For every stamp the index of the pose nearest in time; nothing where none is within
/// `tolerance_ns`. Both must be sorted by stamp. O(n + m).
[[nodiscard]] std::vector<std::optional<std::size_t>> nearest_in_time(
    std::span<const std::int64_t> stamps_ns, std::span<const StampedPose> poses,
    std::int64_t tolerance_ns = kSameInstantNs);

/// Pairs every estimate with the truth nearest in time, if it is at most `tolerance_ns` away.
/// Both must be sorted by stamp. O(n + m).
[[nodiscard]] std::vector<PosePair> associate(std::span<const StampedPose> estimate,
                                              std::span<const StampedPose> truth,
                                              std::int64_t tolerance_ns = kSameInstantNs);

/// A rigid alignment and what it was derived from.
struct Alignment {
  Pose T_truth_estimate;  ///< frame of the estimate to that of the truth
  /// Positions alone left a rotation undetermined (a straight line, or less than a metre of
  /// extent), so that orientations were used.
  bool used_orientations = false;
};

/// Least-squares rigid alignment of the estimate to the truth over positions (Umeyama, scale
/// fixed to one, reflections excluded). Throws std::invalid_argument when `pairs` is empty.
[[nodiscard]] Alignment align(std::span<const PosePair> pairs);

/// Summary statistics of a sample.
struct ErrorStatistics {
  double max = 0.0;       ///< largest
  double mean = 0.0;      ///< arithmetic mean
  double median = 0.0;    ///< mean of the two middle values if their number is even
  double min = 0.0;       ///< smallest
  double rmse = 0.0;      ///< root of the mean square
  double std = 0.0;       ///< standard deviation
  std::size_t count = 0;  ///< size of the sample
};

/// Statistics of `errors`; all zero when empty. `std` is the population's, as evo reports it.
[[nodiscard]] ErrorStatistics statistics(std::vector<double> errors);

/// Absolute trajectory error.
struct TrajectoryError {
  ErrorStatistics translation_m;  ///< length of the difference of the positions
  ErrorStatistics rotation_deg;   ///< angle of the relative rotation
  /// Angle between the estimate's z axis and the truth's, before alignment: how far a map is from
  /// level if the truth's z is up.
  ErrorStatistics tilt_deg;
};

/// Errors of the estimates mapped by `T_truth_estimate` against the truth.
[[nodiscard]] TrajectoryError trajectory_error(std::span<const PosePair> pairs,
                                               const Pose& T_truth_estimate);

}  // namespace unimapper::evaluate
