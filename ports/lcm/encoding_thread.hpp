// Thread that encodes keyframes and hands their bytes on, beside the pipeline's.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <semaphore>
#include <thread>
#include <vector>

#include "unimapper/core/owned.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"
#include "unimapper/wire/keyframe_queue.hpp"
#include "unimapper/wire/pieces.hpp"

namespace unimapper::lcm_port {

/// Sizes of the queue before an encoding thread.
struct EncodingOptions {
  wire::KeyframeRoom room;      ///< for the largest keyframe
  std::uint32_t keyframes = 4;  ///< copies in memory, the one being encoded among them
  /// What a full queue does: drop its oldest keyframe (a robot in motion), or make `hand_over`
  /// wait (a recording that is processed faster than real time).
  bool drop_when_full = true;
};

/// What an encoding thread did so far.
struct EncodingCounters {
  std::uint64_t handed_over = 0;  ///< keyframes
  std::uint64_t encoded = 0;      ///< keyframes encoded and handed on
  std::uint64_t dropped = 0;  ///< keyframes dropped from the full queue, or larger than its slots
  std::uint64_t refused = 0;  ///< keyframes that the encoder refused
  std::uint64_t bytes = 0;    ///< of the encoded keyframes
  std::uint64_t image_bytes = 0;  ///< of the free-space images in encoded keyframes
  std::uint64_t left_out = 0;     ///< elements beyond the ranges of a message
};

/// Copies keyframes on the pipeline's thread and encodes them on its own, in order.
class EncodingThread {
 public:
  /// Takes an encoded keyframe, on the thread. What it throws ends the encoding and is thrown again
  /// by `rethrow` and `finish`.
  using Take = std::function<void(wire::EncodedKeyframe)>;

  /// Allocates all memory and begins. Throws std::bad_alloc.
  EncodingThread(const SessionId& session, const EncodingOptions& options, Take take);
  /// Drops what waits.
  ~EncodingThread();
  EncodingThread(const EncodingThread&) = delete;
  EncodingThread& operator=(const EncodingThread&) = delete;

  /// Hands a keyframe over, to be called before the pipeline's next call. A copy, and at most one
  /// system call that wakes the thread: no heap, no lock, and no wait if `drop_when_full`. For one
  /// thread.
  wire::HandedOver hand_over(const KeyframeContent& keyframe) noexcept;
  /// Throws what `Take` threw, if it did.
  void rethrow();
  /// Waits until all is encoded. Throws what `Take` threw.
  EncodingCounters finish();

 private:
  void run();
  void encode(const KeyframeContent& keyframe);
  void stop() noexcept;

  const SessionId session_;
  const EncodingOptions options_;
  const Take take_;
  Owned<wire::KeyframeQueue> queue_;
  MemoryBlock encoder_memory_;
  wire::KeyframeEncoder encoder_;
  std::vector<std::uint8_t> buffer_;  ///< grows to the largest keyframe
  std::counting_semaphore<> queued_{0};
  std::counting_semaphore<> has_room_{0};
  std::atomic<bool> finishing_{false};
  std::atomic<bool> stopping_{false};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::exception_ptr failure_;
  EncodingCounters sums_;          ///< the thread's
  std::uint64_t handed_over_ = 0;  ///< the caller's
  std::uint64_t dropped_ = 0;      ///< the caller's
  std::thread thread_;
};

}  // namespace unimapper::lcm_port
