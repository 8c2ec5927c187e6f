// Steps of the protocol at which tests end a process.
#pragma once

#include <cstdint>

namespace unimapper::shared_memory {

/// What has just been done when `step` is called.
enum class Step : std::uint8_t {
  kConsumerLocked,   ///< a consumer has its slot
  kConsumerJoined,   ///< a consumer has a slot with an empty lease table
  kMessageFound,     ///< a consumer has chosen a chunk
  kLeaseWritten,     ///< a consumer has written its lease of the chosen chunk
  kLeaseChecked,     ///< a consumer holds the leased message
  kMessageReleased,  ///< a consumer has given the lease back
  kWriterLocked,     ///< a writer has the topic
  kSegmentOpened,    ///< a writer has the topic and its segment
  kTakenOver,        ///< a writer has put right what the writer before left
  kChunkClaimed,     ///< a writer has chosen a chunk
  kChunkLoaned,      ///< the writer's chunk has no lease
  kSequenceWritten,  ///< the writer's chunk holds a whole message
  kClaimReleased,    ///< the writer's chunk may be leased
  kMessageAnnounced  ///< consumers know of the writer's message
};
inline constexpr std::uint32_t kSteps = 14;

#ifdef UNIMAPPER_SHARED_MEMORY_STEPS
/// Defined by the test.
void step(Step done) noexcept;
#else
inline void step(Step) noexcept {}
#endif

}  // namespace unimapper::shared_memory
