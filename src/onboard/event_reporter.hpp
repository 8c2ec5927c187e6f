// Events of a pipeline
#pragma once

#include <cstdint>

#include "odometry_monitor.hpp"
#include "src/onboard/calibration/calibration_monitor.hpp"
#include "src/onboard/keyframe/keyframe.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/events.hpp"

namespace unimapper::onboard {

/// Puts what is worth an event into the ring of the configuration (see `EventId`); without a ring
/// nothing happens. What lasts is reported when it begins.
class EventReporter {
 public:
  explicit EventReporter(const PipelineConfig& config) noexcept
      : ring_(config.events),
        budget_us_(config.budget_us),
        up_sigma_deg_(config.odometry.up_sigma_deg),
        free_space_(config.free_space) {}

  /// A scan that was refused.
  void refusal(const Error& error, std::int64_t stamp_ns, std::uint32_t scan) noexcept;
  /// A keyframe was closed, or finished.
  void closed(const Keyframe& keyframe) noexcept;
  /// The scans of the keyframe that was closed contradict the odometry.
  void odometry(const OdometryMonitor& monitor, const KeyframeView& view) noexcept;
  /// What is constantly off between the poses and how scans move.
  void calibration(const CalibrationMonitor& monitor, const KeyframeView& view) noexcept;
  void finished(const Keyframe& keyframe) noexcept;

 private:
  void push(EventId id, std::int64_t stamp_ns, std::uint64_t a, std::uint64_t b = 0,
            std::uint64_t c = 0, std::uint64_t d = 0) noexcept;
  void capacity(const KeyframeView& view, std::int64_t stamp_ns) noexcept;
  void up(const KeyframeView& view, std::int64_t stamp_ns) noexcept;
  void sampling(const SamplingStatistics& found, std::int64_t stamp_ns) noexcept;
  void attitude(const KeyframeView& view, std::int64_t stamp_ns) noexcept;

  EventRing* ring_;
  std::uint32_t budget_us_;
  float up_sigma_deg_;
  FreeSpaceConfig free_space_;  ///< as configured
  bool contradicted_ = false;   ///< in the keyframe before, up was not where promised
  bool uncompensated_ = false;  ///< in the keyframe before, sweeps looked uncompensated
  std::uint32_t off_ = 0;       ///< in the keyframe before, `CalibrationMonitor::said`
  bool broken_ = false;         ///< in the keyframe before, the odometry looked broken
};

}  // namespace unimapper::onboard
