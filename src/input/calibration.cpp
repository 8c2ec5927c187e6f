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

namespace unimapper::input {
namespace {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d rotated_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
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

  /// Standard deviations per axis of what differs from pose to pose at random.
  struct Noise {
    double turned_rad = 0.0;
    double moved_m = 0.0;
  };
  /// Fourth differences: those of driving and swaying are small against those of noise.
  [[nodiscard]] Noise noise() const {
    constexpr std::size_t kMost = 400;
    constexpr double kTwoAxes = 1.177;               // median of the length, in standard deviations
    const double gain = kTwoAxes * std::sqrt(70.0);  // 1 -4 6 -4 1
    std::vector<double> turned;
    std::vector<double> moved;
    const std::size_t step = 1 + poses_.size() / kMost;
    for (std::size_t i = 2; i + 2 < poses_.size(); i += step) {
      const auto turn = [&](std::size_t j) {
        return rotation_vector(poses_[i].rotation.transpose() * poses_[j].rotation);
      };
      const auto at = [&](std::size_t j) -> Eigen::Vector3d {
        return poses_[j].translation - poses_[i].translation;
      };
      turned.push_back((turn(i - 2) - 4.0 * (turn(i - 1) + turn(i + 1)) + turn(i + 2)).norm() /
                       gain);
      moved.push_back((at(i - 2) - 4.0 * (at(i - 1) + at(i + 1)) + at(i + 2)).norm() / gain);
    }
    if (turned.empty()) return {};
    return {median(std::span(turned)), median(std::span(moved))};
  }

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
using Residual = Eigen::Matrix<double, 6, 1>;

Pose mount_of(const Parameters& p) {
  return extrinsic_pose({p[3], p[4], p[5], p[0] * kDegreesPerRadian, p[1] * kDegreesPerRadian,
                         p[2] * kDegreesPerRadian});
}

/// Median of magnitudes as the standard deviation of normal errors.
double scale_of(std::vector<double> magnitudes, double floor) {
  constexpr double kNormal = 1.4826;
  return std::hypot(kNormal * median(std::span(magnitudes)), floor);
}

class LeastSquares {
 public:
  LeastSquares(const GivenMotion& given, std::span<const RegisteredMotion> motions)
      : given_(given), motions_(motions) {
    constexpr double kAngle_rad = 20.0 / kDegreesPerRadian;
    // Roll that no turn shows would turn yaw into pitch.
    constexpr double kRoll_rad = 5.0 / kDegreesPerRadian;
    priors_ << kRoll_rad, kAngle_rad, kAngle_rad, 2.0, 2.0, 2.0, 1.0, 0.03;
  }

  struct Solution {
    Parameters parameters = Parameters::Zero();
    Parameters sigmas = Parameters::Zero();
    Residual scales = Residual::Zero();
    double misfit = std::numeric_limits<double>::infinity();
    std::size_t motions = 0;
  };

  [[nodiscard]] Solution solve(const Parameters& start, int iterations) const {
    Solution s;
    s.parameters = start;
    for (int k = 0; k < iterations; ++k) {
      if (!step(s)) return {};
    }
    return s;
  }

 private:
  [[nodiscard]] std::optional<Residual> residual(const RegisteredMotion& motion,
                                                 const Parameters& p) const {
    const auto first = given_.at(motion.first_ns, p[6]);
    const auto second = given_.at(motion.second_ns, p[6]);
    if (!first || !second) return std::nullopt;
    Pose moved = first->inverse() * *second;
    moved.translation *= 1.0 + p[7];
    const Pose mount = mount_of(p);
    const Pose expected = mount.inverse() * moved * mount;
    Residual r;
    r.head<3>() = rotation_vector(motion.T_first_second.rotation.transpose() * expected.rotation);
    r.tail<3>() = expected.translation - motion.T_first_second.translation;
    return r;
  }

  /// One Gauss-Newton step; false where too few motions have poses.
  [[nodiscard]] bool step(Solution& s) const {
    std::vector<Residual> residuals;
    std::vector<Eigen::Matrix<double, 6, kParameters>> jacobians;
    for (const RegisteredMotion& motion : motions_) {
      const auto r = residual(motion, s.parameters);
      if (!r) continue;
      Eigen::Matrix<double, 6, kParameters> j;
      bool is_whole = true;
      for (int k = 0; k < kParameters && is_whole; ++k) {
        Parameters moved = s.parameters;
        const double by = k == 6 ? 0.01 : 1e-4;
        moved[k] += by;
        const auto there = residual(motion, moved);
        is_whole = there.has_value();
        if (is_whole) j.col(k) = (*there - *r) / by;
      }
      if (!is_whole) continue;
      residuals.push_back(*r);
      jacobians.push_back(j);
    }
    s.motions = residuals.size();
    if (2 * s.motions < motions_.size()) return false;
    const Residual scales = scales_of(residuals);
    Normal normal = priors_.array().inverse().square().matrix().asDiagonal();
    Parameters gradient = -(normal * s.parameters);
    s.misfit = 0.0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      for (int c = 0; c < 6; ++c) {
        constexpr double kTuning = 2.385;  // of Cauchy weights, in standard deviations
        const double r = residuals[i][c] / scales[c];
        const double weight = 1.0 / (1.0 + r * r / (kTuning * kTuning));
        const Parameters j = jacobians[i].row(c).transpose() / scales[c];
        normal += weight * j * j.transpose();
        gradient -= weight * r * j;
      }
    }
    for (int c = 0; c < 6; ++c) s.misfit += std::log(scales[c]);
    s.scales = scales;
    const Eigen::LDLT<Normal> factors(normal);
    s.parameters += factors.solve(gradient);
    const Normal covariance = factors.solve(Normal::Identity());
    s.sigmas = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    return s.parameters.allFinite();
  }

  [[nodiscard]] static Residual scales_of(const std::vector<Residual>& residuals) {
    constexpr double kAngle_rad = 0.1 / kDegreesPerRadian;
    constexpr double kShift_m = 0.02;
    Residual scales;
    for (int c = 0; c < 6; ++c) {
      std::vector<double> magnitudes;
      for (const Residual& r : residuals) magnitudes.push_back(std::fabs(r[c]));
      scales[c] = scale_of(std::move(magnitudes), c < 3 ? kAngle_rad : kShift_m);
    }
    return scales;
  }

  const GivenMotion& given_;
  std::span<const RegisteredMotion> motions_;
  Parameters priors_;  ///< standard deviations, for what the motion does not show
};

/// Whether motions that are moved so are those that were registered.
bool agrees(const LeastSquares::Solution& solution) {
  constexpr double kAgree_rad = 2.0 / kDegreesPerRadian;
  constexpr double kAgree_m = 0.4;
  return solution.scales.head<3>().maxCoeff() <= kAgree_rad &&
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

double Calibration::sure_delay_s() const {
  constexpr double kBeyondHalf_s = 0.015;
  const double least_s = 0.5 * interval_s + kBeyondHalf_s;
  const bool is_sure = delay_s.is_surely_beyond(least_s, kMoreSurely);
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
  const LeastSquares problem(given, motions);
  const double longest_s = std::max(1.0, 5.0 * given.interval_s());
  LeastSquares::Solution best;
  for (int k = -kFarthest; k <= kFarthest; ++k) {
    Parameters start = Parameters::Zero();
    start[6] = k * given.interval_s();
    if (std::fabs(start[6]) > longest_s) continue;
    LeastSquares::Solution found = problem.solve(start, 4);
    if (found.misfit < best.misfit) best = found;
  }
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
  return result;
}

MotionMistake find_motion_mistake(const Track& track, std::span<const RegisteredMotion> motions,
                                  const std::vector<PoseMistake>& mistakes,
                                  const Calibration& found) {
  constexpr std::size_t kFewest = 8;
  constexpr std::size_t kMostNamed = 3;
  constexpr int kIterations = 8;
  constexpr double kMount_rad = 10.0 / kDegreesPerRadian;
  // Differences of logarithms; right drives had 30 and more in the other direction.
  constexpr double kSurely = 12.0;
  constexpr double kAsWell = 6.0;
  MotionMistake result;
  if (motions.size() < kFewest || found.misfit == 0.0) return result;
  const auto misfit = [&](const std::function<Pose(const Pose&)>& correct) {
    const GivenMotion given(
        {track.size, [&](std::size_t i) { return correct(track.pose(i)); }, track.stamp_ns});
    const LeastSquares::Solution fit =
        LeastSquares(given, motions).solve(Parameters::Zero(), kIterations);
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
  if (!(best < as_given - kSurely) || !(best < found.misfit + kAsWell)) return result;
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
    noise_ = given.noise();
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
    const double angle_rad = std::hypot(0.3 / kDegreesPerRadian, 2.0 * noise_.turned_rad);
    const double shift_m = std::hypot(0.06, 2.0 * noise_.moved_m, metres * noise_.turned_rad);
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

  GivenMotion::Noise noise_;
  std::vector<std::array<double, kDelays>> sums_;  ///< up to each motion
};

}  // namespace

std::optional<ClockStep> find_clock_step(const Track& track,
                                         std::span<const RegisteredMotion> motions) {
  constexpr std::size_t kFewest = 5;  // motions of a part
  constexpr double kLeast_s = 0.07;   // less is what half a scan looks like
  // Differences of logarithms: of both parts with a delay of their own, and of each with its own
  // against the other's. Right drives had up to 3.
  constexpr double kLikely = 5.0;
  constexpr double kSurely = 15.0;
  constexpr double kEachSurely = 6.0;
  if (motions.size() < 2 * kFewest) return std::nullopt;
  const DelayCosts costs(track, motions);
  const std::size_t size = motions.size();
  const double together = costs.of(0, size, costs.best(0, size));
  std::size_t split = 0;
  double least = together - kLikely;
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
