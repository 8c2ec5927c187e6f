// Queue of keyframe copies between the pipeline's thread and the one that encodes them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper::wire {

/// Room for one keyframe of a queue.
struct KeyframeRoom {
  std::uint32_t scans = 0;      ///< of the keyframe
  std::uint32_t cells = 0;      ///< static and dynamic ones together
  std::uint32_t keypoints = 0;  ///< of its place
  std::uint32_t images = 0;     ///< of free space
  std::size_t pixels = 0;       ///< of each image
};

/// What became of a keyframe that was handed over.
enum class HandedOver : std::uint8_t {
  kQueued,          ///< it is in the queue
  kReplacedOldest,  ///< in the queue, whose oldest keyframe was dropped for it
  kFull,            ///< not queued: there is no room
  kTooLarge,        ///< not queued: larger than a slot
};

/// Copies of keyframes in memory laid out before: one thread puts them in, one takes them out in
/// the same order. No heap, no lock, no wait, no system call. A copy holds what is encoded: not the
/// planes.
class KeyframeQueue {
 public:
  static constexpr std::uint32_t kMaxSlots = 16;  ///< most keyframes at a time

  /// Lays out `slots` (2 to `kMaxSlots`) copies, the one being taken out among them.
  void allocate(Arena& arena, const KeyframeRoom& room, const std::uint32_t& slots) noexcept;

  /// Copies a keyframe into the queue. Where it is full, drops the oldest one that nobody reads
  /// (`drop_oldest`) or refuses. O(bytes of the keyframe). For one thread.
  HandedOver push(const KeyframeContent& keyframe, bool drop_oldest) noexcept;

  /// The oldest keyframe, or null; stays as it is until `pop`. For one other thread.
  const KeyframeContent* front() noexcept;
  /// Gives the keyframe of `front` back.
  void pop() noexcept;

 private:
  /// Free; being written; readable; being read.
  enum class Use : std::uint32_t { kFree = 0, kWriting = 1, kReadable = 2, kReading = 3 };

  struct Slot {
    /// Use in the lowest two bits, order of arrival above: two keyframes of a slot differ.
    std::atomic<std::uint32_t> state{0};
    KeyframeContent content;
    KeyframeScan* scans = nullptr;
    FineCell* cells = nullptr;
    Keypoint* keypoints = nullptr;
    FreeSpaceImage* images = nullptr;
    std::uint16_t* pixels = nullptr;
  };

  [[nodiscard]] bool fits(const KeyframeContent& keyframe) const noexcept;
  void copy(const KeyframeContent& keyframe, Slot& slot) const noexcept;
  /// The readable slot whose keyframe came first, and its state; null if none is readable.
  [[nodiscard]] Slot* oldest(std::uint32_t& state) const noexcept;
  [[nodiscard]] Slot* find_free() const noexcept;

  KeyframeRoom room_;
  std::uint32_t slot_count_ = 0;
  Slot* slots_ = nullptr;
  std::uint32_t order_ = 0;  ///< the writer's: keyframes put in so far
  Slot* reading_ = nullptr;  ///< the reader's
};

}  // namespace unimapper::wire
