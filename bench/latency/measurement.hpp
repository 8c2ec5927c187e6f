// Latency samples of many keyframes by stage, and their percentiles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::bench {

/// Processor time of the calling thread, nanoseconds: less dependent on other load.
[[nodiscard]] std::int64_t processor_time_ns() noexcept;

/// Wall-clock time, nanoseconds.
[[nodiscard]] std::int64_t wall_time_ns() noexcept;

/// Nearest-rank percentiles, in the unit of the values.
struct Percentiles {
  double p50 = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double max = 0.0;
};
[[nodiscard]] Percentiles percentiles(std::vector<double> values);

/// One scan of a keyframe, as passed to `Pipeline::add_scan`.
struct TimedScan {
  PointView points;
  Pose T_odometry_sensor;
  std::int64_t stamp_ns = 0;
};

/// Samples over the keyframes of one or more runs.
struct Measurement {
  std::array<std::vector<double>, kStages> stage_ms;
  std::vector<double> closing_call_ms;  ///< the `add_scan` that closes a keyframe
  std::vector<double> baseline_ms;  ///< reading and hashing the same points, see `HashingBaseline`
  std::uint64_t points = 0;
  std::array<std::uint64_t, kDropCauses> dropped{};

  void add(const KeyframeStatistics& statistics);
  /// Points per second of a stage's summed time; 0 if it took none.
  [[nodiscard]] double points_per_second(Stage stage) const;
};

/// Feeds one scan; adds a sample and returns true if it closes a keyframe.
bool feed(OwnedPipeline& pipeline, const TimedScan& scan, std::int64_t (*clock_ns)(),
          Measurement& measurement);

}  // namespace unimapper::bench
