// Findings of calibration, in words
#include "src/input/calibration_findings.hpp"

#include <array>
#include <cmath>
#include <string>

#include "src/input/extrinsic.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

std::string remedies_of(const MotionMistake& mistake) {
  std::string all;
  for (const std::string& remedy : mistake.remedies) all += (all.empty() ? "" : " -- or ") + remedy;
  return all;
}

}  // namespace

Finding check_motion_mistake(const MotionMistake& mistake) {
  Finding finding{"motion", Severity::kFine, 0.0, {}, {}};
  if (mistake.remedies.empty()) return finding;
  finding.severity = mistake.is_better_than_delay ? Severity::kWrong : Severity::kSuspicious;
  finding.message = "the scans move otherwise than the poses say: " + remedies_of(mistake);
  if (!mistake.is_better_than_delay) finding.message += " -- or the poses are late or early";
  return finding;
}

Finding check_mount(const Calibration& found, const std::optional<Pose>& T_base_lidar) {
  Finding finding{"mount", Severity::kFine, 0.0, "degrees", {}};
  if (found.motions == 0) return finding;
  struct Part {
    const char* name;
    const char* unit;
    const Estimate* estimate;
    double said;
    double refused;
    double surely = 4.0;
  };
  // Refused is what costs five points of static accuracy (VLP-16, town, seed 2).
  const std::array<Part, 6> parts = {{{"yaw", "degrees", &found.yaw_deg, kSaid_deg, 1.2},
                                      {"pitch", "degrees", &found.pitch_deg, kSaid_deg, 1.8},
                                      {"roll", "degrees", &found.roll_deg, kSaidRoll_deg, 2.8},
                                      {"x", "m", &found.x_m, kSaid_m, 0.75},
                                      {"y", "m", &found.y_m, kSaid_m, 0.75},
                                      {"z", "m", &found.z_m, kSaid_m, 0.75, kMoreSurely}}};
  finding.limits = {parts[0].said, parts[0].refused};
  std::string off;
  for (const Part& part : parts) {
    const Estimate& e = *part.estimate;
    if (!e.is_surely_beyond(part.said, part.surely)) continue;
    off += text("%s%s by %.2f %s (standard deviation %.2f)", off.empty() ? "" : ", ", part.name,
                e.value, part.unit, e.sigma);
    if (off.find(',') == std::string::npos) {
      finding.figure = e.value;
      finding.unit = part.unit;
      finding.limits = {part.said, part.refused};
    }
    const bool refuses = e.is_surely_beyond(part.refused, part.surely);
    finding.severity =
        refuses || finding.severity == Severity::kWrong ? Severity::kWrong : Severity::kSuspicious;
  }
  if (finding.severity == Severity::kFine) return finding;
  finding.message =
      "the scans move as if the LiDAR were mounted otherwise than the poses say, " + off + ": " +
      (T_base_lidar ? "give --extrinsic " + extrinsic_text(*T_base_lidar * found.sure_mount())
                    : "correct the recording's own mount, behind it, by " +
                          extrinsic_text(found.sure_mount())) +
      ", or give --extrinsic auto";
  return finding;
}

Finding check_attitude(const Calibration& found) {
  constexpr double kSaidNoise_deg = 0.4;
  Finding finding{"attitude", Severity::kFine,           found.attitude_noise_deg, "degrees",
                  {},         {kSaidNoise_deg, kNoLimit}};
  if (found.attitude_noise_deg < kSaidNoise_deg) return finding;
  finding.severity = Severity::kSuspicious;
  finding.message = text(
      "roll and pitch of the poses scatter by %.1f degrees from scan to scan, and the scans do "
      "not: give poses of a better odometry; a roll of the mount or a mirrored axis may be "
      "hidden",
      found.attitude_noise_deg);
  return finding;
}

Finding check_clock_step(const std::optional<ClockStep>& step, double time_offset_s) {
  Finding finding{"clock", Severity::kFine, 0.0, "s", {}};
  if (!step || !step->is_sure) return finding;
  finding.severity = Severity::kWrong;
  finding.figure = step->after_s - step->before_s;
  if (step->is_drift) {
    finding.message = text(
        "the clocks of scans and poses drift apart: poses are %+.2f s late early in the "
        "recording and %+.2f s at its end; stamp both by one clock (as PTP sets it), or stretch "
        "the stamps of "
        "the poses by that",
        step->before_s, step->after_s);
    return finding;
  }
  finding.message = text(
      "the clock of the scans steps by %.2f s against that of the poses near scan %zu (counted "
      "from 0): poses are %+.2f s late before it and %+.2f s after it; split the recording at the "
      "step, and give the parts --time-offset %.2f and %.2f",
      finding.figure, step->scan, step->before_s, step->after_s, time_offset_s - step->before_s,
      time_offset_s - step->after_s);
  return finding;
}

Finding check_time(const Calibration& found, double time_offset_s, const MotionMistake& mistake,
                   const std::optional<ClockStep>& step) {
  constexpr double kRefused_s = 0.08;
  Finding finding{
      "time", Severity::kFine, found.sure_delay_s(), "s", {}, {found.least_delay_s(), kRefused_s}};
  const double delay_s = found.sure_delay_s();
  if (delay_s == 0.0) return finding;
  finding.severity =
      found.delay_s.is_surely_beyond(kRefused_s) ? Severity::kWrong : Severity::kSuspicious;
  finding.message = text(
      "the poses are %.2f s %s against the scans (standard deviation %.3f s): give --time-offset "
      "%.3f, which is added to their stamps, or --time-offset auto; or give each scan the pose of "
      "its own stamp",
      std::fabs(delay_s), delay_s > 0.0 ? "late" : "early", found.delay_s.sigma,
      time_offset_s - delay_s);
  if (!mistake.remedies.empty()) {
    finding.message += "; the motions fit as well if " + remedies_of(mistake);
  }
  if (step && step->is_drift) {
    finding.message +=
        text("; or the clocks drift apart, from %+.2f to %+.2f s", step->before_s, step->after_s);
  } else if (step) {
    finding.message +=
        text("; if a clock stepped near scan %zu (counted from 0), split the recording there",
             step->scan);
  }
  return finding;
}

}  // namespace unimapper::input
