// Scans against poses: which motion neighbouring scans agree with
#include "src/input/motion_check.hpp"

#include <Eigen/Core>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "src/core/quantile.hpp"
#include "src/core/rotation_vector.hpp"
#include "src/input/extrinsic.hpp"
#include "src/input/pose_noise.hpp"

namespace unimapper::input {
namespace {

constexpr std::size_t kFarthestApart = 10;  // scans
constexpr double kMoved_m = 1.0;
constexpr double kTurned_rad = 8.0 / kDegreesPerRadian;

Pose relative(const Track& track, std::size_t i, std::size_t j) {
  return track.pose(i).inverse() * track.pose(j);
}

std::size_t partner_of(const Track& track, std::size_t i) {
  const std::size_t last = std::min(i + kFarthestApart, track.size - 1);
  for (std::size_t j = i + 1; j < last; ++j) {
    const Pose motion = relative(track, i, j);
    if (motion.translation.norm() >= kMoved_m || rotation_angle(motion.rotation) >= kTurned_rad) {
      return j;
    }
  }
  return last;
}

double mean_over(std::span<const ScanPair> pairs,
                 const std::function<double(const ScanPair&)>& value) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const ScanPair& pair : pairs) {
    const double one = value(pair);
    if (one < 0.0) continue;
    sum += one;
    ++count;
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

}  // namespace

std::vector<PairIndex> choose_pairs(const Track& track, std::size_t most) {
  std::vector<PairIndex> pairs;
  if (track.size < 2) return pairs;
  const std::size_t segments = std::max<std::size_t>(1, std::min(most / 2, track.size - 1));
  for (std::size_t s = 0; s < segments; ++s) {
    const std::size_t begin = s * (track.size - 1) / segments;
    const std::size_t end = std::max(begin + 1, (s + 1) * (track.size - 1) / segments);
    const std::size_t middle = (begin + end) / 2;
    pairs.push_back({middle, middle + 1});
    // Where it turns most, of a few looks.
    const std::size_t step = std::max<std::size_t>(1, (end - begin) / 8);
    std::size_t turning = begin;
    double most_rad = -1.0;
    for (std::size_t i = begin; i < end; i += step) {
      const std::size_t j = std::min(i + kFarthestApart / 2, track.size - 1);
      const double turn_rad = rotation_angle(relative(track, i, j).rotation);
      if (turn_rad <= most_rad) continue;
      most_rad = turn_rad;
      turning = i;
    }
    const PairIndex far{turning, partner_of(track, turning)};
    if (far.first != pairs.back().first || far.second != pairs.back().second) {
      pairs.push_back(far);
    }
  }
  return pairs;
}

namespace {

void try_mistakes(std::span<const ScanPair> pairs, const std::vector<PoseMistake>& mistakes,
                  AgreementFigures& figures) {
  struct Tried {
    const PoseMistake* mistake;
    double agreement;
  };
  std::vector<Tried> tried;
  for (const PoseMistake& mistake : mistakes) {
    std::size_t compared = 0;
    const double agreement = mean_over(pairs, [&](const ScanPair& pair) {
      if (!pair.is_informative()) return -1.0;
      bool complete = true;
      const Pose motion = mistake.relative(pair.first(), pair.second(), complete);
      if (!complete) return -1.0;
      ++compared;
      return pair.agreement(motion);
    });
    if (2 * compared >= figures.pairs) tried.push_back({&mistake, agreement});
  }
  if (tried.empty()) return;
  const auto best =
      std::max_element(tried.begin(), tried.end(),
                       [](const Tried& a, const Tried& b) { return a.agreement < b.agreement; });
  constexpr double kAsGood = 0.02;
  constexpr std::size_t kMostNamed = 3;
  figures.mistaken = best->agreement;
  for (const Tried& one : tried) {
    if (one.agreement < best->agreement - kAsGood) continue;
    figures.is_by_pose = figures.is_by_pose && one.mistake->correct != nullptr;
    if (figures.remedies.size() == kMostNamed) continue;
    if (figures.remedies.empty()) figures.mistake = one.mistake->name;
    if (std::find(figures.remedies.begin(), figures.remedies.end(), one.mistake->remedy) ==
        figures.remedies.end()) {
      figures.remedies.push_back(one.mistake->remedy);
    }
  }
}

/// Given motions and those that scans show, as twists of metres: what turns one to the other is a
/// mount of any angle.
class TurnedMount {
 public:
  void add(const Pose& given, const Pose& registered) {
    // A turn of 0.2 rad counts as a metre.
    constexpr double kPerRadian_m = 5.0;
    pairs_.push_back({given.translation, registered.translation});
    pairs_.push_back({kPerRadian_m * rotation_vector(given.rotation),
                      kPerRadian_m * rotation_vector(registered.rotation)});
  }

  /// R_given_lidar by least squares with Cauchy weights; the smallest one where motions leave it
  /// open.
  [[nodiscard]] Eigen::Matrix3d solve() const {
    constexpr int kIterations = 8;
    constexpr double kOff_m = 0.1;
    constexpr double kPrior_m2 = 0.02;
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
    for (int n = 0; n < kIterations; ++n) {
      Eigen::Matrix3d sum = kPrior_m2 * Eigen::Matrix3d::Identity();
      for (const auto& [given, shown] : pairs_) {
        // What differs in length by more than half is another motion.
        const double lengths = given.norm() + shown.norm();
        if (std::fabs(given.norm() - shown.norm()) > 0.2 * lengths) continue;
        const double off = n == 0 ? 0.0 : (turned * shown - given).norm() / kOff_m;
        sum += given * shown.transpose() / (1.0 + off * off);
      }
      const Eigen::JacobiSVD<Eigen::Matrix3d> parts(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
      Eigen::Vector3d signs = Eigen::Vector3d::Ones();
      signs[2] = (parts.matrixU() * parts.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
      turned = parts.matrixU() * signs.asDiagonal() * parts.matrixV().transpose();
    }
    return turned;
  }

 private:
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs_;
};

/// Whether axes fall on axes, which has names of its own.
bool is_named_turn(const Eigen::Matrix3d& turned) {
  constexpr double kNear = 0.985;  // cosine of ten degrees
  return turned.cwiseAbs().rowwise().maxCoeff().minCoeff() > kNear;
}

/// A mount that is turned by any angle. On a straight road mistakes in the rotations look alike.
void try_turned(std::span<const ScanPair> pairs, const Track& track, const Eigen::Matrix3d& turned,
                AgreementFigures& figures) {
  constexpr double kAsGood = 0.02;
  constexpr double kBetter = 0.01;
  if (is_named_turn(turned)) return;
  const Pose mount(turned, Eigen::Vector3d::Zero());
  const double agreement = mean_over(pairs, [&](const ScanPair& pair) {
    if (!pair.is_informative()) return -1.0;
    const Pose given = relative(track, pair.first(), pair.second());
    return pair.agreement(mount.inverse() * given * mount);
  });
  if (agreement < figures.mistaken - kAsGood) return;
  if (agreement > figures.mistaken + kBetter) figures.remedies.clear();
  figures.mistake = "turned";
  figures.mistaken = std::max(figures.mistaken, agreement);
  figures.is_by_pose = false;  // registered motions do not tell these apart
  figures.remedies.insert(
      figures.remedies.begin(),
      "the poses look like those of a body that is turned against the points; multiply them by the "
      "extrinsic T_body_lidar, --extrinsic " +
          extrinsic_text(mount) + " (behind one that was given)");
}

}  // namespace

void AgreementMeans::add(const PairIndex& pair, const Pose& given, const Pose& registered,
                         const Agreements& agreements) {
  ++figures_.pairs;
  pairs_.push_back(pair);
  given_m_.push_back(given.translation.norm());
  registered_sum_m_ += registered.translation.norm();
  const Pose correction = given.inverse() * registered;
  corrections_m_.push_back(correction.translation.norm());
  corrections_deg_.push_back(rotation_angle(correction.rotation) * kDegreesPerRadian);
  const double most = std::max(agreements.given, agreements.registered);
  figures_.given += agreements.given;
  figures_.registered += most;
  figures_.identity += agreements.identity;
  best_.push_back(std::max(most, agreements.identity));
}

void AgreementMeans::count_disjoint_pairs() {
  constexpr double kHalf = 0.5;
  std::vector<double> ordered = best_;
  const double usual = median(std::span(ordered));
  for (const double one : best_) figures_.disjoint_pairs += one < kHalf * usual ? 1 : 0;
  const auto least = std::min_element(best_.begin(), best_.end());
  const auto at = static_cast<std::size_t>(least - best_.begin());
  figures_.least_agreeing = pairs_[at];
  figures_.least_agreeing_m = given_m_[at];
  figures_.least_of_usual = usual > 0.0 ? *least / usual : 0.0;
}

AgreementFigures AgreementMeans::figures() && {
  if (figures_.pairs == 0) return figures_;
  count_disjoint_pairs();
  const auto count = static_cast<double>(figures_.pairs);
  figures_.given /= count;
  figures_.registered /= count;
  figures_.identity /= count;
  const double given_sum_m = std::accumulate(given_m_.begin(), given_m_.end(), 0.0);
  if (registered_sum_m_ > 0.0) figures_.length_ratio = given_sum_m / registered_sum_m_;
  figures_.given_motion_m = median(std::span(given_m_));
  figures_.correction_m = median(std::span(corrections_m_));
  figures_.correction_deg = median(std::span(corrections_deg_));
  return figures_;
}

AgreementFigures measure_agreement(std::span<const ScanPair> pairs, const Track& track,
                                   const std::vector<PoseMistake>& mistakes) {
  AgreementMeans means;
  TurnedMount mount;
  double drift_m = 0.0;
  double displacement_m = 0.0;
  constexpr double kSlides = 0.03;  // condition; tunnels have no more
  std::size_t sliding = 0;
  for (const ScanPair& pair : pairs) {
    drift_m = std::max(drift_m,
                       (pair.first_shape().middle() - pairs.front().first_shape().middle()).norm());
    const Pose moved = relative(track, pairs.front().first(), pair.first());
    displacement_m = std::max(displacement_m, moved.translation.norm());
    if (!pair.is_informative()) continue;
    const Pose given = relative(track, pair.first(), pair.second());
    merge::RegistrationResult found = pair.registration(given.is_finite() ? given : Pose());
    Agreements agreements{pair.agreement(given), pair.agreement(found.T_target_source),
                          pair.agreement(Pose())};
    // Starts next to each other lead to one motion.
    constexpr double kNear_m = 0.3;
    constexpr double kNear_rad = 3.0 / kDegreesPerRadian;
    if (given.translation.norm() > kNear_m || rotation_angle(given.rotation) > kNear_rad) {
      const merge::RegistrationResult other = pair.registration(Pose());
      const double agrees = pair.agreement(other.T_target_source);
      if (agrees > agreements.registered) {
        found = other;
        agreements.registered = agrees;
      }
    }
    sliding += found.condition < kSlides ? 1 : 0;
    mount.add(given, found.T_target_source);
    means.add({pair.first(), pair.second()}, given, found.T_target_source, agreements);
  }
  AgreementFigures figures = std::move(means).figures();
  figures.slides = 2 * sliding > figures.pairs;
  figures.drift_m = drift_m;
  figures.displacement_m = displacement_m;
  if (figures.pairs > 0 && figures.given < figures.registered - kTryMistakes) {
    try_mistakes(pairs, mistakes, figures);
    try_turned(pairs, track, mount.solve(), figures);
  }
  return figures;
}

void find_turns(const Track& track,
                const std::function<std::shared_ptr<const ScanShape>(std::size_t)>& shape,
                AgreementFigures& figures) {
  constexpr std::size_t kLooks = 8;
  constexpr double kFewest = 3.0;   // looks, where nothing hints at turns
  constexpr double kBetter = 0.12;  // agreement
  constexpr double kStands_m = 1e-6;
  for (const std::size_t turns : {std::size_t{2}, std::size_t{3}}) {
    if (track.size < turns + kLooks) return;
    double in_turn = 0.0;
    double neighbours = 0.0;
    double looks = 0.0;
    for (std::size_t n = 0; n < kLooks; ++n) {
      const std::size_t i = n * (track.size - turns - 1) / (kLooks - 1);
      const Pose next = relative(track, i, i + 1);
      // Poses that are there twice do so, too.
      if (next.translation.norm() < kStands_m && rotation_angle(next.rotation) < kStands_m) return;
      const ScanPair beside(i, shape(i), i + 1, shape(i + 1));
      const ScanPair apart(i, shape(i), i + turns, shape(i + turns));
      if (!beside.is_informative() || !apart.is_informative()) continue;
      neighbours += beside.agreement(next);
      in_turn += apart.agreement(relative(track, i, i + turns));
      looks += 1.0;
      if (looks >= kFewest && in_turn <= neighbours) break;
    }
    if (2.0 * looks < static_cast<double>(kLooks) || in_turn < neighbours + kBetter * looks) {
      continue;
    }
    figures.turns = turns;
    figures.in_turn = in_turn / looks;
    figures.neighbours = neighbours / looks;
    return;
  }
}

bool is_surely_right(const AgreementFigures& agreement, std::size_t pairs) {
  constexpr double kLittle = 0.5 * kTryMistakes;
  constexpr double kMoves = 0.1;
  constexpr double kSamePlace = 0.55;
  return agreement.pairs == pairs && agreement.registered - agreement.given < kLittle &&
         agreement.registered - agreement.identity > kMoves &&
         agreement.least_of_usual > kSamePlace;
}

}  // namespace unimapper::input
