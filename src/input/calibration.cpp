// Hand-eye calibration of mount and clock from given against registered motion
#include "src/input/calibration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "src/core/quantile.hpp"
#include "src/input/extrinsic.hpp"
#include "src/input/pose_noise.hpp"

namespace unimapper::input {
namespace {

Eigen::Matrix3d rotated_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Given poses at any time: the nearest one, moved on by the velocity about it. Interpolating
/// would smooth noise of the odometry, and so prefer times between the stamps.
class GivenMotion {
 public:
  explicit GivenMotion(const Track& track) {
    for (std::size_t i = 0; i < track.size; ++i) {
      if (i > 0 && track.stamp_ns(i) <= stamps_ns_.back()) continue;
      stamps_ns_.push_back(track.stamp_ns(i));
      poses_.push_back(track.pose(i));
    }
    std::vector<double> intervals_s;
    for (std::size_t i = 1; i < poses_.size(); ++i) intervals_s.push_back(seconds(i - 1, i));
    if (!intervals_s.empty()) interval_s_ = median(std::span(intervals_s));
    for (std::size_t i = 0; i < poses_.size(); ++i) velocities_.push_back(velocity_about(i));
  }

  [[nodiscard]] double interval_s() const { return interval_s_; }

  /// Empty beyond the ends and in gaps.
  [[nodiscard]] std::optional<Pose> at(std::int64_t stamp_ns, double later_s) const {
    if (poses_.size() < 3) return std::nullopt;
    const auto wanted_ns = stamp_ns + static_cast<std::int64_t>(later_s * 1e9);
    const auto after = std::lower_bound(stamps_ns_.begin(), stamps_ns_.end(), wanted_ns);
    auto i = static_cast<std::size_t>(after - stamps_ns_.begin());
    i = std::min(i, poses_.size() - 1);
    if (i > 0 && wanted_ns - stamps_ns_[i - 1] < stamps_ns_[i] - wanted_ns) --i;
    const double ahead_s = static_cast<double>(wanted_ns - stamps_ns_[i]) * 1e-9;
    if (std::fabs(ahead_s) > interval_s_) return std::nullopt;
    const Velocity& v = velocities_[i];
    return poses_[i] * Pose(rotated_by(ahead_s * v.turning), ahead_s * v.moving);
  }

 private:
  struct Velocity {
    Eigen::Vector3d turning = Eigen::Vector3d::Zero();  ///< rad/s
    Eigen::Vector3d moving = Eigen::Vector3d::Zero();   ///< m/s
  };

  [[nodiscard]] double seconds(std::size_t i, std::size_t j) const {
    return static_cast<double>(stamps_ns_[j] - stamps_ns_[i]) * 1e-9;
  }

  [[nodiscard]] Velocity velocity_about(std::size_t i) const {
    const std::size_t before = i > 0 ? i - 1 : i;
    const std::size_t after = std::min(i + 1, poses_.size() - 1);
    if (after == before || seconds(before, after) > 3.0 * interval_s_) return {};
    const double per_s = 1.0 / seconds(before, after);
    const Pose& a = poses_[before];
    const Pose& b = poses_[after];
    return {per_s * rotation_vector(a.rotation.transpose() * b.rotation),
            per_s * (poses_[i].rotation.transpose() * (b.translation - a.translation))};
  }

  std::vector<std::int64_t> stamps_ns_;
  std::vector<Pose> poses_;
  std::vector<Velocity> velocities_;
  double interval_s_ = 0.0;
};

// roll, pitch, yaw (rad), x, y, z (m), delay (s), scale - 1
constexpr int kParameters = 8;
using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Normal = Eigen::Matrix<double, kParameters, kParameters>;
using Residual = Twist;
using Jacobian = Eigen::Matrix<double, 6, kParameters>;
using Covariance = Eigen::Matrix<double, 6, 6>;

Pose mount_of(const Parameters& p) {
  return extrinsic_pose({p[3], p[4], p[5], p[0] * kDegreesPerRadian, p[1] * kDegreesPerRadian,
                         p[2] * kDegreesPerRadian});
}

class LeastSquares {
 public:
  LeastSquares(const GivenMotion& given, const Twist& noise,
               std::span<const RegisteredMotion> motions)
      : given_(given), motions_(motions), noise_(noise) {
    constexpr double kAngle_rad = 20.0 / kDegreesPerRadian;
    // Roll that no turn shows would turn yaw into pitch.
    constexpr double kRoll_rad = 5.0 / kDegreesPerRadian;
    priors_ << kRoll_rad, kAngle_rad, kAngle_rad, 2.0, 2.0, 2.0, 1.0, 0.03;
  }

  /// Delays with other noise would fit one mistake better than another by chance.
  void keep_delay() { priors_[6] = 0.01; }

  struct Solution {
    Parameters parameters = Parameters::Zero();
    Parameters sigmas = Parameters::Zero();
    Residual scales = Residual::Zero();  ///< of the residuals
    Twist noise = Twist::Zero();         ///< of the given poses
    double misfit = std::numeric_limits<double>::infinity();
    std::size_t motions = 0;
  };

  [[nodiscard]] Solution solve(const Parameters& start, int iterations) const {
    Solution s;
    s.parameters = start;
    s.noise = noise_;
    for (int k = 0; k < iterations; ++k) {
      if (!step(s)) return {};
    }
    return s;
  }

 private:
  static constexpr double kTuning = 2.385;  // of Cauchy weights, in standard deviations

  [[nodiscard]] std::optional<Pose> given_motion(const RegisteredMotion& motion,
                                                 double delay_s) const {
    const auto first = given_.at(motion.first_ns, delay_s);
    const auto second = given_.at(motion.second_ns, delay_s);
    if (!first || !second) return std::nullopt;
    return first->inverse() * *second;
  }

  /// The LiDAR's motion where the given frame moves by `given`.
  [[nodiscard]] static Pose expected(Pose given, const Parameters& p) {
    given.translation *= 1.0 + p[7];
    const Pose mount = mount_of(p);
    return mount.inverse() * given * mount;
  }

  [[nodiscard]] static Residual difference(const Pose& expected, const Pose& registered) {
    Residual r;
    r.head<3>() = rotation_vector(registered.rotation.transpose() * expected.rotation);
    r.tail<3>() = expected.translation - registered.translation;
    return r;
  }

  /// Derivatives of a residual by the parameters; empty where poses are missing. A mount shows in
  /// turns that registration saw, so noise of the given ones is no evidence for it.
  [[nodiscard]] std::optional<Jacobian> jacobian(const RegisteredMotion& motion,
                                                 const Parameters& p, const Twist& noise) const {
    const Pose& registered = motion.T_first_second;
    const Pose mount = mount_of(p);
    Pose unmounted = mount * registered * mount.inverse();
    unmounted.translation /= 1.0 + p[7];
    Jacobian j;
    for (int k = 0; k < kParameters; ++k) {
      const double by = k == 6 ? 0.01 : 1e-4;
      Parameters there = p;
      there[k] += by;
      if (k != 6) {
        j.col(k) = difference(expected(unmounted, there), registered) / by;
        continue;
      }
      const auto now = given_motion(motion, p[6]);
      const auto later = given_motion(motion, there[6]);
      if (!now || !later) return std::nullopt;
      j.col(k) = (difference(expected(*later, p), registered) -
                  difference(expected(*now, p), registered)) /
                 by;
    }
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
  [[nodiscard]] static Covariance covariance(const Pose& moved, const Pose& mount,
                                             const Twist& noise) {
    const Eigen::Matrix3d axes = mount.rotation.transpose();
    Covariance at_lidar = Covariance::Zero();
    at_lidar.topLeftCorner<3, 3>() = axes;
    at_lidar.bottomRightCorner<3, 3>() = axes;
    at_lidar.bottomLeftCorner<3, 3>() = -axes * cross(mount.translation);
    Covariance first = -Covariance::Identity();
    first.topLeftCorner<3, 3>() = -moved.rotation.transpose();
    first.bottomLeftCorner<3, 3>() = cross(moved.translation);
    Covariance second = Covariance::Identity();
    second.bottomRightCorner<3, 3>() = moved.rotation;
    const Covariance of_pose = at_lidar * noise.cwiseAbs2().asDiagonal() * at_lidar.transpose();
    return first * of_pose * first.transpose() + second * of_pose * second.transpose();
  }

  /// Logarithm of how unlikely a residual is, with such noise of the poses.
  [[nodiscard]] static double misfit(Covariance noise, Residual r) {
    // Registration is off by more now and then.
    const Residual usual = 3.0 * least();
    noise.diagonal() += usual.cwiseAbs2();
    const Eigen::LLT<Covariance> factors(noise);
    factors.matrixL().solveInPlace(r);
    double sum = 0.0;
    for (int c = 0; c < 6; ++c) {
      sum += 0.5 * kTuning * kTuning * std::log1p(r[c] * r[c] / (kTuning * kTuning)) +
             std::log(factors.matrixLLT()(c, c) / usual[c]);
    }
    return sum;
  }

  /// Standard deviations of registration itself.
  [[nodiscard]] static Residual least() {
    constexpr double kAngle_rad = 0.1 / kDegreesPerRadian;
    constexpr double kShift_m = 0.02;
    Residual sigmas;
    sigmas << kAngle_rad, kAngle_rad, kAngle_rad, kShift_m, kShift_m, kShift_m;
    return sigmas;
  }

  /// One Gauss-Newton step; false where too few motions have poses.
  [[nodiscard]] bool step(Solution& s) const {
    std::vector<Residual> residuals;
    std::vector<Jacobian> jacobians;
    std::vector<Pose> moved;
    for (const RegisteredMotion& motion : motions_) {
      const auto j = jacobian(motion, s.parameters, s.noise);
      if (!j) continue;
      jacobians.push_back(*j);
      moved.push_back(expected(*given_motion(motion, s.parameters[6]), s.parameters));
      residuals.push_back(difference(moved.back(), motion.T_first_second));
    }
    s.motions = residuals.size();
    if (2 * s.motions < motions_.size()) return false;
    s.scales = scales_of(residuals).cwiseMax(least());
    // What scans confirm is no noise. Two poses have it, and so few motions tell it to a factor
    // of 2.
    s.noise = noise_.cwiseMin(std::sqrt(2.0) * s.scales);
    s.misfit = 0.0;
    const Pose mount = mount_of(s.parameters);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      Covariance spread = covariance(moved[i], mount, s.noise);
      s.misfit += misfit(spread, residuals[i]);
      spread.diagonal() += least().cwiseAbs2();
      const Eigen::LLT<Covariance> factors(spread);
      factors.matrixL().solveInPlace(residuals[i]);
      factors.matrixL().solveInPlace(jacobians[i]);
    }
    s.misfit /= static_cast<double>(s.motions);
    const Residual scales = scales_of(residuals);
    Normal normal = priors_.array().inverse().square().matrix().asDiagonal();
    Parameters gradient = -(normal * s.parameters);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      for (int c = 0; c < 6; ++c) {
        const double scale = std::hypot(scales[c], 1.0);
        const double r = residuals[i][c] / scale;
        const double weight = 1.0 / (1.0 + r * r / (kTuning * kTuning));
        const Parameters j = jacobians[i].row(c).transpose() / scale;
        normal += weight * j * j.transpose();
        gradient -= weight * r * j;
      }
    }
    const Eigen::LDLT<Normal> factors(normal);
    s.parameters += factors.solve(gradient);
    const Normal covariance = factors.solve(Normal::Identity());
    s.sigmas = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    return s.parameters.allFinite();
  }

  [[nodiscard]] static Residual scales_of(const std::vector<Residual>& residuals) {
    Residual scales;
    for (int c = 0; c < 6; ++c) {
      std::vector<double> magnitudes;
      for (const Residual& r : residuals) magnitudes.push_back(std::fabs(r[c]));
      scales[c] = scale_of(std::move(magnitudes));
    }
    return scales;
  }

  const GivenMotion& given_;
  std::span<const RegisteredMotion> motions_;
  Parameters priors_;  ///< standard deviations, for what the motion does not show
  Twist noise_;        ///< of the given poses, as `measure_pose_noise`
};

/// Whether motions that are moved so are those that were registered.
bool agrees(const LeastSquares::Solution& solution) {
  constexpr double kAgree_rad = 2.0 / kDegreesPerRadian;
  constexpr double kAgree_m = 0.4;
  const double noise_rad = solution.noise.head<3>().maxCoeff();
  return solution.scales.head<3>().maxCoeff() <= std::hypot(kAgree_rad, 2.0 * noise_rad) &&
         solution.scales.tail<3>().maxCoeff() <= kAgree_m;
}

}  // namespace

bool Estimate::is_surely_beyond(double least, double surely) const {
  return std::fabs(value) > least && std::fabs(value) > surely * sigma;
}

bool Calibration::shows_rotation() const {
  constexpr double kShown_deg = 0.5;
  return motions > 0 && pitch_deg.sigma < kShown_deg && yaw_deg.sigma < kShown_deg;
}

bool Calibration::shows_lever_arm() const {
  constexpr double kShown_m = 0.3;
  return motions > 0 && x_m.sigma < kShown_m && y_m.sigma < kShown_m;
}

bool Calibration::shows_delay() const {
  constexpr double kShown_s = 0.03;
  return motions > 0 && delay_s.sigma < kShown_s;
}

bool Calibration::is_surely_right() const {
  constexpr double kQuiet_deg = 0.3;
  // What half of the motions do not show may be shown by one of the others. Roll and height are
  // shown by none where a robot drives on a level.
  const auto is_right = [](const Estimate& e, double said, double shown) {
    const double size = std::fabs(e.value);
    return size + 3.0 * e.sigma < said || (size < 1.5 * e.sigma && e.sigma < shown);
  };
  constexpr double kAny = std::numeric_limits<double>::infinity();
  return motions > 0 && attitude_noise_deg < kQuiet_deg &&
         is_right(roll_deg, kSaidRoll_deg, kAny) && is_right(pitch_deg, kSaid_deg, kSaid_deg) &&
         is_right(yaw_deg, kSaid_deg, kSaid_deg) && is_right(x_m, kSaid_m, kSaid_m) &&
         is_right(y_m, kSaid_m, kSaid_m) && is_right(z_m, kSaid_m, kAny) &&
         is_right(delay_s, least_delay_s(), least_delay_s());
}

Pose Calibration::sure_mount() const {
  if (motions == 0) return {};
  const auto sure = [](const Estimate& e, double least) {
    return e.is_surely_beyond(least) ? e.value : 0.0;
  };
  const double up_m = z_m.is_surely_beyond(kSaid_m, kMoreSurely) ? z_m.value : 0.0;
  return extrinsic_pose({sure(x_m, kSaid_m), sure(y_m, kSaid_m), up_m,
                         sure(roll_deg, kSaidRoll_deg), sure(pitch_deg, kSaid_deg),
                         sure(yaw_deg, kSaid_deg)});
}

double Calibration::least_delay_s() const {
  constexpr double kBeyondHalf_s = 0.015;
  return 0.5 * interval_s + kBeyondHalf_s;
}

double Calibration::sure_delay_s() const {
  const bool is_sure = delay_s.is_surely_beyond(least_delay_s(), kMoreSurely);
  return motions > 0 && is_sure ? delay_s.value : 0.0;
}

Calibration calibrate(const Track& track, std::span<const RegisteredMotion> motions) {
  constexpr std::size_t kFewest = 8;
  constexpr int kFarthest = 10;  // scans
  if (motions.size() < kFewest) return {};
  // Poses without rotations are no mount.
  constexpr double kTurns_rad = 1.0 / kDegreesPerRadian;
  bool scans_turn = false;
  for (const RegisteredMotion& motion : motions) {
    scans_turn = scans_turn || rotation_angle(motion.T_first_second.rotation) > kTurns_rad;
  }
  bool poses_turn = false;
  for (std::size_t i = 1; i < track.size && !poses_turn; ++i) {
    poses_turn = rotation_angle(track.pose(0).rotation.transpose() * track.pose(i).rotation) > 1e-6;
  }
  if (scans_turn && !poses_turn) return {};
  const GivenMotion given(track);
  const Twist noise = measure_pose_noise(track);
  const LeastSquares problem(given, noise, motions);
  const double longest_s = std::max(1.0, 5.0 * given.interval_s());
  LeastSquares::Solution best;
  LeastSquares::Solution near;
  for (int k = -kFarthest; k <= kFarthest; ++k) {
    Parameters start = Parameters::Zero();
    start[6] = k * given.interval_s();
    if (std::fabs(start[6]) > longest_s) continue;
    LeastSquares::Solution found = problem.solve(start, 4);
    if (k == 0) near = found;
    if (found.misfit < best.misfit) best = found;
  }
  // Other poses have other noise, which fits by chance: right drives that scatter had up to 32.
  constexpr double kScatters_deg = 0.2;
  const double surely = attitude_noise_deg(noise) > kScatters_deg ? 40.0 : 0.0;
  if (!(static_cast<double>(motions.size()) * (near.misfit - best.misfit) > surely)) best = near;
  if (best.motions == 0) return {};
  best = problem.solve(best.parameters, 8);
  Calibration result;
  result.misfit = static_cast<double>(motions.size()) * best.misfit;
  // Where no mount and no delay makes the motions agree, poses and scans differ otherwise.
  if (best.motions < kFewest || !agrees(best)) return result;
  // What G-ICP is off by itself, however many motions there are.
  constexpr double kBias_deg = 0.1;
  constexpr double kBias_m = 0.05;
  constexpr double kBias_s = 0.005;
  const auto estimate = [&](int k, double unit, double bias) {
    return Estimate{best.parameters[k] * unit, std::hypot(best.sigmas[k] * unit, bias)};
  };
  result.motions = best.motions;
  result.interval_s = given.interval_s();
  result.roll_deg = estimate(0, kDegreesPerRadian, kBias_deg);
  result.pitch_deg = estimate(1, kDegreesPerRadian, kBias_deg);
  result.yaw_deg = estimate(2, kDegreesPerRadian, kBias_deg);
  result.x_m = estimate(3, 1.0, kBias_m);
  result.y_m = estimate(4, 1.0, kBias_m);
  result.z_m = estimate(5, 1.0, kBias_m);
  result.delay_s = estimate(6, 1.0, kBias_s);
  result.attitude_noise_deg = attitude_noise_deg(best.noise);
  return result;
}

MotionMistake find_motion_mistake(const Track& track, std::span<const RegisteredMotion> motions,
                                  const std::vector<PoseMistake>& mistakes,
                                  const Calibration& found, double surely) {
  constexpr std::size_t kFewest = 8;
  constexpr std::size_t kMostNamed = 3;
  constexpr int kIterations = 8;
  constexpr double kMount_rad = 10.0 / kDegreesPerRadian;
  constexpr double kAsWell = 6.0;
  MotionMistake result;
  if (motions.size() < kFewest || found.misfit == 0.0) return result;
  const auto misfit = [&](const std::function<Pose(const Pose&)>& correct) {
    const Track corrected{track.size, [&](std::size_t i) { return correct(track.pose(i)); },
                          track.stamp_ns};
    const GivenMotion given(corrected);
    LeastSquares problem(given, measure_pose_noise(corrected), motions);
    problem.keep_delay();
    const LeastSquares::Solution fit = problem.solve(Parameters::Zero(), kIterations);
    // A half turn of the mount would undo some mistakes, and make others.
    const bool is_upright = fit.parameters.head<3>().cwiseAbs().maxCoeff() < kMount_rad;
    return agrees(fit) && is_upright ? static_cast<double>(motions.size()) * fit.misfit
                                     : std::numeric_limits<double>::infinity();
  };
  const double as_given = misfit([](const Pose& pose) { return pose; });
  std::vector<std::pair<double, const PoseMistake*>> fits;
  for (const PoseMistake& mistake : mistakes) {
    if (mistake.correct && mistake.is_named) fits.emplace_back(misfit(mistake.correct), &mistake);
  }
  std::stable_sort(fits.begin(), fits.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const double best = fits.empty() ? as_given : fits.front().first;
  if (!(best < as_given - surely) || !(best < found.misfit + kAsWell)) return result;
  result.is_better_than_delay = best < found.misfit - kAsWell;
  for (const auto& [fit, mistake] : fits) {
    if (fit > best + kAsWell || result.names.size() == kMostNamed) break;
    result.names.push_back(mistake->name);
    result.remedies.push_back(mistake->remedy);
  }
  return result;
}

namespace {

/// How badly motions fit with delays of a grid.
class DelayCosts {
 public:
  DelayCosts(const Track& track, std::span<const RegisteredMotion> motions) {
    const GivenMotion given(track);
    const Twist noise = measure_pose_noise(track);
    turned_rad_ = noise.head<3>().maxCoeff();
    moved_m_ = noise.tail<3>().maxCoeff();
    for (const RegisteredMotion& motion : motions) {
      std::array<double, kDelays>& sums = sums_.emplace_back();
      if (sums_.size() > 1) sums = sums_[sums_.size() - 2];
      for (std::size_t d = 0; d < kDelays; ++d) sums[d] += cost(given, motion, delay_s(d));
    }
  }

  static constexpr std::size_t kDelays = 161;
  static double delay_s(std::size_t d) {
    constexpr double kStep_s = 0.025;
    return kStep_s * (static_cast<double>(d) - static_cast<double>(kDelays / 2));
  }

  /// Of the motions from `first` to before `last`.
  [[nodiscard]] double of(std::size_t first, std::size_t last, std::size_t d) const {
    return sums_[last - 1][d] - (first > 0 ? sums_[first - 1][d] : 0.0);
  }

  /// The delay that fits these motions best.
  [[nodiscard]] std::size_t best(std::size_t first, std::size_t last) const {
    std::size_t least = 0;
    for (std::size_t d = 1; d < kDelays; ++d) {
      if (of(first, last, d) < of(first, last, least)) least = d;
    }
    return least;
  }

 private:
  [[nodiscard]] double cost(const GivenMotion& given, const RegisteredMotion& motion,
                            double delay_s) const {
    const double metres = motion.T_first_second.translation.norm();
    const double angle_rad = std::hypot(0.3 / kDegreesPerRadian, 2.0 * turned_rad_);
    const double shift_m = std::hypot(0.06, 2.0 * moved_m_, metres * turned_rad_);
    // Of a motion that cannot be compared: an outlier.
    constexpr double kUnknown = 10.0;
    const auto first = given.at(motion.first_ns, delay_s);
    const auto second = given.at(motion.second_ns, delay_s);
    if (!first || !second) return kUnknown;
    const Pose off = motion.T_first_second.inverse() * (first->inverse() * *second);
    const double turned = rotation_angle(off.rotation) / angle_rad;
    const double moved = off.translation.norm() / shift_m;
    return std::min(kUnknown, std::log1p(turned * turned) + std::log1p(moved * moved));
  }

  double turned_rad_ = 0.0;  ///< noise of the given poses
  double moved_m_ = 0.0;
  std::vector<std::array<double, kDelays>> sums_;  ///< up to each motion
};

}  // namespace

std::optional<ClockStep> find_clock_step(const Track& track,
                                         std::span<const RegisteredMotion> motions, double likely) {
  constexpr std::size_t kFewest = 5;  // motions of a part
  constexpr double kLeast_s = 0.07;   // less is what half a scan looks like
  // Differences of logarithms: of both parts with a delay of their own, and of each with its own
  // against the other's. Right drives had up to 3.
  constexpr double kSurely = 15.0;
  constexpr double kEachSurely = 6.0;
  if (motions.size() < 2 * kFewest) return std::nullopt;
  const DelayCosts costs(track, motions);
  const std::size_t size = motions.size();
  const double together = costs.of(0, size, costs.best(0, size));
  std::size_t split = 0;
  double least = together - likely;
  for (std::size_t k = kFewest; k + kFewest <= size; ++k) {
    const double cost = costs.of(0, k, costs.best(0, k)) + costs.of(k, size, costs.best(k, size));
    if (cost >= least) continue;
    least = cost;
    split = k;
  }
  if (split == 0) return std::nullopt;
  const std::size_t before = costs.best(0, split);
  const std::size_t after = costs.best(split, size);
  ClockStep step{0, DelayCosts::delay_s(before), DelayCosts::delay_s(after), false};
  if (std::fabs(step.after_s - step.before_s) < kLeast_s) return std::nullopt;
  step.is_sure = together - least > kSurely &&
                 costs.of(0, split, after) - costs.of(0, split, before) > kEachSurely &&
                 costs.of(split, size, before) - costs.of(split, size, after) > kEachSurely;
  const std::int64_t last_ns = motions[split - 1].first_ns;
  const std::int64_t near_ns = last_ns + (motions[split].second_ns - last_ns) / 2;
  while (step.scan + 1 < track.size && track.stamp_ns(step.scan) < near_ns) ++step.scan;
  return step;
}

double gained_agreement(const Track& track, std::span<const ScanPair> pairs, double delay_s) {
  const GivenMotion given(track);
  double gained = 0.0;
  std::size_t compared = 0;
  for (const ScanPair& pair : pairs) {
    if (!pair.is_informative()) continue;
    const auto first = given.at(track.stamp_ns(pair.first()), delay_s);
    const auto second = given.at(track.stamp_ns(pair.second()), delay_s);
    if (!first || !second) continue;
    const Pose without = track.pose(pair.first()).inverse() * track.pose(pair.second());
    gained += pair.agreement(first->inverse() * *second) - pair.agreement(without);
    ++compared;
  }
  return compared == 0 ? 0.0 : gained / static_cast<double>(compared);
}

void leave_out_unseen_delay(Estimate& delay_s, double gained) {
  // Registration slides along walls and rows, and a constant speed tells no delay: right drives
  // looked 0.5 to 0.9 s early, and their scans agreed less with that. On a straight street a true
  // delay gains nothing either, and is not said.
  if (gained > 0.0) return;
  delay_s.sigma = std::max(delay_s.sigma, std::fabs(delay_s.value));
}

}  // namespace unimapper::input
