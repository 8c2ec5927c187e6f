// State of the pipeline: its stages, and what it does with them
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "budget.hpp"
#include "event_reporter.hpp"
#include "motion_gate.hpp"
#include "odometry_monitor.hpp"
#include "src/onboard/attitude/gravity.hpp"
#include "src/onboard/attitude/gravity_planes.hpp"
#include "src/onboard/calibration/calibration_monitor.hpp"
#include "src/onboard/keyframe/keyframe.hpp"
#include "src/onboard/keyframe/keyframe_builder.hpp"
#include "src/onboard/keyframe/keyframe_finisher.hpp"
#include "src/onboard/keyframe/keyframe_output.hpp"
#include "src/onboard/keyframe/scan_queue.hpp"
#include "src/onboard/removal/dynamic_removal.hpp"
#include "src/onboard/removal/evidence_window.hpp"
#include "standing.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper {

/// One member per stage, in the order the data takes. Scans come in pipeline.cpp, the order of
/// closing a keyframe is in keyframe_closing.cpp, who does which slice when in deferred_work.cpp.
struct Pipeline::State {
  explicit State(const PipelineConfig& configuration) noexcept
      : config(configuration),
        gate(configuration.keyframe),
        budget(configuration),
        builder(configuration),
        removal(config),
        gravity(configuration.odometry),
        standing(configuration.removal.window),
        finisher(config),
        events(configuration) {}

  void allocate(Arena& arena) noexcept;

  ScanResult add_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  ScanResult flush() noexcept;
  WorkResult work(std::uint32_t budget_us) noexcept;

  /// Checks a scan and adds it, or lets it wait. Returns why it was refused, or `kOk`.
  Error take_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  void ingest(const PointView& points, const onboard::ScanOrigin& origin, bool restarted) noexcept;
  /// A slice of that; false once it was the last one.
  bool ingest_step(const PointView& points, const onboard::ScanOrigin& origin,
                   bool restarted) noexcept;
  void forget() noexcept;

  // Closing a keyframe (keyframe_closing.cpp).
  void close() noexcept;
  void close_after_last_scan() noexcept;
  void close_now() noexcept;
  void remove_now() noexcept;
  void close_step() noexcept;
  static void classify_components(void* state) noexcept {
    const onboard::EvidenceWindow& window = static_cast<State*>(state)->window;
    while (static_cast<State*>(state)->removal.classify_step(window)) {
    }
  }
  /// Components, by one worker, while others relabel the keyframe that leaves the window.
  void classify_and_relabel() noexcept;
  /// Whether it is certain before they are classified that the keyframe leaves evidence.
  [[nodiscard]] bool relabels_beside() const noexcept {
    return !config.deferred && !standing.may_repeat();
  }
  void begin_closing() noexcept;
  void decide() noexcept;
  void record() noexcept;
  void announce() noexcept;
  /// Where the keyframe that is closing was seen from.
  [[nodiscard]] onboard::Viewpoint viewpoint() const noexcept;
  /// Looks for up among what is static, and levels the keyframe's frame by it.
  void find_up() noexcept;
  /// Writes down what is known of the keyframe but its place.
  void write_view() noexcept;
  void write_images() noexcept;
  void count_points() noexcept;

  // Deferred work (deferred_work.cpp).
  /// A slice of what comes first: the keyframe that closes, scans that wait, what is left to be
  /// done for the keyframe before.
  void do_slice() noexcept;
  void do_closing_slice() noexcept;
  void do_waiting_slice() noexcept;
  void do_finishing_slice() noexcept;
  /// What the next slice costs, about, and all that is left.
  [[nodiscard]] std::uint32_t next_cost() const noexcept;
  [[nodiscard]] std::uint32_t cost_left() const noexcept;
  [[nodiscard]] std::uint32_t closing_step_cost() const noexcept;
  [[nodiscard]] std::uint32_t closing_cost_left() const noexcept;
  /// What this call should cost, so that all calls until the next keyframe closes cost as much:
  /// what was done in it, what is left, and the scans to come, spread over them.
  [[nodiscard]] std::uint32_t share() const noexcept;
  void do_share() noexcept;
  /// Takes a scan out of a queue that is full.
  void make_room() noexcept;
  /// Finishes the last keyframe that is ready.
  void finish() noexcept;
  void tell_finished() noexcept;
  /// The keyframe, or another one after it, is not ready yet.
  [[nodiscard]] bool is_behind() const noexcept {
    return closing != Closing::kNone || !waiting.is_empty();
  }
  [[nodiscard]] bool is_busy() const noexcept { return is_behind() || finisher.is_busy(); }
  /// Whether a slice can be done before the caller has seen what is new: the labels of a keyframe
  /// that is ready hold as long as no scan is added, and what was told of one that is finished
  /// until another one is being finished.
  [[nodiscard]] bool may_continue() const noexcept {
    return ready_untold ? finisher.is_busy() && !finished_untold : is_busy();
  }
  /// What is relabelled in slices reads the window's occupancy before that is gone.
  static void finish_labels(void* state) noexcept {
    static_cast<State*>(state)->finisher.labels().finish(static_cast<State*>(state)->window);
  }
  /// What the caller has to be told since the last time this was asked.
  [[nodiscard]] ScanResult take_news(const Error& error) noexcept {
    return {error, std::exchange(ready_untold, false), std::exchange(finished_untold, false)};
  }

  PipelineConfig config;
  Pipeline pipeline;  ///< what the caller holds

  SlipCovariance slip = SlipCovariance::Zero();  ///< of the next scan
  onboard::MotionGate gate;
  onboard::Budget budget;
  onboard::ScanQueue waiting;
  onboard::KeyframeBuilder builder;
  onboard::EvidenceWindow window;
  onboard::DynamicRemoval removal;
  onboard::GravityPlanes gravity_planes;
  onboard::GravityEstimator gravity;
  onboard::OdometryMonitor odometry;
  onboard::CalibrationMonitor calibration;
  onboard::KeyframeOutput output;
  onboard::Standing standing;
  onboard::KeyframeFinisher finisher;
  onboard::EventReporter events;

  /// What closes a keyframe, in this order.
  enum class Closing : std::uint8_t {
    kBegin,
    kRemoval,       ///< which cells are dynamic by themselves
    kComponents,    ///< which are with what they belong to
    kDecision,      ///< what follows from that at once: what final labels need, and up
    kOutput,        ///< labels and cells
    kRecord,        ///< in the window
    kCalibration,   ///< how scans moved, against the poses
    kCounting,      ///< points
    kAnnouncement,  ///< to the caller
    kNone           ///< no keyframe is being closed
  };
  Closing closing = Closing::kNone;
  std::uint32_t scan_index = 0;
  std::uint32_t sequence = 0;
  onboard::Keyframe keyframes[2];
  onboard::Keyframe* current =
      &keyframes[0];  ///< the open one, or the one that the next scan begins
  onboard::Keyframe* closed = &keyframes[1];    ///< the last one that was closed
  onboard::Keyframe* finished = &keyframes[1];  ///< the last one that was finished
  bool ready_untold = false;     ///< the caller does not know yet that `closed` is ready
  bool finished_untold = false;  ///< the caller does not know yet that `finished` is

  // Costs are those of `slice_cost`.
  std::uint32_t closing_cost = 0;  ///< of slices done for the keyframe that closes, or the last one
  std::uint32_t cost_of_1024_blocks = 1024;  ///< of closing the keyframe before
  std::uint32_t late_slices = 0;             ///< of closing a keyframe, because the queue was full
  std::uint32_t call_cost = 0;               ///< of what was done in this call
  std::size_t scan_points = 0;               ///< of the last scan
  float longest_call_us = 0.0F;              ///< since the last keyframe was ready
};

}  // namespace unimapper
