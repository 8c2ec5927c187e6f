// Statistics of a run, written to stats.json.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "ports/lcm/encoding_thread.hpp"
#include "src/apps/onboard/delivery.hpp"
#include "src/apps/report/measured_load.hpp"
#include "src/input/finding.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::apps {

/// The name of a refused scan's cause, e.g. "pose_jump".
[[nodiscard]] std::string refusal_name(ErrorCode code);

/// Percentiles of one stage over the keyframes of a run.
struct StageTimes {
  float p50_ms = 0.0F;
  float p99_ms = 0.0F;
  float max_ms = 0.0F;
};

/// Accumulates the statistics of a run.
class RunStatistics {
 public:
  void add_scan(std::size_t points, const Error& error);
  /// `duration_ns`: the time its scans cover; processing that takes longer,
  /// or longer than the budget, misses the deadline.
  void add_keyframe(const KeyframeView& keyframe, std::int64_t duration_ns);
  /// A keyframe that repeats earlier ones, and is not kept.
  void add_repeat(const KeyframeStatistics& statistics);
  /// The call that closed a keyframe: how long it took, and in a run at the pace of its stamps
  /// whether the next scan was due before it returned.
  void add_closing_call(std::int64_t elapsed_ns, bool late);
  /// Final labels of a keyframe.
  void add_relabelled(const RelabelledKeyframe& relabelled);
  void add_loops(std::size_t candidates, std::size_t accepted);
  /// How long a keyframe's copy for the encoding thread took, and the wait for room if there was
  /// one.
  void add_hand_over(std::int64_t elapsed_ns);
  /// What became of the keyframes' messages, at the end.
  /// Of one session of the run.
  void add_encoding(const lcm_port::EncodingCounters& counters);

  [[nodiscard]] StageTimes stage_times(Stage stage) const;
  [[nodiscard]] std::uint64_t scans() const { return scans_; }
  [[nodiscard]] std::uint64_t scans_refused() const;
  [[nodiscard]] std::uint64_t keyframes() const { return keyframes_; }
  [[nodiscard]] std::uint64_t points_in() const { return points_in_; }
  [[nodiscard]] std::uint64_t dropped(DropCause cause) const {
    return dropped_.at(static_cast<std::size_t>(cause));
  }
  /// Keyframes in which anything was dropped for this cause.
  [[nodiscard]] std::uint64_t keyframes_dropping(DropCause cause) const {
    return keyframes_dropping_.at(static_cast<std::size_t>(cause));
  }
  /// The name of the cause that most scans were refused for; empty if none was.
  [[nodiscard]] std::string most_frequent_refusal() const;
  [[nodiscard]] std::uint64_t points_static() const { return points_static_; }
  [[nodiscard]] const CapacityUse& largest_use(Capacity capacity) const {
    return capacity_.at(static_cast<std::size_t>(capacity));
  }
  /// Keyframes in which up was known, or was not where the odometry promises.
  [[nodiscard]] std::uint64_t keyframes_up_known() const { return odometry_tilt_deg_.size(); }
  [[nodiscard]] std::uint64_t keyframes_up_contradicted() const { return up_contradicted_; }
  /// Keyframes that repeated earlier ones while the robot stood.
  [[nodiscard]] std::uint64_t keyframes_repeated() const { return repeats_; }
  /// Keyframes whose scans contradict the odometry.
  [[nodiscard]] std::uint64_t keyframes_odometry_contradicted() const {
    return odometry_contradicted_;
  }
  /// Median angle between up and the odometry's z axis where up is known, degrees; 0 if it never
  /// is.
  [[nodiscard]] float odometry_tilt_deg() const;
  /// What the last keyframe told of the sensor.
  [[nodiscard]] const SamplingStatistics& sampling() const { return sampling_; }
  /// Largest attitude noise of all keyframes, degrees; 0 where sweeps look uncompensated, which
  /// takes some keyframes to tell.
  [[nodiscard]] float attitude_noise_deg() const {
    return sweep_tilt_deg_ > 0.0F ? 0.0F : attitude_noise_deg_;
  }
  /// Largest tilt with the sensor's rotation, degrees; 0 where sweeps look compensated.
  [[nodiscard]] float sweep_tilt_deg() const { return sweep_tilt_deg_; }
  /// Scans that were aligned to the ground for either.
  [[nodiscard]] std::uint64_t aligned_scans() const { return aligned_scans_; }
  [[nodiscard]] std::uint64_t loops_accepted() const { return loops_accepted_; }
  [[nodiscard]] std::uint64_t deadline_misses() const { return deadline_misses_; }
  /// Cells whose label later keyframes changed, of those that were dynamic before or after; 0 to 1.
  [[nodiscard]] double relabelled_share() const;
  /// Of the valid points, those labelled dynamic; 0 to 1.
  [[nodiscard]] double dynamic_share() const;

  /// Figures of a run besides its keyframes.
  struct Run {
    std::uint64_t allocations_after_start = 0;
    std::uint64_t arena_bytes = 0;
    std::uint64_t files_not_written = 0;  ///< of the run folder, keyframes of its log among them
    bool realtime = false;
    std::uint32_t workers = 1;          ///< of the executor
    std::size_t scans_left_out = 0;     ///< between breaks of the odometry
    std::vector<std::string> sessions;  ///< more than one where the odometry breaks
    DeliveryCounters delivery;          ///< of the last session
    MeasuredLoad load;                  ///< of the machine, for the times
    std::string_view surroundings;      ///< that the parameters were chosen for
    float extent_m = 0.0F;              ///< what that was decided from; 0: it was stated
    std::vector<input::Finding> input;  ///< of the recording's plausibility
  };
  /// The content of stats.json. Only times differ between two runs on the same input.
  [[nodiscard]] std::string to_json(const Run& run) const;

 private:
  /// Points, and what was dropped, of a keyframe.
  void count(const KeyframeStatistics& statistics);
  std::uint64_t scans_ = 0;
  std::uint64_t keyframes_ = 0;
  std::uint64_t points_in_ = 0;
  std::uint64_t points_valid_ = 0;
  std::uint64_t points_static_ = 0;
  std::uint64_t points_dynamic_ = 0;
  std::uint64_t dynamic_cells_ = 0;
  std::uint64_t cells_now_dynamic_ = 0;
  std::uint64_t cells_now_static_ = 0;
  lcm_port::EncodingCounters encoding_;
  std::uint64_t loop_candidates_ = 0;
  std::uint64_t loops_accepted_ = 0;
  std::uint64_t deadline_misses_ = 0;
  SamplingStatistics sampling_;
  float attitude_noise_deg_ = 0.0F;
  float sweep_tilt_deg_ = 0.0F;
  std::uint64_t aligned_scans_ = 0;
  std::uint64_t keyframes_late_ = 0;
  std::uint64_t up_contradicted_ = 0;
  std::uint64_t odometry_contradicted_ = 0;
  std::uint64_t repeats_ = 0;
  std::vector<float> odometry_tilt_deg_;  // of keyframes in which up is known
  std::vector<float> closing_call_ms_;
  std::vector<float> hand_over_ms_;
  std::map<std::string, std::uint64_t> refused_;
  std::array<std::uint64_t, kDropCauses> dropped_{};
  std::array<std::uint64_t, kDropCauses> keyframes_dropping_{};
  std::array<CapacityUse, kCapacities> capacity_{};  // largest use
  std::array<std::vector<float>, kStages> stage_ms_;
};

}  // namespace unimapper::apps
