// Steps of the protocol at which tests end a process.
#pragma once

#include <cstdint>

namespace unimapper::shared_memory {

/// What has just been done when `step` is called.
enum class Step : std::uint8_t {
  kConsumerLocked,   ///< a consumer has its slot
  kConsumerJoined,   ///< and its lease table is empty
  kMessageFound,     ///< a consumer has chosen a chunk
  kLeaseWritten,     ///< and written its lease
  kLeaseChecked,     ///< and holds the message
  kMessageReleased,  ///< and has given the lease back
  kWriterLocked,     ///< a writer has the topic
  kSegmentOpened,    ///< and its segment
  kTakenOver,        ///< and has put right what the writer before left
  kChunkClaimed,     ///< a writer has chosen a chunk
  kChunkLoaned,      ///< and it has no lease
  kSequenceWritten,  ///< and holds a whole message
  kClaimReleased,    ///< and may be leased
  kMessageAnnounced  ///< and consumers know of it
};
inline constexpr std::uint32_t kSteps = 14;

#ifdef UNIMAPPER_SHARED_MEMORY_STEPS
/// Defined by the test.
void step(Step done) noexcept;
#else
inline void step(Step) noexcept {}
#endif

}  // namespace unimapper::shared_memory
