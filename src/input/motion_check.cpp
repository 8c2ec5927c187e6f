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
#include "src/input/text.hpp"

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

/// Known mistakes are tried where a registration finds so much more agreement.
constexpr double kTryMistakes = 0.04;

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

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kElevations = 450 * kNeighbours;  // of 0.05 degrees: less than between rings

/// Number of points by elevation, seen from the origin of `T`; of a part of them.
std::vector<double> count_elevations(const datasets::Scan& scan, const Pose& T) {
  constexpr std::size_t kMost = 20000;
  std::vector<double> bins(kElevations);
  const std::size_t stride = 1 + scan.points.size() / kMost;
  for (std::size_t i = 0; i < scan.points.size(); i += stride) {
    const Eigen::Vector3d p =
        T * Eigen::Vector3d(scan.points[i].x, scan.points[i].y, scan.points[i].z);
    if (!p.allFinite() || p.norm() < 1.0) continue;
    const double share = 0.5 + std::asin(std::clamp(p.z() / p.norm(), -1.0, 1.0)) / M_PI;
    bins[std::min(kElevations - 1, static_cast<std::size_t>(share * kElevations))] += 1.0;
  }
  return bins;
}

/// How much the elevations of points concentrate in rings: 1 where they are spread evenly over
/// neighbouring bins. Where scans are seen from does not matter: a tunnel seen from outside fills a
/// small angle, but evenly.
double concentration(const datasets::Scan& scan, const Pose& T) {
  const std::vector<double> bins = count_elevations(scan, T);
  double squares = 0.0;
  double squares_of_means = 0.0;
  for (std::size_t first = 0; first < kElevations; first += kNeighbours) {
    double sum = 0.0;
    for (std::size_t i = first; i < first + kNeighbours; ++i) {
      squares += bins[i] * bins[i];
      sum += bins[i];
    }
    squares_of_means += sum * sum / kNeighbours;
  }
  return squares_of_means > 0.0 ? squares / squares_of_means : 0.0;
}

/// How much they concentrate at all: 1 where they are spread evenly over all elevations. Compares
/// scans from one place, which rings fill alike.
double peakedness(const datasets::Scan& scan) {
  double squares = 0.0;
  double sum = 0.0;
  for (const double count : count_elevations(scan, Pose())) {
    squares += count * count;
    sum += count;
  }
  return sum > 0.0 ? kElevations * squares / (sum * sum) : 0.0;
}

}  // namespace

double measure_ring_gain(std::span<const datasets::Scan* const> scans,
                         std::span<const Pose> poses) {
  constexpr double kFewest_m = 1.0;
  double gain = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (poses[i].translation.norm() < kFewest_m) continue;
    const double as_given = concentration(*scans[i], Pose());
    if (as_given <= 0.0) continue;
    gain += concentration(*scans[i], poses[i].inverse()) / as_given;
    count += 1.0;
  }
  return count > 0.0 ? gain / count : 0.0;
}

double measure_ring_loss(std::span<const datasets::Scan* const> scans) {
  if (scans.size() < 2) return 0.0;
  std::vector<double> later;
  for (const datasets::Scan* scan : scans.subspan(1)) later.push_back(peakedness(*scan));
  const double usual = median(std::span(later));
  return usual > 0.0 ? peakedness(*scans.front()) / usual : 0.0;
}

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

namespace {

/// Scans agree best without any motion. So do scans in the world frame, whose middle moves with the
/// sensor, but also the rings of a sparse sensor in a tunnel, which say nothing.
Finding check_unmoved(const AgreementFigures& agreement, Finding finding) {
  constexpr double kStands_m = 0.02;
  constexpr double kPasses_m = 5.0;
  constexpr double kWithSensor = 0.5;
  constexpr double kFar = 0.25;     // of agreement
  constexpr double kHardly = 0.5;   // agreement; rings in a tunnel agree better
  constexpr double kClearly = 1.3;  // concentration of rings
  // A sensor in one place keeps its rings: measured are 0.8 to 1.1, in the world frame 4.
  constexpr double kDissolved = 2.0;
  constexpr double kLeaves_m = 0.5;
  const bool stands = agreement.given_motion_m < kStands_m;
  const bool dissolves = agreement.ring_loss > kDissolved && agreement.drift_m > kLeaves_m;
  const bool passes = (stands && dissolves) ||
                      (agreement.drift_m > kPasses_m &&
                       (stands || agreement.drift_m > kWithSensor * agreement.displacement_m));
  const bool contradicts = agreement.given < kHardly && agreement.identity > agreement.given + kFar;
  const bool in_world = !stands && agreement.ring_gain > kClearly;
  constexpr double kBetter = 0.05;
  if (!stands && agreement.identity < agreement.given + kBetter) return finding;
  if (!passes && !contradicts && !in_world) return finding;
  finding.severity = Severity::kWrong;
  finding.limits = {};
  finding.message = text(
      "the scans agree best without any motion (%.0f %% of the points lie on surfaces of the scan "
      "before, %.0f %% under the given poses): they look transformed to the world frame already; "
      "%s",
      100.0 * agreement.identity, 100.0 * agreement.given,
      stands ? "no poses say where the sensor was: give the scans in the sensor's frame with "
               "poses, or as PCD files that carry their VIEWPOINT (--format dynamicmap)"
             : "transform each by the inverse of its pose, or use --format dynamicmap with PCD "
               "files that carry their VIEWPOINT; or the poses are those of other scans: give both "
               "the same order");
  return finding;
}

}  // namespace

Finding check_succession(const AgreementFigures& agreement) {
  constexpr std::size_t kFewest = 2;
  Finding finding{
      "succession", Severity::kFine,        static_cast<double>(agreement.disjoint_pairs), "pairs",
      {},           {kFewest - 1, kNoLimit}};
  if (agreement.disjoint_pairs < kFewest) return finding;
  finding.severity = Severity::kSuspicious;
  constexpr double kFar_m = 10.0;  // no order would bring the poses so far apart
  const std::string reason =
      agreement.least_agreeing_m > kFar_m
          ? "the robot drove on between the two, so scans are missing there"
          : "was the LiDAR covered or the robot carried, are scans missing between them, or are "
            "they in another order (1, 10, 2 instead of 1, 2, 10)?";
  finding.message = text(
      "%zu of %zu pairs of scans that are near to each other in time show different places, as the "
      "scans %zu and %zu (counted from 0), %.1f m apart by their poses: %s",
      agreement.disjoint_pairs, agreement.pairs, agreement.least_agreeing.first,
      agreement.least_agreeing.second, agreement.least_agreeing_m, reason.c_str());
  return finding;
}

namespace {

constexpr double kSurelyExplains = 0.08;  // more than the given motion

}  // namespace

bool has_known_mistake(const AgreementFigures& agreement) {
  constexpr double kExplains = 0.03;      // less than what a registration finds
  constexpr double kExplainsAll = 0.012;  // the same, of a mistake that makes little difference
  const double gain = agreement.mistaken - agreement.given;
  const double short_of = agreement.registered - agreement.mistaken;
  return !agreement.mistake.empty() && ((short_of <= kExplains && gain >= kSurelyExplains) ||
                                        (short_of <= kExplainsAll && gain >= kTryMistakes));
}

namespace {

Finding compare_motions(const AgreementFigures& agreement) {
  constexpr double kWide = 0.15;         // gap where corrections are large
  constexpr double kSurelyWrong = 0.25;  // gap
  // In a bore registration slides to where joints of the lining coincide by chance.
  const double unexplained = agreement.slides ? kWide : 0.1;
  const double gap = agreement.registered - agreement.given;
  Finding finding{"motion",    Severity::kFine,
                  100.0 * gap, "% less agreement than registered",
                  {},          {100.0 * unexplained, 100.0 * kSurelyWrong}};
  if (agreement.pairs == 0) return finding;
  constexpr double kAsWell = 0.03;
  if (agreement.identity >= agreement.registered - kAsWell) {
    return check_unmoved(agreement, std::move(finding));
  }
  if (gap < kTryMistakes) return finding;
  // Half a degree of attitude noise opens a gap of a quarter, but moves nothing.
  constexpr double kShifted_m = 0.3;  // corrections; sweeps that are not compensated need less
  constexpr double kTurned_deg = 6.5;
  constexpr double kPassesBy_m = 0.15;  // correction of poses that stand still
  constexpr double kStands_m = 0.02;    // given motion of the pairs
  const double gain = agreement.mistaken - agreement.given;
  const bool explained = has_known_mistake(agreement);
  // Sweeps that are not compensated turn more than they slide.
  constexpr double kLonger = 1.25;  // motions
  constexpr double kSlid_m = 0.12;
  constexpr double kStraight_deg = 2.0;
  const bool slid = agreement.correction_m > kSlid_m && agreement.correction_deg < kStraight_deg;
  const bool scaled = agreement.correction_deg < kStraight_deg &&
                      (agreement.length_ratio > kLonger || agreement.length_ratio < 1.0 / kLonger);
  const bool moved = slid || scaled || agreement.correction_m > kShifted_m ||
                     agreement.correction_deg > kTurned_deg;
  const std::string figures = text(
      "%.0f %% of the points lie on surfaces of the scan before under the given poses, %.0f %% "
      "under the motion that the scans show",
      100.0 * agreement.given, 100.0 * agreement.registered);
  if (explained) {
    finding.limits = {};
    finding.severity = gain >= kSurelyExplains ? Severity::kWrong : Severity::kSuspicious;
    finding.message = figures + ": ";
    for (std::size_t i = 0; i < agreement.remedies.size(); ++i) {
      finding.message += (i == 0 ? "" : " -- or ") + agreement.remedies[i];
    }
  } else if (gap < unexplained) {
    return finding;
  } else if (agreement.given_motion_m < kStands_m && agreement.correction_m > kPassesBy_m) {
    finding.severity = Severity::kWrong;
    finding.message =
        figures + text(
                      ": the poses stand still, but the scans move by %.2f m and %.1f degrees "
                      "from one to the next; give each scan the pose of its own stamp (without "
                      "poses, run a LiDAR odometry such as KISS-ICP first)",
                      agreement.correction_m, agreement.correction_deg);
  } else if (moved) {
    const bool surely =
        gap >= kSurelyWrong || (gap >= kWide && agreement.correction_m >= kShifted_m);
    finding.severity = surely ? Severity::kWrong : Severity::kSuspicious;
    finding.message =
        figures + text(
                      ", %.2f m and %.1f degrees away, the given motions %.2f times as long: check "
                      "that each scan "
                      "has the pose of its own stamp, and that scans and poses are in the same "
                      "order, units and axes",
                      agreement.correction_m, agreement.correction_deg, agreement.length_ratio);
  }
  return finding;
}

}  // namespace

Finding check_motion(const AgreementFigures& agreement) {
  Finding finding = compare_motions(agreement);
  if (agreement.turns == 0) return finding;
  // A LiDAR that sees another part each time does so, too, but its poses are right.
  finding.severity = std::max(finding.severity, Severity::kSuspicious);
  finding.limits = {};
  finding.message = text(
      "scans %zu apart agree (%.0f %% of the points lie on surfaces of the other), neighbours do "
      "not (%.0f %%): several LiDARs take turns under one name, or one sees another part each "
      "time; give each LiDAR a topic or frame of its own, and its place",
      agreement.turns, 100.0 * agreement.in_turn, 100.0 * agreement.neighbours);
  return finding;
}

}  // namespace unimapper::input
