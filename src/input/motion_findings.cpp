// Findings from the agreement of scans under motions
#include "src/input/motion_findings.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "src/input/text.hpp"

namespace unimapper::input {
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
