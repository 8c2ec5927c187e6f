// Gravity estimator: the direction of up from the planes of the static scene
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// A planar voxel of the static scene that may be part of a wall.
struct WallPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit length, either sign
  float normal_variance = 0.0F;                      ///< of its direction, rad²
  /// Number of the patch it belongs to, e.g. a piece of facade: the planes of a patch err together,
  /// only patches are independent. Counted modulo `GravityEstimator::kPatches`.
  std::uint32_t patch = 0;
};

/// What one keyframe shows of up, along the odometry's axes.
struct GravityScene {
  std::span<const WallPlane> walls;  ///< walls and whatever else is upright: cars, plants
  /// Sum of the ground's unit normals, those with z > 0; zero: there is no ground.
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();
};

/// The direction of up, as far as it is known.
struct UpEstimate {
  /// Unit vector in the odometry frame; the odometry's z axis where `known` is false.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  /// Covariance of `up`, rad²; no variance along `up`. Zero where `known` is false.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  bool known = false;
  /// The scene differs by more than three sigma from what the odometry promises.
  bool contradicted = false;
};

/// Estimates up keyframe by keyframe: a robust fit to "walls are perpendicular to up" with a weak
/// term for the ground, a filter over the session, and the odometry's promise. The covariance
/// comes from the scatter of the residuals (docs/design/gravity.md). Causal; no memory besides its
/// members; every loop bounded; the same bits on every machine.
class GravityEstimator {
 public:
  static constexpr std::uint32_t kPatches = 256;

  explicit GravityEstimator(const OdometryConfig& config) noexcept;

  /// Takes what the next keyframe shows; normals that are not finite or not of unit length are
  /// ignored. O(walls), in a dozen passes.
  const UpEstimate& add(const GravityScene& scene) noexcept;

  /// The odometry was restarted: what the session has shown holds no more.
  void forget() noexcept;

  [[nodiscard]] const UpEstimate& estimate() const noexcept { return estimate_; }

 private:
  // Without alignment of their own the layout is the same whatever instruction set a file is
  // compiled for.
  using Vector = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
  using Matrix = Eigen::Matrix<double, 2, 2, Eigen::DontAlign>;
  /// A direction of up as its slope (x / z, y / z), with the slope's covariance.
  struct Slope {
    Vector mean = Vector::Zero();
    Matrix covariance = Matrix::Zero();
    bool valid = false;
  };
  /// What one patch contributes to the fit.
  struct Patch {
    Vector pull = Vector::Zero();      ///< its part of the gradient
    Vector leverage = Vector::Zero();  ///< the pull per radian that it leans
    bool used = false;
  };

  Slope measure(const GravityScene& scene) noexcept;
  /// Covariance of the fit that ended at `slope`; not valid where the fit is no minimum.
  void add_covariance(const GravityScene& scene, Slope& slope) noexcept;
  void filter(const Slope& measured) noexcept;
  void conclude() noexcept;

  double promise_sigma_;  ///< of the odometry's z axis, rad; 0: promises nothing
  Slope session_;
  UpEstimate estimate_;
  Patch patches_[kPatches];
};

}  // namespace unimapper::onboard
