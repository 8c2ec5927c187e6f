// Topics of a pipeline: its keyframes, labels and health for other processes on the robot.
#pragma once

#include <cstdint>
#include <string_view>

#include "ports/shared_memory/content_writer.hpp"
#include "ports/shared_memory/writer.hpp"

namespace unimapper::shared_memory {

/// Size and audience of a pipeline's topics.
struct PipelineShareOptions {
  std::uint32_t consumers = 4;              ///< of each topic, at a time; 1 to 16
  Audience audience = Audience::kSameUser;  ///< whose processes may read
  bool labels = true;                       ///< share the labels of every scan, too
};

/// Shares what a pipeline makes under one name, as the topics `keyframe`, `labels` and `health`.
/// After `open` no heap, no lock, no wait: a copy of the keyframe, and the system calls of
/// `Writer`. Memory: consumers + 2 keyframes, consumers x 2 + 32 scans' labels. Not thread safe.
class PipelineShare {
 public:
  /// Makes the topics or takes them over, with room for whatever a pipeline of this configuration
  /// makes; the sessions' name is `share`. Refuses what `Writer::open` refuses.
  Outcome open(std::string_view share, const PipelineConfig& config, const SessionId& session,
               const PipelineShareOptions& options = {}) noexcept;

  /// To be called after every `add_scan`, before the pipeline's next call: publishes the labels of
  /// the keyframe that is ready, and the one that is finished with the pipeline's health.
  void after_scan(const Pipeline& pipeline, const ScanResult& result) noexcept;
  /// To be called after every `flush`, before the pipeline's next call. Publishes the labels of the
  /// keyframe that is ready, and the one that is finished with the pipeline's health.
  void after_flush(const Pipeline& pipeline, const ScanResult& result) noexcept;

  /// The writer of a topic, for `Writer::wait_beyond` on another thread; null if there is no such
  /// topic or it is not shared.
  [[nodiscard]] const Writer* writer(ContentKind topic) const noexcept;
  /// What was counted so far; `not_shared` among it.
  [[nodiscard]] const SharedHealth& health() const noexcept { return health_.sum(); }
  /// Gives back what dead consumers hold. Not for the real-time thread; once a second is enough.
  void reclaim() noexcept;
  /// Takes the topics out of /dev/shm. Otherwise the last keyframe stays for late joiners, and the
  /// next start of this robot goes on with the memory.
  void remove() noexcept;

 private:
  void share_labels(const Pipeline& pipeline) noexcept;
  void share_finished(const Pipeline& pipeline) noexcept;
  void count(std::uint32_t published) noexcept;

  SessionId session_;
  HealthSum health_;
  Writer keyframes_;
  Writer labels_;
  Writer healths_;
  bool has_labels_ = false;
};

}  // namespace unimapper::shared_memory
