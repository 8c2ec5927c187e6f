// Latency samples of calls and keyframes, and their percentiles as a table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drive.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::bench {

/// Keyframes after the warm-up that a steady state is reported from, at least.
inline constexpr std::size_t kLeastKeyframes = 40;

/// Processor time of the calling thread, nanoseconds: less dependent on other load.
[[nodiscard]] std::int64_t processor_time_ns() noexcept;
/// Time of the clock, nanoseconds: what several threads take.
[[nodiscard]] std::int64_t wall_time_ns() noexcept;

/// Nearest-rank percentiles, in the unit of the values.
struct Percentiles {
  double p50 = 0.0;
  double p90 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};
[[nodiscard]] Percentiles percentiles(std::vector<double> values);

/// One call of `Pipeline::add_scan`.
struct Call {
  double ms = 0.0;
  bool closes = false;         ///< a keyframe is ready after it
  std::size_t step = 0;        ///< of the drive, from 0
  std::uint32_t keyframe = 0;  ///< that the scan belongs to, from 0
};

/// Samples over the keyframes of one or more runs.
struct Measurement {
  std::vector<Call> calls;
  std::array<std::vector<double>, kStages> stage_ms;
  std::uint64_t points = 0;

  void add(const KeyframeStatistics& statistics);
  [[nodiscard]] std::size_t keyframes() const { return stage_ms[0].size(); }
  [[nodiscard]] std::vector<double> calls_ms() const;
  /// Only those that close a keyframe, or only the others.
  [[nodiscard]] std::vector<double> calls_ms(bool closing) const;
  /// The call that took longest; there must be one.
  [[nodiscard]] const Call& longest_call() const;
  /// Points per second of a stage's summed time; 0 if it took none.
  [[nodiscard]] double points_per_second(Stage stage) const;
};

/// A measurement in two parts, see `warm_up_keyframes`.
struct SplitMeasurement {
  Measurement warm_up;
  Measurement steady;

  /// Whether there are enough keyframes after the warm-up.
  [[nodiscard]] bool is_steady() const { return steady.keyframes() >= kLeastKeyframes; }
};

/// Feeds the scans of a run one by one and sorts the samples by the keyframe they belong to.
class Feeder {
 public:
  /// All three must outlive it. `config`: of the pipeline, with its clock.
  Feeder(Pipeline& pipeline, const PipelineConfig& config, SplitMeasurement& measurement);

  /// One call of `add_scan`; true if it closes a keyframe.
  bool feed(const TimedScan& scan);

  /// Keyframes closed so far, and how many of them count as warm-up.
  [[nodiscard]] std::uint32_t keyframes() const { return keyframes_; }
  [[nodiscard]] std::uint32_t warm_up() const { return warm_up_; }

 private:
  Pipeline& pipeline_;
  std::int64_t (*clock_ns_)();
  SplitMeasurement& measurement_;
  std::uint32_t warm_up_;
  std::uint32_t keyframes_ = 0;
  std::size_t step_ = 0;
};

/// Markdown: percentiles of stages and calls in the steady state and while warming up, the longest
/// call and points per second. Dashes where the drive was too short for a steady state, which the
/// text below then says.
[[nodiscard]] std::string to_table(const SplitMeasurement& times, const std::string& title);

}  // namespace unimapper::bench
