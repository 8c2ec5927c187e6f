#include "src/core/hand_eye.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "src/core/cholesky.hpp"
#include "src/core/quantile.hpp"
#include "src/core/rotation_vector.hpp"

namespace unimapper {
namespace {

/// From one rotation to another. Transposed first: two products of this kind in the library would
/// leave a copy of Eigen's that a program's own could replace.
Eigen::Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) noexcept {
  const Eigen::Matrix3d inverse = from.transpose();
  return rotation_vector(inverse * to);
}

using Parameters = HandEye::Parameters;
using Normal = Eigen::Matrix<double, HandEye::kParameters, HandEye::kParameters>;
using Jacobian = Eigen::Matrix<double, 6, HandEye::kParameters>;
using Covariance = Eigen::Matrix<double, 6, 6>;

constexpr double kTuning = 2.385;  // of Cauchy weights, in standard deviations

double length(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

/// Standard deviations of registration itself.
Twist least() noexcept {
  constexpr double kAngle_rad = 0.1 / kDegreesPerRadian;
  constexpr double kShift_m = 0.02;
  Twist sigmas;
  sigmas << kAngle_rad, kAngle_rad, kAngle_rad, kShift_m, kShift_m, kShift_m;
  return sigmas;
}

/// The LiDAR's motion where the given frame moves by `given`.
Pose expected(Pose given, const Pose& mount, double scale) noexcept {
  given.translation *= 1.0 + scale;
  return mount.inverse() * given * mount;
}

Twist difference(const Pose& expected, const Pose& registered) noexcept {
  Twist r;
  r.head<3>() = turn_between(registered.rotation, expected.rotation);
  r.tail<3>() = expected.translation - registered.translation;
  return r;
}

/// Mounts, each off by a little in one parameter.
struct Nearby {
  static constexpr double kBy = 1e-4;
  Pose mount;
  std::array<Pose, 6> mounts;

  explicit Nearby(const Parameters& p) noexcept : mount(HandEye::mount_of(p)) {
    for (int k = 0; k < 6; ++k) {
      Parameters there = p;
      there[k] += kBy;
      mounts[static_cast<std::size_t>(k)] = HandEye::mount_of(there);
    }
  }
};

/// Derivatives of a residual by the parameters. A mount shows in turns that registration saw, so
/// noise of the given ones is no evidence for it.
Jacobian derivatives(const HandEyeMotion& motion, const Nearby& nearby, double scale,
                     const Twist& noise) noexcept {
  const Pose& registered = motion.registered;
  Pose unmounted = nearby.mount * registered * nearby.mount.inverse();
  unmounted.translation /= 1.0 + scale;
  Jacobian j;
  for (int k = 0; k < 6; ++k) {
    const Pose& there = nearby.mounts[static_cast<std::size_t>(k)];
    j.col(k) = difference(expected(unmounted, there, scale), registered) / Nearby::kBy;
  }
  j.col(6) = (difference(expected(motion.given_later, nearby.mount, scale), registered) -
              difference(expected(motion.given, nearby.mount, scale), registered)) /
             HandEye::kLater_s;
  j.col(7) =
      difference(expected(unmounted, nearby.mount, scale + Nearby::kBy), registered) / Nearby::kBy;
  // Speeds of poses that scatter are noise.
  const Eigen::Vector3d turned = noise.head<3>();
  const double most = 2.0 * least()[0];
  for (int c = 0; c < 3; ++c) {
    if (turned[c] > most) j(c, 6) = 0.0;
  }
  if (turned[2] > most) j(4, 6) = 0.0;
  if (turned.head<2>().maxCoeff() > most) j(5, 6) = 0.0;
  return j;
}

/// Of a residual by noise, which turns a motion and shifts its end by what it turns.
Covariance covariance(const Pose& moved, const Pose& mount, const Twist& noise) noexcept {
  const Eigen::Matrix3d axes = mount.rotation.transpose();
  Covariance at_lidar = Covariance::Zero();
  at_lidar.topLeftCorner<3, 3>() = axes;
  at_lidar.bottomRightCorner<3, 3>() = axes;
  at_lidar.bottomLeftCorner<3, 3>() = -axes * skew(mount.translation);
  Covariance first = -Covariance::Identity();
  first.topLeftCorner<3, 3>() = -moved.rotation.transpose();
  first.bottomLeftCorner<3, 3>() = skew(moved.translation);
  Covariance second = Covariance::Identity();
  second.bottomRightCorner<3, 3>() = moved.rotation;
  const Covariance of_pose = at_lidar * noise.cwiseAbs2().asDiagonal() * at_lidar.transpose();
  return first * of_pose * first.transpose() + second * of_pose * second.transpose();
}

/// Logarithm of how unlikely a residual is, with such noise of the poses.
double misfit(Covariance noise, Twist r) noexcept {
  // Registration is off by more now and then.
  const Twist usual = 3.0 * least();
  noise.diagonal() += usual.cwiseAbs2();
  const Cholesky<6> factors(noise);
  factors.whiten(r);
  double sum = 0.0;
  double volume = 1.0;
  for (int c = 0; c < 6; ++c) {
    sum += 0.5 * kTuning * kTuning * log_of_1_plus(r[c] * r[c] / (kTuning * kTuning));
    volume *= factors.diagonal(c) / usual[c];
  }
  // No diagonal is less than what is usual.
  return sum + log_of_1_plus(std::max(volume - 1.0, 0.0));
}

Twist scales_of(std::span<const Twist> residuals) noexcept {
  std::array<double, HandEye::kMostMotions> magnitudes;
  Twist scales;
  for (int c = 0; c < 6; ++c) {
    for (std::size_t i = 0; i < residuals.size(); ++i) magnitudes[i] = std::fabs(residuals[i][c]);
    scales[c] = scale_of(std::span(magnitudes).first(residuals.size()));
  }
  return scales;
}

}  // namespace

HandEye::HandEye(const Twist& noise) noexcept : noise_(noise) {
  constexpr double kAngle_rad = 20.0 / kDegreesPerRadian;
  // Roll that no turn shows would turn yaw into pitch.
  constexpr double kRoll_rad = 5.0 / kDegreesPerRadian;
  priors_ << kRoll_rad, kAngle_rad, kAngle_rad, 2.0, 2.0, 2.0, 1.0, 0.03;
}

HandEye::Solution HandEye::start(const Parameters& parameters) const noexcept {
  Solution s;
  s.parameters = parameters;
  s.noise = noise_;
  return s;
}

Pose HandEye::mount_of(const Parameters& p) noexcept {
  return {rotation_of(p[2] * Eigen::Vector3d::UnitZ()) *
              rotation_of(p[1] * Eigen::Vector3d::UnitY()) *
              rotation_of(p[0] * Eigen::Vector3d::UnitX()),
          p.segment<3>(3)};
}

bool HandEye::step(std::span<const HandEyeMotion> motions, Solution& s) const noexcept {
  motions = motions.first(std::min(motions.size(), kMostMotions));
  if (motions.empty()) return false;
  const Nearby nearby(s.parameters);
  const Twist noise_before = s.noise;
  std::array<Twist, kMostMotions> room;
  const std::span<Twist> residuals(room.data(), motions.size());
  const auto moved = [&](std::size_t i) noexcept {
    return expected(motions[i].given, nearby.mount, s.parameters[7]);
  };
  for (std::size_t i = 0; i < motions.size(); ++i) {
    residuals[i] = difference(moved(i), motions[i].registered);
  }
  s.motions = motions.size();
  s.scales = scales_of(residuals).cwiseMax(least());
  // What scans confirm is no noise. Two poses have it, and so few motions tell it to a factor
  // of 2.
  s.noise = noise_.cwiseMin(std::sqrt(2.0) * s.scales);
  s.misfit = 0.0;
  const auto whitening = [&](std::size_t i, bool adds) noexcept {
    Covariance spread = covariance(moved(i), nearby.mount, s.noise);
    if (adds) s.misfit += misfit(spread, residuals[i]);
    spread.diagonal() += least().cwiseAbs2();
    return Cholesky<6>(spread);
  };
  for (std::size_t i = 0; i < motions.size(); ++i) whitening(i, true).whiten(residuals[i]);
  s.misfit /= static_cast<double>(s.motions);
  const Twist scales = scales_of(residuals);
  Normal normal = Normal::Zero();
  normal.diagonal() = priors_.cwiseAbs2().cwiseInverse();
  Parameters gradient = -(normal * s.parameters);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    Jacobian jacobian = derivatives(motions[i], nearby, s.parameters[7], noise_before);
    whitening(i, false).whiten(jacobian);
    for (int c = 0; c < 6; ++c) {
      const double scale = length(scales[c], 1.0);
      const double r = residuals[i][c] / scale;
      const double weight = 1.0 / (1.0 + r * r / (kTuning * kTuning));
      const Parameters j = jacobian.row(c).transpose() / scale;
      normal += weight * j * j.transpose();
      gradient -= weight * r * j;
    }
  }
  const Cholesky<kParameters> factors(normal);
  if (!factors.valid()) return false;
  s.parameters += factors.solve(gradient);
  s.sigmas = factors.inverse().diagonal().cwiseMax(0.0).cwiseSqrt();
  return s.parameters.allFinite();
}

bool HandEye::Solution::agrees() const noexcept {
  constexpr double kAgree_rad = 2.0 / kDegreesPerRadian;
  constexpr double kAgree_m = 0.4;
  const double noise_rad = noise.head<3>().maxCoeff();
  return scales.head<3>().maxCoeff() <= length(kAgree_rad, 2.0 * noise_rad) &&
         scales.tail<3>().maxCoeff() <= kAgree_m;
}

Pose moved_on(const Pose& before, const Pose& at, const Pose& after, double span_s,
              double ahead_s) noexcept {
  const double share = ahead_s / span_s;
  const Eigen::Vector3d turn_rad = share * turn_between(before.rotation, after.rotation);
  return {at.rotation * rotation_of(turn_rad),
          at.translation + share * (after.translation - before.translation)};
}

Twist fourth_difference(const std::array<Pose, 5>& poses) noexcept {
  constexpr double kGain = 8.366600265340756;  // root of 70: 1 -4 6 -4 1
  const Pose T_pose_world = poses[2].inverse();
  const auto at = [&](std::size_t k) noexcept {
    const Pose moved = T_pose_world * poses[k];
    Twist twist;
    twist << rotation_vector(moved.rotation), moved.translation;
    return twist;
  };
  return (at(0) - 4.0 * (at(1) + at(3)) + at(4)) / kGain;
}

double scale_of(std::span<double> magnitudes) noexcept {
  constexpr double kNormal = 1.4826;
  return magnitudes.empty() ? 0.0 : kNormal * median(magnitudes);
}

double log_of_1_plus(double x) noexcept {
  if (!(x > 0.0)) return 0.0;
  // 1 + x = m 2^e with m from 0.75 to 1.5; log m = 2 atanh((m - 1) / (m + 1)).
  constexpr double kLog2 = 0.693147180559945309;
  constexpr std::uint64_t kMantissa = (std::uint64_t{1} << 52U) - 1;
  constexpr std::uint64_t kOne = std::uint64_t{1023} << 52U;
  const auto bits = std::bit_cast<std::uint64_t>(std::min(1.0 + x, 1e300));
  auto exponent = static_cast<double>(static_cast<std::int64_t>(bits >> 52U) - 1023);
  auto m = std::bit_cast<double>((bits & kMantissa) | kOne);
  if (m > 1.5) {
    m *= 0.5;
    exponent += 1.0;
  }
  const double t = (m - 1.0) / (m + 1.0);
  const double s = t * t;
  double sum = 0.0;
  for (int n = 17; n >= 1; n -= 2) sum = sum * s + 1.0 / static_cast<double>(n);
  return exponent * kLog2 + 2.0 * t * sum;
}

}  // namespace unimapper
