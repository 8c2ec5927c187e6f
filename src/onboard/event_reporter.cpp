#include "event_reporter.hpp"

#include <cstddef>

namespace unimapper::onboard {
namespace {

/// Of a degree, rounded.
std::uint64_t thousandths(float degrees) noexcept {
  const float half = degrees < 0.0F ? -0.5F : 0.5F;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(degrees * 1000.0F + half));
}

}  // namespace

void EventReporter::refusal(const Error& error, std::int64_t stamp_ns,
                            std::uint32_t scan) noexcept {
  if (error.code == ErrorCode::kPoseJump) return push(EventId::kPoseJump, stamp_ns, scan);
  push(EventId::kScanRefused, stamp_ns, static_cast<std::uint64_t>(error.code), scan);
}

void EventReporter::closed(const Keyframe& keyframe) noexcept {
  const KeyframeView& view = keyframe.view;
  push(EventId::kKeyframeClosed, view.scans.back().stamp_ns, view.sequence, view.scans.size(),
       view.static_cells.size(), view.dynamic_cells.size());
}

void EventReporter::odometry(const OdometryMonitor& monitor, const KeyframeView& view) noexcept {
  if (monitor.is_contradicted() && !broken_) {
    push(EventId::kOdometryContradicted, view.scans.back().stamp_ns, monitor.share(),
         monitor.usual_share(), view.sequence);
  }
  broken_ = monitor.is_contradicted();
}

void EventReporter::calibration(const CalibrationMonitor& monitor,
                                const KeyframeView& view) noexcept {
  using Part = CalibrationMonitor::Part;
  const std::int64_t stamp_ns = view.scans.back().stamp_ns;
  const std::uint32_t begins = monitor.said() & ~off_;
  off_ = monitor.said();
  for (std::uint8_t k = 0; k < CalibrationMonitor::kParts; ++k) {
    if ((begins >> k & 1U) == 0) continue;
    const auto part = static_cast<Part>(k);
    if (part == Part::kMotion) {
      push(EventId::kMotionContradicted, stamp_ns, static_cast<std::uint64_t>(monitor.mistake()),
           thousandths(static_cast<float>(monitor.length_ratio())), view.sequence);
      continue;
    }
    const std::uint64_t value = thousandths(static_cast<float>(monitor.estimate(part).value));
    const std::uint64_t sigma = thousandths(static_cast<float>(monitor.estimate(part).sigma));
    if (part == Part::kDelay) {
      push(EventId::kClockContradicted, stamp_ns, value, sigma, view.sequence);
    } else if (part == Part::kScale) {
      push(EventId::kScaleContradicted, stamp_ns, value, sigma, view.sequence);
    } else {
      push(EventId::kMountContradicted, stamp_ns, k, value, sigma, view.sequence);
    }
  }
}

void EventReporter::finished(const Keyframe& keyframe) noexcept {
  if (ring_ == nullptr) return;
  const KeyframeView& view = keyframe.view;
  const std::int64_t stamp_ns = view.scans.back().stamp_ns;
  capacity(view, stamp_ns);
  up(view, stamp_ns);
  if (keyframe.sampling_changed) sampling(view.statistics->sampling, stamp_ns);
  attitude(view, stamp_ns);
  if (view.statistics->deadline_missed) {
    push(EventId::kDeadlineMissed, stamp_ns, static_cast<std::uint64_t>(keyframe.spent_us),
         budget_us_, view.sequence);
  }
}

void EventReporter::push(EventId id, std::int64_t stamp_ns, std::uint64_t a, std::uint64_t b,
                         std::uint64_t c, std::uint64_t d) noexcept {
  if (ring_ == nullptr) return;
  const auto value = [](std::uint64_t number) { return static_cast<std::int64_t>(number); };
  ring_->push(
      {static_cast<std::uint32_t>(id), 0, stamp_ns, {value(a), value(b), value(c), value(d)}});
}

void EventReporter::capacity(const KeyframeView& view, std::int64_t stamp_ns) noexcept {
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    const std::uint64_t count = view.statistics->dropped[i];
    if (count != 0) push(EventId::kDropped, stamp_ns, i, count, view.sequence);
  }
}

void EventReporter::up(const KeyframeView& view, std::int64_t stamp_ns) noexcept {
  const bool contradicted = view.statistics->up_contradicted;
  if (contradicted && !contradicted_) {
    push(EventId::kUpContradicted, stamp_ns, thousandths(view.statistics->odometry_tilt_deg),
         thousandths(up_sigma_deg_), view.sequence);
  }
  contradicted_ = contradicted;
}

void EventReporter::sampling(const SamplingStatistics& found, std::int64_t stamp_ns) noexcept {
  if (found.rays_differ || found.changes > 0) {
    push(EventId::kSamplingDiffers, stamp_ns, thousandths(found.ray_spacing_deg),
         thousandths(found.ring_spacing_deg), thousandths(free_space_.ray_spacing_deg),
         thousandths(free_space_.ring_spacing_deg));
  }
  if (found.elevations_differ) {
    push(EventId::kElevationsDiffer, stamp_ns, thousandths(found.image_elevation_min_deg),
         thousandths(found.image_elevation_max_deg), thousandths(free_space_.elevation_min_deg),
         thousandths(free_space_.elevation_max_deg));
  }
}

void EventReporter::attitude(const KeyframeView& view, std::int64_t stamp_ns) noexcept {
  const KeyframeStatistics& found = *view.statistics;
  const bool uncompensated = found.sweep_tilt_deg > 0.0F;
  if (uncompensated && !uncompensated_) {
    push(EventId::kSweepsUncompensated, stamp_ns, thousandths(found.sweep_tilt_deg),
         found.aligned_scans, view.sequence);
  }
  uncompensated_ = uncompensated;
  if (uncompensated || found.aligned_scans == 0) return;
  push(EventId::kAttitudeNoise, stamp_ns, thousandths(found.attitude_noise_deg),
       found.aligned_scans, view.sequence);
}

}  // namespace unimapper::onboard
