// Keyframes, labels and health written into shared memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ports/shared_memory/contents.hpp"
#include "unimapper/core/ids.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::shared_memory {

/// Room for any keyframe of a pipeline, bytes.
[[nodiscard]] std::uint64_t max_keyframe_bytes(const PipelineConfig& config) noexcept;
/// Room for the labels of any scan, bytes.
[[nodiscard]] std::uint64_t max_labels_bytes(const PipelineConfig& config) noexcept;

/// Writes a keyframe; its bytes, or 0 if `out` has no room for them. One copy of each element, no
/// heap, no lock. O(cells).
[[nodiscard]] std::size_t write_keyframe(const KeyframeView& keyframe, const SessionId& session,
                                         std::span<std::byte> out) noexcept;

/// Where the labels of a scan go: behind the head, to be filled by `Pipeline::labels`. Empty if
/// `out` has no room for any.
[[nodiscard]] std::span<PointLabel> label_memory(std::span<std::byte> out) noexcept;
/// Completes the message after `count` labels were written there; its bytes.
[[nodiscard]] std::size_t finish_labels(const KeyframeScan& scan, std::uint32_t keyframe,
                                        const SessionId& session, std::size_t count,
                                        std::span<std::byte> out) noexcept;

/// Sums up what scans and keyframes say of the pipeline.
class HealthSum {
 public:
  /// Counts a scan, refused or not.
  void add_scan(const Error& error) noexcept;
  /// Adds a finished keyframe.
  void add_keyframe(const KeyframeView& keyframe) noexcept;
  /// Counts a message that was not shared.
  void add_failure() noexcept { ++sum_.not_shared; }
  /// The sum so far.
  [[nodiscard]] const SharedHealth& sum() const noexcept { return sum_; }
  /// Writes the message; its bytes, or 0 if `out` has no room for them.
  [[nodiscard]] std::size_t write(const SessionId& session,
                                  std::span<std::byte> out) const noexcept;

 private:
  SharedHealth sum_ = {};
};

}  // namespace unimapper::shared_memory
