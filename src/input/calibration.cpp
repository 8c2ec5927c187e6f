// Hand-eye calibration of mount and clock from given against registered motion
#include "src/input/calibration.hpp"

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
    const std::size_t before = i > 0 ? i - 1 : i;
    const std::size_t later = std::min(i + 1, poses_.size() - 1);
    if (later == before || seconds(before, later) > 3.0 * interval_s_) return poses_[i];
    return moved_on(poses_[before], poses_[i], poses_[later], seconds(before, later), ahead_s);
  }

 private:
  [[nodiscard]] double seconds(std::size_t i, std::size_t j) const {
    return static_cast<double>(stamps_ns_[j] - stamps_ns_[i]) * 1e-9;
  }

  std::vector<std::int64_t> stamps_ns_;
  std::vector<Pose> poses_;
  double interval_s_ = 0.0;
};

/// Least squares over the motions whose given poses are known.
class LeastSquares {
 public:
  LeastSquares(const GivenMotion& given, const Twist& noise,
               std::span<const RegisteredMotion> motions)
      : given_(given), motions_(motions), hand_eye_(noise) {}

  void keep_delay() { hand_eye_.keep_delay(); }

  [[nodiscard]] HandEye::Solution solve(const HandEye::Parameters& start, int iterations) const {
    HandEye::Solution s = hand_eye_.start(start);
    std::vector<HandEyeMotion> motions;
    for (int k = 0; k < iterations; ++k) {
      collect(s.parameters[6], motions);
      if (2 * motions.size() < motions_.size() || !hand_eye_.step(motions, s)) return {};
    }
    return s;
  }

 private:
  void collect(double delay_s, std::vector<HandEyeMotion>& motions) const {
    motions.clear();
    for (const RegisteredMotion& motion : motions_) {
      const auto now = given_motion(motion, delay_s);
      const auto later = given_motion(motion, delay_s + HandEye::kLater_s);
      if (now && later) motions.push_back({motion.T_first_second, *now, *later});
    }
  }

  [[nodiscard]] std::optional<Pose> given_motion(const RegisteredMotion& motion,
                                                 double delay_s) const {
    const auto first = given_.at(motion.first_ns, delay_s);
    const auto second = given_.at(motion.second_ns, delay_s);
    if (!first || !second) return std::nullopt;
    return first->inverse() * *second;
  }

  const GivenMotion& given_;
  std::span<const RegisteredMotion> motions_;
  HandEye hand_eye_;
};

}  // namespace

Calibration calibrate(const Track& track, std::span<const RegisteredMotion> motions) {
  constexpr int kFarthest = 10;  // scans
  if (motions.size() < kFewestMotions) return {};
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
  HandEye::Solution best;
  HandEye::Solution near;
  for (int k = -kFarthest; k <= kFarthest; ++k) {
    HandEye::Parameters start = HandEye::Parameters::Zero();
    start[6] = k * given.interval_s();
    if (std::fabs(start[6]) > longest_s) continue;
    HandEye::Solution found = problem.solve(start, 4);
    if (k == 0) near = found;
    if (found.misfit < best.misfit) best = found;
  }
  // Other poses have other noise, which fits by chance: right drives that scatter had up to 32.
  constexpr double kScatters_deg = 0.2;
  const double surely = attitude_noise_deg(noise) > kScatters_deg ? 40.0 : 0.0;
  if (!(static_cast<double>(motions.size()) * (near.misfit - best.misfit) > surely)) best = near;
  if (best.motions == 0) return {};
  best = problem.solve(best.parameters, 8);
  return calibration_of(best, given.interval_s());
}

MotionMistake find_motion_mistake(const Track& track, std::span<const RegisteredMotion> motions,
                                  const std::vector<PoseMistake>& mistakes,
                                  const Calibration& found, double surely) {
  constexpr std::size_t kMostNamed = 3;
  constexpr int kIterations = 8;
  constexpr double kMount_rad = 10.0 / kDegreesPerRadian;
  constexpr double kAsWell = 6.0;
  MotionMistake result;
  if (motions.size() < kFewestMotions || found.misfit == 0.0) return result;
  const auto misfit = [&](const std::function<Pose(const Pose&)>& correct) {
    const Track corrected{track.size, [&](std::size_t i) { return correct(track.pose(i)); },
                          track.stamp_ns};
    const GivenMotion given(corrected);
    LeastSquares problem(given, measure_pose_noise(corrected), motions);
    problem.keep_delay();
    const HandEye::Solution fit = problem.solve(HandEye::Parameters::Zero(), kIterations);
    // A half turn of the mount would undo some mistakes, and make others.
    const bool is_upright = fit.parameters.head<3>().cwiseAbs().maxCoeff() < kMount_rad;
    return fit.agrees() && is_upright ? static_cast<double>(motions.size()) * fit.misfit
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

  struct Drift {
    std::size_t first = 0;  ///< delays of the first and of the last motion
    std::size_t last = 0;
    double cost = std::numeric_limits<double>::infinity();
  };

  /// The delay that grows evenly and fits all motions best.
  [[nodiscard]] Drift best_drift() const {
    Drift best;
    for (std::size_t first = 0; first < kDelays; ++first) {
      for (std::size_t last = 0; last < kDelays; ++last) {
        const double cost = of_drift(first, last, best.cost);
        if (cost < best.cost) best = {first, last, cost};
      }
    }
    return best;
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
  /// Of all motions; of some where these cost `most` already.
  [[nodiscard]] double of_drift(std::size_t first, std::size_t last, double most) const {
    const std::size_t size = sums_.size();
    double sum = 0.0;
    for (std::size_t k = 0; k < size && sum < most; ++k) {
      sum += of(k, k + 1, (first * (size - 1 - k) + last * k + size / 2) / (size - 1));
    }
    return sum;
  }

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
  const DelayCosts::Drift drift = costs.best_drift();
  if (drift.cost <= least) {
    step.is_drift = true;
    step.before_s = DelayCosts::delay_s(drift.first);
    step.after_s = DelayCosts::delay_s(drift.last);
  }
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
