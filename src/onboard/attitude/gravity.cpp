#include "gravity.hpp"

#include <algorithm>
#include <cmath>

#include "src/core/cholesky.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {
namespace {

constexpr double rad(double degrees) { return degrees / kDegreesPerRadian; }
constexpr double square(double value) { return value * value; }

// Widths of the biweight kernel: a wide one first, so that walls count whatever the mounting, then
// narrower ones, within which plants and cars no longer do.
constexpr double kKernels[] = {rad(30.0), rad(21.0), rad(14.7), rad(10.3), rad(7.2), rad(5.0),
                               rad(3.5),  rad(2.5),  rad(1.75), rad(1.5),  rad(1.5)};
constexpr double kLastKernel = rad(1.5);
// A slope so large (45 degrees) is no mounting; the fit does not go beyond.
constexpr double kMaxSlope = 1.0;
// Keeps the fit within the range of mountings where walls are few; nothing against a single wall.
constexpr double kMountingSigma = rad(20.0);

// The normal of a 2 m voxel on a flat wall.
constexpr double kNormalSigma = rad(0.7);
// How plumb a facade is.
constexpr double kFacadeSigma = rad(0.25);
// How level the ground of a keyframe is. Slopes of 2 to 3 degrees are common and last for many
// keyframes, which the filter takes for nearly independent: hence so much more.
constexpr double kGroundSigma = rad(10.0);
// What no scatter within a keyframe shows: distortion of the sensor, of the odometry.
constexpr double kCommonSigma = rad(0.08);

// What leans by one to so many times the last kernel is background: plants, cars, roofs.
constexpr double kBackgroundKernels = 5.0;
// Of the background, how much lies within the kernel by chance, weighted as walls are: the
// biweight's integral 16/15 over the width 8 of where it was counted.
constexpr double kBackgroundShare = 2.0 / 15.0;
// Walls must be more than expected by so many standard deviations of a count and so many planes:
// the fit seeks out where they are most.
constexpr double kChance = 4.0;
constexpr double kFewestWalls = 6.0;

constexpr double kDriftSigma = rad(kTiltDriftDeg);
// Keyframes see the same walls: so many of them count as one.
constexpr double kOverlap = 4.0;
// Less certain than this in any direction is unknown.
constexpr double kMaxSigma = rad(0.8);
// Three sigma.
constexpr double kContradiction = 9.0;

bool is_usable(const WallPlane& plane) noexcept {
  // Comparisons with NaN are false.
  return std::abs(plane.normal.squaredNorm() - 1.0F) < 0.01F && plane.normal_variance >= 0.0F &&
         plane.normal_variance < 1e6F;
}

/// Up of a slope.
Eigen::Vector3d direction(const Eigen::Vector2d& slope) noexcept {
  const double z = 1.0 / std::sqrt(1.0 + slope.squaredNorm());
  return {slope.x() * z, slope.y() * z, z};
}

double weight_of(const WallPlane& plane) noexcept {
  return 1.0 / (square(kNormalSigma) + static_cast<double>(plane.normal_variance));
}

bool has_ground(const GravityScene& scene) noexcept {
  return scene.ground.allFinite() && scene.ground.z() > 0.0 &&
         scene.ground.head<2>().norm() < kMaxSlope * scene.ground.z();
}

double mahalanobis_squared(const Eigen::Vector2d& difference,
                           const Eigen::Matrix2d& covariance) noexcept {
  return difference.dot(Cholesky<2>(covariance).solve(difference));
}

/// Projector onto those principal directions of `walls` in which the walls stand out from the
/// background. Both count planes, each by the square of the cosine of its angle to a direction;
/// the background in the kernels next to the one the walls lie in.
Eigen::Matrix2d determined_directions(const Eigen::Matrix2d& walls,
                                      const Eigen::Matrix2d& background) noexcept {
  Eigen::Matrix2d projector = Eigen::Matrix2d::Zero();
  const double half = 0.5 * (walls(0, 0) - walls(1, 1));
  const double root = std::sqrt(square(half) + square(walls(0, 1)));
  // Of the two forms of the eigenvector the one that does not cancel.
  Eigen::Vector2d axis = half < 0.0 ? Eigen::Vector2d(walls(0, 1), root - half)
                                    : Eigen::Vector2d(half + root, walls(0, 1));
  const double length = axis.norm();
  axis = length > 0.0 ? Eigen::Vector2d(axis / length) : Eigen::Vector2d::UnitX();
  for (const Eigen::Vector2d& d : {axis, Eigen::Vector2d(-axis.y(), axis.x())}) {
    const double expected = kBackgroundShare * d.dot(background * d);
    const double needed = expected + kChance * std::sqrt(expected) + kFewestWalls;
    if (d.dot(walls * d) > needed) projector += d * d.transpose();
  }
  return projector;
}

double largest_variance(const Eigen::Matrix2d& m) noexcept {
  return unimapper::largest_variance(m(0, 0), m(0, 1), m(1, 1));
}

}  // namespace

GravityEstimator::GravityEstimator(const OdometryConfig& config) noexcept
    : promise_sigma_(rad(static_cast<double>(config.up_sigma_deg))) {
  conclude();
}

void GravityEstimator::forget() noexcept {
  session_ = {};
  conclude();
}

const UpEstimate& GravityEstimator::add(const GravityScene& scene) noexcept {
  filter(measure(scene));
  conclude();
  return estimate_;
}

// Iteratively reweighted Gauss-Newton on the residuals normal . up, of walls, in the slope of up.
GravityEstimator::Slope GravityEstimator::measure(const GravityScene& scene) noexcept {
  Slope slope;
  Eigen::Vector2d g = slope.mean;
  for (const double kernel : kKernels) {
    const Eigen::Vector3d up = direction(g);
    Eigen::Matrix2d hessian = Eigen::Matrix2d::Identity() / square(kMountingSigma);
    Eigen::Vector2d gradient = g / square(kMountingSigma);
    for (const WallPlane& plane : scene.walls) {
      if (!is_usable(plane)) continue;
      const Eigen::Vector3d normal = plane.normal.cast<double>();
      const double residual = normal.dot(up);
      const double share = 1.0 - square(residual / kernel);
      if (!(share > 0.0)) continue;
      const double weight = weight_of(plane) * square(share);
      const Eigen::Vector2d derivative = normal.head<2>() * up.z();
      hessian += weight * derivative * derivative.transpose();
      gradient += weight * residual * derivative;
    }
    if (has_ground(scene)) {
      const Eigen::Vector2d residual = g - scene.ground.head<2>() / scene.ground.z();
      const double information = 1.0 / square(kGroundSigma);
      // Cauchy's weight: ground that lies far off is a ramp, or no ground.
      const double weight = information / (1.0 + residual.squaredNorm() * information / 9.0);
      hessian += weight * Eigen::Matrix2d::Identity();
      gradient += weight * residual;
    }
    g -= Cholesky<2>(hessian).solve(gradient);
    const double length = g.norm();
    if (length > kMaxSlope) g *= kMaxSlope / length;
  }
  slope.mean = g;
  add_covariance(scene, slope);
  return slope;
}

// The sandwich A^-1 B A^-1 of an M-estimator: A is the curvature of the robust cost, which vanishes
// where residuals are spread evenly over the kernel as those of plants are; B the scatter of what
// the patches pull, and what they could pull by leaning as facades do. Directions in which walls do
// not stand out from what is upright by chance count for nothing.
void GravityEstimator::add_covariance(const GravityScene& scene, Slope& slope) noexcept {
  for (Patch& patch : patches_) patch = {};
  const Eigen::Vector3d up = direction(slope.mean);
  Eigen::Matrix2d curvature = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d walls = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d background = Eigen::Matrix2d::Zero();
  for (const WallPlane& plane : scene.walls) {
    if (!is_usable(plane)) continue;
    const Eigen::Vector3d normal = plane.normal.cast<double>();
    const double residual = normal.dot(up);
    const double ratio = square(residual / kLastKernel);
    if (!(ratio < square(kBackgroundKernels))) continue;
    const double weight = weight_of(plane);
    const Eigen::Vector2d derivative = normal.head<2>() * up.z();
    const Eigen::Matrix2d information = weight * derivative * derivative.transpose();
    if (!(ratio < 1.0)) {
      background += information;
      continue;
    }
    const double share = 1.0 - ratio;
    curvature += share * (1.0 - 5.0 * ratio) * information;
    walls += square(share) * information;
    // Opposite walls lean in opposite directions: the sign of a normal must not matter.
    Patch& patch = patches_[plane.patch % kPatches];
    const double sign = derivative.dot(patch.leverage) < 0.0 ? -1.0 : 1.0;
    patch.pull += weight * square(share) * residual * derivative;
    patch.leverage += weight * square(share) * sign * derivative;
    patch.used = true;
  }
  double patches = 0.0;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d leaning = Eigen::Matrix2d::Zero();
  for (const Patch& patch : patches_) {
    if (!patch.used) continue;
    patches += 1.0;
    scatter += patch.pull * patch.pull.transpose();
    leaning += patch.leverage * patch.leverage.transpose();
  }
  if (patches > 1.0) scatter *= patches / (patches - 1.0);
  scatter += square(kFacadeSigma) * leaning;

  const Eigen::Matrix2d determined =
      determined_directions(walls * square(kNormalSigma), background * square(kNormalSigma));
  curvature = (determined * curvature * determined).eval();
  scatter = (determined * scatter * determined).eval();
  if (has_ground(scene)) {
    curvature += Eigen::Matrix2d::Identity() / square(kGroundSigma);
    scatter += Eigen::Matrix2d::Identity() / square(kGroundSigma);
  } else {
    curvature += Eigen::Matrix2d::Identity() / square(kMountingSigma);
    scatter += Eigen::Matrix2d::Identity() / square(kMountingSigma);
  }
  const Cholesky<2> factor(curvature);
  if (!factor.valid()) return;
  const Eigen::Matrix2d inverse = factor.inverse();
  // Two products of two: of a nested one the compiler for ARMv7 keeps a copy of Eigen's, which a
  // program's own could replace.
  const Eigen::Matrix2d half = inverse * scatter;
  slope.covariance = half * inverse + square(kCommonSigma) * Eigen::Matrix2d::Identity();
  slope.valid = slope.mean.allFinite() && Cholesky<2>(slope.covariance).valid();
}

void GravityEstimator::filter(const Slope& measured) noexcept {
  if (session_.valid) session_.covariance += square(kDriftSigma) * Eigen::Matrix2d::Identity();
  if (!measured.valid) return;
  if (!session_.valid) {
    session_ = measured;
    return;
  }
  const Eigen::Vector2d innovation = measured.mean - session_.mean;
  Eigen::Matrix2d noise = kOverlap * measured.covariance;
  const double surprise =
      mahalanobis_squared(innovation, session_.covariance + measured.covariance) / kContradiction;
  // Two that contradict each other are both less certain than they say.
  if (surprise > 1.0) {
    noise *= surprise;
    session_.covariance *= surprise;
  }
  const Cholesky<2> sum(session_.covariance + noise);
  if (!sum.valid()) return;
  const Eigen::Matrix2d gain = session_.covariance * sum.inverse();
  session_.mean += gain * innovation;
  const Eigen::Matrix2d rest = session_.covariance - gain * session_.covariance;
  session_.covariance = 0.5 * (rest + rest.transpose());
}

// Joins what the session has shown and what the odometry promises.
void GravityEstimator::conclude() noexcept {
  estimate_ = {};
  Slope joined = session_;
  bool promised = promise_sigma_ > 0.0;
  if (promised) {
    const Eigen::Matrix2d promise = square(promise_sigma_) * Eigen::Matrix2d::Identity();
    if (!session_.valid) {
      joined = {Vector::Zero(), promise, true};
    } else {
      const Eigen::Matrix2d sum = session_.covariance + promise;
      estimate_.contradicted = mahalanobis_squared(session_.mean, sum) > kContradiction;
      promised = !estimate_.contradicted;
      if (promised) {
        const Eigen::Matrix2d gain = session_.covariance * Cholesky<2>(sum).inverse();
        joined.mean -= gain * session_.mean;
        joined.covariance -= gain * session_.covariance;
      }
    }
  }
  // A promise says how level the odometry is, however uncertain that is.
  if (!joined.valid) return;
  if (!promised && !(largest_variance(joined.covariance) < square(kMaxSigma))) return;
  estimate_.known = true;
  estimate_.up = direction(joined.mean);
  const Eigen::Vector3d& up = estimate_.up;
  Eigen::Matrix<double, 3, 2> derivative;
  derivative.col(0) = up.z() * (Eigen::Vector3d::UnitX() - up.x() * up);
  derivative.col(1) = up.z() * (Eigen::Vector3d::UnitY() - up.y() * up);
  const Eigen::Matrix3d full = derivative * joined.covariance * derivative.transpose();
  estimate_.covariance = 0.5 * (full + full.transpose());
}

}  // namespace unimapper::onboard
