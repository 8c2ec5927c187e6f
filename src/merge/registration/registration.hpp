// Generalized ICP on clouds whose covariances are computed at most once.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "src/core/voxel_key.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

class PointTree;

/// Points thinned to one per leaf, each with the covariance of the surface it lies on and a
/// kd-tree over all. A covariance is estimated when it is first asked for: a registration asks for
/// less than half of them. Building one costs more than aligning two, so there is one per keyframe.
/// It never seems to change, and is safe to share between threads.
class RegistrationCloud {
 public:
  /// `ground` marks points that do not constrain the horizontal position; it may be empty (no
  /// ground known) or as long as `points`. Points that are not finite are left out. The
  /// result does not depend on the order of the points beyond rounding.
  RegistrationCloud(std::span<const Eigen::Vector3f> points, std::span<const std::uint8_t> ground,
                    const RegistrationConfig& config);
  ~RegistrationCloud();
  RegistrationCloud(RegistrationCloud&&) noexcept;
  RegistrationCloud& operator=(RegistrationCloud&&) noexcept;

  /// Number of points.
  [[nodiscard]] std::size_t size() const { return points_.size(); }
  /// Memory that it takes, roughly.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Edge of the voxels with a point each, metres: that of the configuration, or as large as the
  /// number of points demanded.
  [[nodiscard]] float leaf_m() const { return leaf_m_; }
  /// Points of the cloud, metres in its frame.
  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const { return points_; }
  /// Covariance of the surface about point `i`, square metres.
  [[nodiscard]] Eigen::Matrix3f covariance(std::size_t i) const {
    const std::atomic_ref<std::uint8_t> state(states_[i]);
    return state.load(std::memory_order_acquire) == kKnown ? covariances_[i] : made_covariance(i);
  }
  /// True for a point of the ground.
  [[nodiscard]] bool is_ground(std::size_t i) const { return ground_[i] != 0; }

  /// Index of no point.
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// Nearest point closer than sqrt(`squared_gate`), or kNone. On return `squared_gate` holds
  /// the squared distance of what was found.
  [[nodiscard]] std::uint32_t nearest(const Eigen::Vector3f& query, float& squared_gate) const;

 private:
  /// One point per voxel, in no order that means anything; the key of each voxel.
  std::vector<VoxelKey> thin();
  void sort_by(const std::vector<VoxelKey>& keys);
  [[nodiscard]] Eigen::Matrix3f estimate_covariance(std::size_t i) const;
  /// Estimates it, and keeps it unless another thread does. Several may come to the same.
  [[nodiscard]] Eigen::Matrix3f made_covariance(std::size_t i) const;

  /// States of a point's covariance; the one between is while it is written.
  static constexpr std::uint8_t kUnknown = 0;
  static constexpr std::uint8_t kBeingWritten = 1;
  static constexpr std::uint8_t kKnown = 2;

  float leaf_m_;
  std::vector<Eigen::Vector3f> points_;
  mutable std::vector<Eigen::Matrix3f> covariances_;
  mutable std::vector<std::uint8_t> states_;  ///< by point
  std::vector<std::uint8_t> ground_;
  std::unique_ptr<PointTree> tree_;
};

/// Refined pose and how well the clouds agree in it.
struct RegistrationResult {
  /// The last step was small, within the iterations allowed.
  bool converged = false;
  /// Maps the source cloud to the target; as far as it came where it did not converge.
  Pose T_target_source;
  /// Inverse covariance of the result as a PoseGraph::Edge with from = target: from the Hessian,
  /// so that it is weak along a corridor, and never better than the configured floors.
  Matrix6d information = Matrix6d::Identity();
  /// Steps that were taken.
  std::uint32_t iterations = 0;
  std::size_t matched = 0;  ///< source points with a correspondence
  double rmse_m = 0.0;      ///< across surfaces, not along them, of matched points
  /// Smallest over largest eigenvalue of the translation's information: 0 in an endless corridor.
  double condition = 0.0;
};

/// Aligns `source` (evenly thinned to `max_source_points`) to `target` from `T_target_source`,
/// first with the coarse gate, then with the fine one (Levenberg-Marquardt with correspondences
/// searched anew in every iteration). `tilt_information`: of the tilt (`tilt_of`), which is zero,
/// 1/rad²; it counts like the points, in the pose and in its information.
RegistrationResult register_clouds(
    const RegistrationCloud& target, const RegistrationCloud& source, const Pose& T_target_source,
    const RegistrationConfig& config,
    const Eigen::Matrix2d& tilt_information = Eigen::Matrix2d::Zero());

/// The pose alone to which `register_clouds` comes, or the first on the way there, the start
/// included, for which `ends_at` is true. Costs the steps up to it.
Pose registered_pose(const RegistrationCloud& target, const RegistrationCloud& source,
                     const Pose& T_target_source, const RegistrationConfig& config,
                     const Eigen::Matrix2d& tilt_information,
                     const std::function<bool(const Pose&)>& ends_at);

/// Share of structure (no ground) that coincides at a given pose, of the cloud for which it is
/// larger; only points within `radius_m` of both origins count. 0 if there are
/// fewer than 50 such points.
double structure_overlap(const RegistrationCloud& target, const RegistrationCloud& source,
                         const Pose& T_target_source, double radius_m, double distance_m);

}  // namespace unimapper::merge
