// Serialisation of keyframes on the robot: one pass, no heap, the caller's memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/ids.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper::wire {

class CellCode;
class ImageBytes;

/// What became of a keyframe to be encoded.
struct [[nodiscard]] EncodeResult {
  /// `kOk`; `kBufferTooSmall`: the buffer holds no keyframe now; `kInvalidKeyframe`: no scans,
  /// scans out of order, a reference scan that is not there, a pose that is not rigid, too many
  /// elements.
  Error error;
  /// Bytes the keyframe takes, exactly, whether or not they fitted; 0 if it is invalid.
  std::size_t bytes = 0;
  std::size_t image_bytes = 0;  ///< bytes of the code of the free-space images
  /// Cells and keypoints that are not in the message: too far away for its grid, not finite, or
  /// cells beyond the encoder's capacity.
  std::uint64_t left_out = 0;
};

/// Turns keyframes into the bytes of docs/wire-format.md under the pipeline's own guarantees: no
/// heap, no locks, no exceptions, every loop bounded. Not thread safe.
class KeyframeEncoder {
 public:
  /// Bytes of scratch memory for keyframes of at most `max_cells` static and as many dynamic cells
  /// (`VoxelConfig::max_cells` is always enough): 16 a cell and 190 kB.
  static std::size_t required_bytes(std::uint32_t max_cells) noexcept;

  /// An encoder that works in `memory` (64-byte aligned, at least `required_bytes`), which must
  /// outlive it. Errors: `kMemoryTooSmall`, `kMemoryMisaligned`.
  static Expected<KeyframeEncoder> create(std::uint32_t max_cells,
                                          std::span<std::byte> memory) noexcept;

  /// Does nothing before it was made by `create`.
  KeyframeEncoder() = default;

  /// Writes the keyframe's bytes to `out`. Static and dynamic cells, keypoints and images travel;
  /// planes do not, because the base finds them in the static cells. Equal keyframes give equal
  /// bytes whatever the order of their cells. With an empty `out` it only tells the size, at the
  /// same cost. O(cells + pixels).
  EncodeResult encode(const KeyframeContent& keyframe, const SessionId& session,
                      std::span<std::uint8_t> out) noexcept;

 private:
  std::uint64_t* keys_ = nullptr;
  std::uint64_t* spare_keys_ = nullptr;
  std::uint32_t* counts_ = nullptr;
  CellCode* code_ = nullptr;
  ImageBytes* images_ = nullptr;
  std::uint32_t max_cells_ = 0;
};

}  // namespace unimapper::wire
