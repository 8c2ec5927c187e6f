// Plausibility of a recording before it is mapped
#include "src/input/plausibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "src/input/calibration_findings.hpp"
#include "src/input/motion_findings.hpp"
#include "src/input/rings.hpp"

namespace unimapper::input {
namespace {

/// Scans by index, read once.
class ScanStore {
 public:
  explicit ScanStore(const datasets::Dataset& dataset) : dataset_(dataset) {}
  const datasets::Scan& operator[](std::size_t i) {
    const auto [at, is_new] = scans_.try_emplace(i);
    if (is_new) dataset_.read_scan(i, at->second);
    return at->second;
  }

 private:
  const datasets::Dataset& dataset_;
  std::map<std::size_t, datasets::Scan> scans_;
};

bool is_broken(const std::vector<OdometryBreak>& breaks, const PairIndex& pair) {
  return std::any_of(breaks.begin(), breaks.end(), [&](const OdometryBreak& b) {
    return pair.first < b.next && pair.second > b.last;
  });
}

/// Counts no jump that is known to be a break.
void leave_out_jumps(const Track& track, const std::vector<OdometryBreak>& breaks,
                     MotionFigures& motion) {
  for (const OdometryBreak& b : breaks) {
    for (std::size_t i = b.last; i < b.next; ++i) {
      motion.jumps -= std::min<std::size_t>(motion.jumps, is_jump(track, i) ? 1 : 0);
    }
  }
}

/// Whether an estimate that is sure differs from what others have of it.
bool is_excluded(const Estimate& sure, const Estimate& others) {
  return sure.is_surely_beyond(0.0) &&
         Estimate{sure.value - others.value, others.sigma}.is_surely_beyond(0.0);
}

struct Calibrated {
  std::vector<RegisteredMotion> motions;
  Calibration found;
};

/// What motions say of mount, clock and poses.
struct MotionEvidence {
  AgreementFigures agreement;
  Calibration calibration;
  MotionMistake mistake;
  std::optional<ClockStep> clock_step;
};

/// Half of the motions, where they show beyond doubt that nothing is to be said.
std::optional<MotionEvidence> quick_evidence(const Track& track,
                                             const std::vector<PoseMistake>& mistakes,
                                             MotionRegistration& registration) {
  // Differences of logarithms that all of the motions would double, far less than is said.
  constexpr double kHint = 1.5;
  const auto [motions, agreement, pairs] = registration.some();
  constexpr std::size_t kFewest = 10;  // what a clock that steps shows in
  if (motions.size() < kFewest || !is_surely_right(agreement, pairs)) return std::nullopt;
  MotionEvidence evidence{agreement, calibrate(track, motions), {}, {}};
  const Calibration& found = evidence.calibration;
  if (!found.is_surely_right() || find_clock_step(track, motions, kHint) ||
      !find_motion_mistake(track, motions, mistakes, found, kHint).names.empty()) {
    return std::nullopt;
  }
  return evidence;
}

/// Mount and clock as the scans show them where the odometry does not break. A mount or a clock
/// that is off looks like an odometry that slips in each turn, so slips are left out only if the
/// rest of the recording contradicts what they show.
Calibrated calibration_beside(std::vector<OdometryBreak> breaks, const Track& track,
                              MotionRegistration& registration) {
  const auto beside = [&] {
    Calibrated result;
    result.motions = registration.all([&](std::size_t i, std::size_t j) {
      return is_broken(breaks, {i, j});
    });
    result.found = calibrate(track, result.motions);
    return result;
  };
  Calibrated without_slips = beside();
  if (std::erase_if(breaks, [](const OdometryBreak& b) { return b.is_slip; }) == 0) {
    return without_slips;
  }
  Calibrated with_slips = beside();
  const Calibration& all = with_slips.found;
  const Calibration& rest = without_slips.found;
  const bool contradicts = is_excluded(all.roll_deg, rest.roll_deg) ||
                           is_excluded(all.pitch_deg, rest.pitch_deg) ||
                           is_excluded(all.yaw_deg, rest.yaw_deg) ||
                           is_excluded(all.x_m, rest.x_m) || is_excluded(all.y_m, rest.y_m) ||
                           is_excluded(all.z_m, rest.z_m) || is_excluded(all.delay_s, rest.delay_s);
  return rest.motions > 0 && contradicts ? without_slips : with_slips;
}

/// What motions beside the breaks say.
MotionEvidence evidence_beside(const std::vector<OdometryBreak>& breaks,
                               const AgreementFigures& agreement, const Track& track,
                               const std::vector<PoseMistake>& mistakes,
                               MotionRegistration& registration) {
  const auto [motions, found] = calibration_beside(breaks, track, registration);
  return {agreement, found, find_motion_mistake(track, motions, mistakes, found),
          find_clock_step(track, motions)};
}

/// For each scan whether it is an earlier one once more although the robot moved since.
std::vector<bool> find_repeated(const datasets::Dataset& dataset, const Track& track) {
  std::vector<bool> repeated(track.size, false);
  RepeatedScans repeats;
  datasets::Scan scan;
  for (std::size_t i = 0; i < track.size; ++i) {
    dataset.read_scan(i, scan);
    repeated[i] = repeats.add(scan.fingerprint, track.pose(i));
  }
  return repeated;
}

/// The steps that scans contradict; none is a break for scans that the driver repeated.
OdometryBreaks find_breaks(const datasets::Dataset& dataset, const Track& track) {
  OdometryBreaks found = find_odometry_breaks(
      track, [&](std::size_t i, datasets::Scan& scan) { dataset.read_scan(i, scan); });
  if (found.breaks.empty()) return found;
  const std::vector<bool> repeated = find_repeated(dataset, track);
  if (std::find(repeated.begin(), repeated.end(), true) == repeated.end()) return found;
  return find_odometry_breaks(track, [&](std::size_t i, datasets::Scan& scan) {
    dataset.read_scan(i, scan);
    if (repeated[i]) scan.points.clear();
  });
}

/// What the scans contradict is due to poses that are too sparse, if anything is; whether it was
/// said.
bool add_pose_rate(Plausibility& result, const Finding& motion, const GivenCorrection& given) {
  if (!is_too_sparse(result.rate)) return false;
  const std::array<Finding, 6> others = {check_mount(result.calibration, given.T_base_lidar),
                                         check_time(result.calibration, given.time_offset_s),
                                         check_clock_step(result.clock_step, given.time_offset_s),
                                         check_motion_mistake(result.mistake),
                                         motion,
                                         check_attitude(result.calibration)};
  const auto other =
      std::max_element(others.begin(), others.end(),
                       [](const Finding& a, const Finding& b) { return a.severity < b.severity; });
  if (other->severity == Severity::kFine) return false;
  result.findings.push_back(check_pose_rate(result.rate, *other));
  return true;
}

/// A cause that is measured goes before what only says that poses and scans differ.
void add_motion_causes(Plausibility& result, const Finding& odometry,
                       const GivenCorrection& given) {
  std::vector<Finding>& findings = result.findings;
  const Finding motion = check_motion(result.agreement);
  const Finding mount = check_mount(result.calibration, given.T_base_lidar);
  // A mount that is calibrated is more exact than one that makes scans agree.
  const bool is_calibrated =
      result.agreement.mistake == "turned" && mount.severity == Severity::kWrong;
  if (motion.severity != Severity::kFine && result.agreement.turns > 0) {
    findings.push_back(motion);
    result.steps.breaks.clear();
    return;
  }
  const bool is_known =
      motion.severity != Severity::kFine && has_known_mistake(result.agreement) && !is_calibrated;
  if (!is_known && add_pose_rate(result, motion, given)) {
    if (findings.back().severity == Severity::kWrong) {
      result.steps.breaks.clear();
    } else {
      findings.push_back(odometry);
    }
    return;
  }
  // Registered motions tell mistakes apart that agreement does not, but know of poses alone.
  const bool is_sure =
      result.mistake.is_better_than_delay &&
      (!is_known || (result.agreement.is_by_pose && result.mistake.names.size() == 1));
  if (is_sure) {
    findings.push_back(check_motion_mistake(result.mistake));
    result.steps.breaks.clear();
    return;
  }
  if (!is_known && result.clock_step && result.clock_step->is_sure) {
    findings.push_back(check_clock_step(result.clock_step, given.time_offset_s));
    result.steps.breaks.clear();
    return;
  }
  if (!is_known) {
    findings.push_back(mount);
    findings.push_back(
        check_time(result.calibration, given.time_offset_s, result.mistake, result.clock_step));
    if (worst({findings.end() - 2, findings.end()}) == Severity::kWrong) {
      // Each scan is then off against the next: what looks like a break need not be one.
      result.steps.breaks.clear();
      return;
    }
  }
  // A mistake that costs little agreement, and that a delay would explain which is not said.
  const bool is_likely = !is_known && motion.severity == Severity::kFine &&
                         worst(findings) == Severity::kFine && !result.mistake.names.empty();
  findings.push_back(is_likely ? check_motion_mistake(result.mistake) : motion);
  if (motion.severity != Severity::kWrong) findings.push_back(check_succession(result.agreement));
  findings.push_back(odometry);
}

void add_motion_findings(Plausibility& result, const Finding& odometry,
                         const GivenCorrection& given) {
  add_motion_causes(result, odometry, given);
  const bool names_rate = std::any_of(result.findings.begin(), result.findings.end(),
                                      [](const Finding& f) { return f.check == "pose rate"; });
  // It names noise of the attitude, too, where it is the cause.
  if (!names_rate) result.findings.push_back(check_attitude(result.calibration));
}

}  // namespace

Plausibility examine(const datasets::Dataset& dataset, std::size_t scans,
                     const GivenCorrection& given) {
  constexpr std::size_t kMostPairs = 16;
  // Of a scan; few where they show beyond doubt that poses and scans agree.
  constexpr std::size_t kFewPoints = 1'500;
  constexpr std::size_t kManyPoints = 4'000;
  const Track track{std::min(scans, dataset.scan_count()),
                    [&](std::size_t i) { return dataset.pose(i); },
                    [&](std::size_t i) { return dataset.stamp_ns(i); }};
  Plausibility result;
  result.motion = measure_motion(track);
  result.rate = measure_pose_rate(track);
  ScanStore store(dataset);
  std::vector<datasets::Scan> looked_at;
  std::vector<const datasets::Scan*> first;
  std::vector<const datasets::Scan*> second;
  const std::vector<PairIndex> chosen = choose_pairs(track, kMostPairs);
  looked_at.reserve(chosen.size() + 1);
  for (const PairIndex& pair : chosen) {
    dataset.read_scan(pair.first, looked_at.emplace_back());
    first.push_back(&looked_at.back());
    second.push_back(&store[pair.second]);
  }
  if (looked_at.empty() && track.size > 0) dataset.read_scan(0, looked_at.emplace_back());
  result.ranges = range_figures(looked_at);
  result.directions = measure_directions(looked_at);
  result.sensor = measure_sensor(looked_at, result.directions);
  std::vector<Finding>& findings = result.findings;
  findings.push_back(check_points(result.ranges));
  findings.push_back(check_records(looked_at, result.ranges));
  findings.push_back(check_units(result.ranges));
  findings.push_back(check_origin(result.ranges));
  findings.push_back(check_repeated(first, second));
  findings.push_back(check_stamp_order(result.motion));
  findings.push_back(check_interval(result.motion));
  findings.push_back(check_spacing(result.motion));
  findings.push_back(check_rounding(result.motion));
  findings.push_back(check_frame(result.motion));
  // Comparing points that are none, or are in other units than the limits, says nothing.
  const bool comparable = worst(findings) != Severity::kWrong;
  if (comparable) {
    result.steps = find_breaks(dataset, track);
    const Finding odometry = check_odometry_breaks(result.steps);
    std::vector<std::size_t> indices;
    for (const PairIndex& pair : chosen) indices.push_back(pair.first);
    result.driven = measure_driven_surface(track, result.directions.lowest_deg[2], indices, first);
    // Poses that are wrong as a whole are no odometry that breaks.
    const bool breaks = odometry.severity == Severity::kSuspicious;
    std::vector<OdometryBreak> known = result.steps.breaks;
    if (!breaks) std::erase_if(known, [](const OdometryBreak& b) { return !b.is_frozen; });
    if (breaks) leave_out_jumps(track, known, result.motion);
    findings.push_back(check_speed(result.motion));
    const auto pairs_of = [&](std::size_t points) {
      std::vector<ScanPair> pairs;
      pairs.reserve(chosen.size());
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        if (is_broken(known, chosen[k])) continue;
        pairs.emplace_back(chosen[k].first, std::make_shared<const ScanShape>(*first[k], points),
                           chosen[k].second, std::make_shared<const ScanShape>(*second[k], points));
      }
      return pairs;
    };
    const auto name = [&](std::size_t i) { return dataset.scan_name(i); };
    const std::vector<PoseMistake> mistakes = known_mistakes(track, name);
    MotionRegistration registration(
        track, [&](std::size_t i, datasets::Scan& scan) { dataset.read_scan(i, scan); });
    std::optional<MotionEvidence> evidence;
    if (known.empty()) evidence = quick_evidence(track, mistakes, registration);
    if (evidence) {
      result.agreement = evidence->agreement;
    } else {
      const std::vector<ScanPair> quick = pairs_of(kFewPoints);
      result.agreement = measure_agreement(quick, track, mistakes);
      if (!is_surely_right(result.agreement, quick.size())) {
        result.agreement = measure_agreement(pairs_of(kManyPoints), track, mistakes);
      }
    }
    if (result.agreement.identity > result.agreement.given) {
      std::vector<Pose> poses;
      poses.reserve(chosen.size());
      for (const PairIndex& pair : chosen) poses.push_back(track.pose(pair.first));
      result.agreement.ring_gain = measure_ring_gain(first, poses);
    }
    if (track.size > 0 && result.agreement.identity >= result.agreement.given) {
      // The very first scan: half a metre on, the rings have dissolved already.
      std::vector<const datasets::Scan*> from_start = {&store[0]};
      from_start.insert(from_start.end(), first.begin(), first.end());
      result.agreement.ring_loss = measure_ring_loss(from_start);
    }
    if (!evidence) {
      evidence = evidence_beside(known, result.agreement, track, mistakes, registration);
    }
    // Pairs may be an even number of scans apart: two LiDARs in turn agree with themselves then.
    std::map<std::size_t, std::shared_ptr<const ScanShape>> shapes;
    const auto shape = [&](std::size_t i) {
      std::shared_ptr<const ScanShape>& kept = shapes[i];
      if (kept == nullptr) kept = std::make_shared<const ScanShape>(store[i], kFewPoints);
      return kept;
    };
    find_turns(track, shape, result.agreement);
    result.calibration = evidence->calibration;
    result.mistake = evidence->mistake;
    result.clock_step = evidence->clock_step;
    Estimate& delay_s = result.calibration.delay_s;
    if (result.calibration.sure_delay_s() != 0.0) {
      leave_out_unseen_delay(delay_s,
                             gained_agreement(track, pairs_of(kManyPoints), delay_s.value));
    }
    add_motion_findings(result, odometry, given);
    if (!breaks) result.steps.breaks.clear();
  } else {
    findings.push_back(check_speed(result.motion));
  }
  // Poses that are upside down, or a mirrored z axis, are named already.
  const SheetSide sheet = sheet_side(result.sensor);
  result.up = find_up(result.driven, sheet);
  if (!result.mistake.is_better_than_delay || result.up == Side::kAbove) {
    std::vector<std::size_t> indices;
    for (const PairIndex& pair : chosen) indices.push_back(pair.first);
    findings.push_back(
        check_axes(result.directions, result.driven, sheet, are_upside_down(track, indices)));
  }
  return result;
}

}  // namespace unimapper::input
