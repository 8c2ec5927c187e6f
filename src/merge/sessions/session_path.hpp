// Keyframe poses of a session and the covariance of its odometry.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// Metres travelled up to each keyframe, by odometry.
[[nodiscard]] std::vector<double> path_lengths_m(const SessionData& session);

/// Variance of a relative pose: metres squared per axis, radians squared per axis.
struct RelativeVariance {
  double translation = 0.0;
  double rotation = 0.0;
};

/// Poses along one session and the drift model over them.
class SessionPath {
 public:
  SessionPath() = default;
  /// `slips`: by keyframe, since the one before; empty: none.
  SessionPath(std::vector<Pose> T_session_keyframe, const OdometryNoiseConfig& noise,
              const std::vector<SlipCovariance>& slips = {});

  [[nodiscard]] std::size_t size() const { return poses_.size(); }
  /// Poses in the frame of the session.
  [[nodiscard]] const std::vector<Pose>& poses() const { return poses_; }
  [[nodiscard]] const Pose& operator[](std::size_t i) const { return poses_[i]; }
  /// Metres travelled up to keyframe `i`.
  [[nodiscard]] double path_m(std::size_t i) const { return path_[i]; }
  /// Metres travelled in all.
  [[nodiscard]] double length_m() const { return path_.empty() ? 0.0 : path_.back(); }

  /// Variance of T_i_j by odometry alone, along the axis of the largest slip. Rotation errors made
  /// on the way act with the lever from where they were made to the far end. O(1).
  [[nodiscard]] RelativeVariance variance(std::size_t i, std::size_t j) const;
  /// Variance by drift alone, which is that along every axis.
  [[nodiscard]] RelativeVariance drift_variance(std::size_t i, std::size_t j) const;
  /// Covariance of slips between keyframes, along the axes of the session.
  [[nodiscard]] Eigen::Matrix3d slip(std::size_t i, std::size_t j) const;
  /// Covariance of the translation of T_i_j.
  [[nodiscard]] Eigen::Matrix3d translation_covariance(std::size_t i, std::size_t j) const;

  /// Information of the odometry edge between keyframes `i` and `j`.
  [[nodiscard]] Matrix6d information(std::size_t i, std::size_t j) const;

  /// This path with a drift so many times as large.
  [[nodiscard]] SessionPath with_drift(double scale) const;

  /// Corrected poses with the drift model of this path.
  [[nodiscard]] SessionPath with_poses(std::vector<Pose> poses) const;

 private:
  void accumulate();

  std::vector<Pose> poses_;
  std::vector<double> path_;
  // Sums over path segments of length, length * middle and length * |middle|^2.
  std::vector<Eigen::Vector3d> lever_first_;
  std::vector<double> lever_second_;
  std::vector<Eigen::Matrix3d> slip_;  // sums; empty: none
  OdometryNoiseConfig noise_;
};

/// Odometry of a session with this drift.
[[nodiscard]] SessionPath odometry_of(const SessionData& session, const OdometryNoiseConfig& noise);

}  // namespace unimapper::merge
