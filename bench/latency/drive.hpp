// Drive through a recording, once or there and back, for benchmarks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::bench {

/// Keyframes of a drive that count as warm-up: until the window is full and a keyframe has been
/// evicted from it, new cells face few images and no final labels are decided.
[[nodiscard]] inline std::uint32_t warm_up_keyframes(const PipelineConfig& config) noexcept {
  return config.removal.window + 1;
}

/// One scan, as passed to `Pipeline::add_scan`.
struct TimedScan {
  PointView points;
  Pose T_odometry_sensor;
  std::int64_t stamp_ns = 0;
};

/// The scans of a recording, read into memory, so that file access is not timed. A recording too
/// short for a steady state is driven there and back: forwards, backwards, forwards again, with its
/// poses, and stamps that rise by the recording's own steps.
class Drive {
 public:
  /// Reads all scans. Throws `DatasetError`.
  explicit Drive(const datasets::Dataset& dataset);

  /// Scans of the recording.
  [[nodiscard]] std::size_t recorded() const { return scans_.size(); }
  /// Where step `step` of the drive lies in the recording: 0, 1, ..., n - 1, n - 2, ..., 0, 1, ...
  [[nodiscard]] std::size_t scan_of(std::size_t step) const;
  /// Valid as long as the drive is. O(1).
  [[nodiscard]] TimedScan operator[](std::size_t step) const;
  /// Steps after which a drive ends: those of the recording, or if it is driven there and back
  /// those that `keyframes` keyframes need, however long they are.
  [[nodiscard]] std::size_t longest(bool there_and_back, std::size_t keyframes) const {
    return there_and_back ? recorded() + keyframes * KeyframeConfig::kMaxScans : recorded();
  }

 private:
  [[nodiscard]] std::size_t period() const { return 2 * (scans_.size() - 1); }

  std::vector<datasets::Scan> scans_;
  std::vector<Pose> poses_;
  std::vector<std::int64_t> stamps_ns_;
};

}  // namespace unimapper::bench
