// Replay of a recording through the onboard pipeline.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/intensity.hpp"
#include "ports/keys/signature.hpp"
#include "ports/lcm/encoding_thread.hpp"
#include "ports/lcm/session_log.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "src/apps/onboard/delivery.hpp"
#include "src/apps/onboard/known_keyframes.hpp"
#include "src/apps/onboard/progress.hpp"
#include "src/apps/onboard/run_folder.hpp"
#include "src/apps/onboard/run_statistics.hpp"
#include "src/input/ranges.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::apps {

/// Outputs of a replay. All outlive the replay; `share` may be null.
struct ReplayOutputs {
  RunFolder& folder;
  RunStatistics& statistics;
  KnownKeyframes& known;
  lcm_port::SessionLogWriter& log;
  Delivery& delivery;
  const keys::KeyframeSigner* signer = nullptr;  ///< null: keyframes are not signed
  shared_memory::PipelineShare* share = nullptr;
  Progress& progress;
};

struct ReplayOptions {
  SessionId session;
  std::size_t first = 0;        ///< scan to begin with
  std::size_t end = 0;          ///< one past the last
  bool realtime = false;        ///< wait for each scan's stamp
  bool all_candidates = false;  ///< keep loop candidates below the threshold too
  bool final_labels = false;    ///< collect the labels of evicted keyframes, too
};

/// Feeds the scans in order and collects labels, keyframes, loops and statistics.
class Replay {
 public:
  Replay(const datasets::Dataset& dataset, Pipeline& pipeline, const ReplayOptions& options,
         ReplayOutputs outputs);

  /// Throws DatasetError as `read_scan` does, and whatever writing throws.
  void run();

  [[nodiscard]] const std::vector<LoopRecord>& loops() const { return loops_; }
  /// Scans left out as they repeat the one before although the robot moved, in order.
  [[nodiscard]] const std::vector<std::size_t>& repeated() const { return repeated_; }
  /// Allocations made inside the pipeline's own calls.
  [[nodiscard]] std::uint64_t allocations() const { return allocations_; }

 private:
  void feed(std::size_t index);
  /// Number in the recording of a scan that the pipeline counts from the replay's first.
  [[nodiscard]] std::size_t in_recording(std::uint32_t scan) const { return options_.first + scan; }
  [[nodiscard]] std::size_t points_of(std::size_t index) const {
    return points_.at(index - options_.first);
  }
  /// Arrival time of a scan in a real-time run; never, beyond the last.
  [[nodiscard]] std::chrono::steady_clock::time_point due(std::size_t index) const;
  void share(const ScanResult& result, bool is_scan);
  void handle(const ScanResult& result);
  void report_refusal(std::size_t index, const std::string& reason);
  void collect_keyframe();
  void collect_labels(const KeyframeView& keyframe);
  /// Relabels the scans of an evicted keyframe.
  void collect_final_labels(const RelabelledKeyframe& relabelled);
  /// Relabels the scans of the keyframes that are in the window at the end.
  void finish_labels();
  void collect_loops(const KeyframeView& keyframe);
  void send(const KeyframeView& keyframe);
  /// On the thread that encodes.
  void take(wire::EncodedKeyframe keyframe);
  void finish_encoding();
  /// Says so, once, when a keyframe had no room for all its cells.
  void warn_of_full_cells(const KeyframeStatistics& statistics);
  void publish_health();
  [[nodiscard]] std::int64_t duration_ns(const KeyframeView& keyframe) const;

  const datasets::Dataset& dataset_;
  Pipeline& pipeline_;
  ReplayOptions options_;
  ReplayOutputs outputs_;
  datasets::Scan scan_;
  datasets::IntensityScale intensity_;
  input::RepeatedScans repeats_;
  std::vector<std::size_t> repeated_;
  std::vector<std::size_t> points_;  // of every scan fed so far, from the first on
  std::vector<KeyframeScan> scans_;  // of a keyframe, by their numbers in the recording
  std::vector<PointLabel> labels_;
  /// A scan whose keyframe is in the window, with the labels of the online decision.
  struct OpenScan {
    std::uint32_t keyframe;
    std::size_t index;
    std::vector<PointLabel> labels;
  };
  std::deque<OpenScan> open_scans_;
  datasets::Scan earlier_scan_;
  std::vector<LoopRecord> loops_;
  std::uint64_t allocations_ = 0;
  bool warned_of_full_cells_ = false;
  std::chrono::steady_clock::time_point start_;
  lcm_port::EncodingThread encoding_;  // last: it ends before what it uses
};

}  // namespace unimapper::apps
