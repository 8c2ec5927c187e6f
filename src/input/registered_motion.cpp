// Choice and registration of pairs of scans that show how the sensor moved
#include "src/input/registered_motion.hpp"

#include <algorithm>
#include <span>

#include "src/core/hand_eye.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kCalibrationPairs = 40;
static_assert(kCalibrationPairs <= HandEye::kMostMotions);
constexpr std::size_t kShapePoints = 2'000;
constexpr double kStands_m = 0.3;
constexpr double kStands_deg = 2.0;

double turn_deg(const Pose& pose) { return rotation_angle(pose.rotation) * kDegreesPerRadian; }

class PairChoice {
 public:
  explicit PairChoice(const Track& track) : track_(track) {}

  /// Two for each part of the track: one that moves far, one that turns or changes its speed most.
  [[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> choose(std::size_t every) const {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    // Poses of other times are needed on both sides.
    const std::size_t margin = std::clamp<std::size_t>(track_.size / 8, 1, 10);
    if (track_.size < 2 * margin + 4) return pairs;
    const std::size_t begin = margin;
    const std::size_t size = track_.size - 2 * margin - 1;
    const std::size_t parts = std::min(kCalibrationPairs / 2, size / 2);
    for (std::size_t s = 0; s < parts; s += every) {
      const std::size_t from = begin + s * size / parts;
      const std::size_t to = begin + (s + 1) * size / parts;
      pairs.emplace_back(from, partner(from, begin + size));
      std::size_t liveliest = from;
      double most = -1.0;
      const std::size_t step = std::max<std::size_t>(1, (to - from) / 6);
      for (std::size_t i = from; i < to; i += step) {
        const double value = liveliness(i, std::min(i + 6, begin + size));
        if (value <= most) continue;
        most = value;
        liveliest = i;
      }
      const std::pair<std::size_t, std::size_t> lively{liveliest,
                                                       std::min(liveliest + 6, begin + size)};
      if (lively != pairs.back()) pairs.push_back(lively);
    }
    return pairs;
  }

 private:
  [[nodiscard]] Pose motion(std::size_t i, std::size_t j) const {
    return track_.pose(i).inverse() * track_.pose(j);
  }

  [[nodiscard]] std::size_t partner(std::size_t i, std::size_t last) const {
    constexpr std::size_t kMostScans = 20;
    constexpr double kFar_m = 4.0;
    constexpr double kTurned_deg = 20.0;
    std::size_t j = i + 1;
    for (; j < std::min(i + kMostScans, last); ++j) {
      const Pose moved = motion(i, j);
      if (moved.translation.norm() >= kFar_m || turn_deg(moved) >= kTurned_deg) break;
    }
    return j;
  }

  /// Degrees that it turns, and that its motion changes by, for a metre at five metres away.
  [[nodiscard]] double liveliness(std::size_t i, std::size_t j) const {
    const Pose change = motion(i - 1, i).inverse() * motion(j - 1, j);
    constexpr double kPerMetre_deg = 12.0;
    constexpr double kScans = 5.0;
    return turn_deg(motion(i, j)) +
           kScans * (turn_deg(change) + kPerMetre_deg * change.translation.norm());
  }

  const Track& track_;
};

}  // namespace

const std::shared_ptr<const ScanShape>& MotionRegistration::shape(std::size_t i) {
  std::shared_ptr<const ScanShape>& known = shapes_[i];
  if (known != nullptr) return known;
  read_(i, scan_);
  return known = std::make_shared<const ScanShape>(scan_, kShapePoints);
}

const MotionRegistration::Compared& MotionRegistration::compared(std::size_t i, std::size_t j) {
  const auto [at, is_new] = compared_.try_emplace({i, j});
  Compared& result = at->second;
  if (!is_new) return result;
  const ScanPair pair(i, shape(i), j, shape(j));
  result.is_told = pair.is_informative();
  if (!result.is_told) return result;
  const Pose given = track_.pose(i).inverse() * track_.pose(j);
  merge::RegistrationResult found = pair.registration(given);
  double agreement = pair.agreement(found.T_target_source);
  const Pose correction = given.inverse() * found.T_target_source;
  if (correction.translation.norm() > kStands_m || turn_deg(correction) > kStands_deg) {
    const merge::RegistrationResult other = pair.registration(Pose());
    const double agrees = pair.agreement(other.T_target_source);
    if (agrees > agreement) {
      found = other;
      agreement = agrees;
    }
  }
  result.T_first_second = found.T_target_source;
  result.condition = found.condition;
  result.agreements = {pair.agreement(given), agreement, pair.agreement(Pose())};
  return result;
}

QuickMotions MotionRegistration::register_parts(
    const std::function<bool(std::size_t, std::size_t)>& skips, std::size_t every) {
  constexpr double kInTunnel = 0.03;    // condition; tunnels have no more
  constexpr double kUnmoved = 0.05;     // agreement; rings of a sparse sensor
  constexpr double kAgreesWell = 0.85;  // agreement, against the median
  QuickMotions result;
  std::vector<RegisteredMotion>& motions = result.motions;
  AgreementMeans means;
  std::vector<double> agreements;
  shapes_.clear();
  for (const auto& [i, j] : PairChoice(track_).choose(every)) {
    shapes_.erase(shapes_.begin(), shapes_.lower_bound(i));
    const Pose given = track_.pose(i).inverse() * track_.pose(j);
    if (skips(i, j) || !given.is_finite()) continue;
    if (given.translation.norm() < kStands_m && turn_deg(given) < kStands_deg) continue;
    ++result.pairs;
    const Compared& pair = compared(i, j);
    if (!pair.is_told) continue;
    means.add({i, j}, given, pair.T_first_second, pair.agreements);
    const double agreement = pair.agreements.registered;
    if (pair.condition < kInTunnel || agreement < pair.agreements.identity + kUnmoved) continue;
    motions.push_back({track_.stamp_ns(i), track_.stamp_ns(j), pair.T_first_second});
    agreements.push_back(agreement);
  }
  result.agreement = std::move(means).figures();
  if (motions.empty()) return result;
  std::vector<double> ordered = agreements;
  const double usual = median(std::span(ordered));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (agreements[k] >= kAgreesWell * usual) motions[kept++] = motions[k];
  }
  motions.resize(kept);
  return result;
}

std::vector<RegisteredMotion> MotionRegistration::all(
    const std::function<bool(std::size_t, std::size_t)>& skips) {
  return register_parts(skips, 1).motions;
}

QuickMotions MotionRegistration::some() {
  return register_parts([](std::size_t, std::size_t) { return false; }, 2);
}

}  // namespace unimapper::input
