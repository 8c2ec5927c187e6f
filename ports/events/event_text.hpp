// The onboard pipeline's events as lines of text, for the thread that writes logs.
#pragma once

#include <string>

#include "unimapper/core/event_ring.hpp"

namespace unimapper::events {

/// One line without a line break: the stamp in seconds, then what happened, e.g.
/// "12.300000000 keyframe 4 closed: 10 scans, 5120 static cells, 31 dynamic cells". Records of
/// unknown kind are shown with their numbers. Allocates: call it on the consumer's thread.
[[nodiscard]] std::string to_text(const EventRecord& record);

/// Takes every record out of the ring and hands its line to `write`; at the end a line that
/// tells how many records were lost for want of room since `lost_before`, if any were. Returns
/// the ring's new count of lost records, to be passed next time.
template <typename Write>
std::uint32_t drain(EventRing& ring, std::uint32_t lost_before, Write write) {
  // As many as fit the ring: a producer that never stops cannot hold us here.
  EventRecord record;
  for (std::uint32_t i = 0; i < ring.capacity() && ring.pop(record); ++i) write(to_text(record));
  const std::uint32_t lost = ring.overflow();
  if (lost != lost_before) write(std::to_string(lost - lost_before) + " events lost: ring full");
  return lost;
}

}  // namespace unimapper::events
