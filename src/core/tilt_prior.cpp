#include "tilt_prior.hpp"

#include <algorithm>
#include <cmath>

#include "cholesky.hpp"

namespace unimapper {
namespace {

// A covariance on the wire may be too small to invert.
constexpr double kSmallestVariance = 1e-8;  // (0.006 degrees)²

Eigen::Matrix2d covariance_of(const KeyframeUp& up) noexcept {
  const auto xy = static_cast<double>(up.covariance_xy);
  Eigen::Matrix2d covariance;
  covariance << static_cast<double>(up.variance_x), xy, xy, static_cast<double>(up.variance_y);
  // Who claims to know must say how well.
  if (up.known && Cholesky<2>(covariance).valid()) return covariance;
  const double sigma = static_cast<double>(kUnknownUpSigmaDeg) / kDegreesPerRadian;
  return sigma * sigma * Eigen::Matrix2d::Identity();
}

/// The turn about the vertical, as `seen_from_above` has it.
Eigen::Matrix2d turn_from_above(const Pose& pose) noexcept {
  const double dot = pose.rotation(0, 0) + pose.rotation(1, 1);
  const double cross = pose.rotation(1, 0) - pose.rotation(0, 1);
  const double norm = std::sqrt(dot * dot + cross * cross);
  if (!(norm > 0.0)) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d turn;
  turn << dot / norm, -cross / norm, cross / norm, dot / norm;
  return turn;
}

}  // namespace

Pose with_tilt(const Pose& T_match_query, const Eigen::Vector2d& tilt) noexcept {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = turn_from_above(T_match_query);
  // The shortest rotation of the vertical to the tilted axis turns about no vertical.
  const double z = std::sqrt(std::max(0.0, 1.0 - tilt.squaredNorm()));
  const Eigen::Quaterniond lean(1.0 + z, -tilt.y(), tilt.x(), 0.0);
  Pose result = T_match_query;
  result.rotation = lean.normalized().toRotationMatrix() * turn;
  return result;
}

TiltPrior::TiltPrior(const KeyframeUp& match, const KeyframeUp& query,
                     const Pose& T_match_query) noexcept {
  const Eigen::Matrix2d turn = turn_from_above(T_match_query);
  const Eigen::Matrix2d sum = covariance_of(match) + turn * covariance_of(query) * turn.transpose();
  covariance_ = 0.5 * (sum + sum.transpose()) + kSmallestVariance * Eigen::Matrix2d::Identity();
  information_ = Cholesky<2>(covariance_).inverse();
}

// The covariance of the difference is the sum of both; by the inverse of the measured one that is
// t' (C + M^-1)^-1 t = t' (M - M (M + C^-1)^-1 M) t, which needs no inverse of M.
double TiltPrior::sigmas(const Eigen::Vector2d& tilt,
                         const Eigen::Matrix2d& measured) const noexcept {
  const Eigen::Vector2d pull = measured * tilt;
  const Eigen::Vector2d towards = posterior(tilt, measured);
  return std::sqrt(std::max(0.0, tilt.dot(pull) - towards.dot(pull)));
}

double TiltPrior::sigmas(const Eigen::Vector2d& tilt, double sigma) const noexcept {
  const Eigen::Matrix2d sum = covariance_ + sigma * sigma * Eigen::Matrix2d::Identity();
  return std::sqrt(std::max(0.0, tilt.dot(Cholesky<2>(sum).solve(tilt))));
}

Eigen::Vector2d TiltPrior::posterior(const Eigen::Vector2d& tilt,
                                     const Eigen::Matrix2d& measured) const noexcept {
  const Eigen::Matrix2d sum = information() + measured;
  return Cholesky<2>(sum).solve(measured * tilt);
}

}  // namespace unimapper
