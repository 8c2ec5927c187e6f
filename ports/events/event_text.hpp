// Text formatting of the onboard pipeline's events, for a logging thread.
#pragma once

#include <string>

#include "unimapper/core/event_ring.hpp"

namespace unimapper::events {

/// One line without a line break: the stamp in seconds, then what happened, e.g.
/// "12.300000000 keyframe 4 closed: 10 scans, 5120 static cells, 31 dynamic cells". Records of
/// unknown kind are shown with their numbers. Allocates: call it on the consumer's thread.
[[nodiscard]] std::string to_text(const EventRecord& record);

/// Takes every record out of the ring and passes its line to `write`; finally a line with the
/// number of records lost to a full ring since `lost_before`, if any. Returns
/// the ring's new count of lost records, to be passed next time.
template <typename Write>
std::uint32_t drain(EventRing& ring, std::uint32_t lost_before, Write write) {
  // At most the ring's capacity: bounded even if the producer never stops.
  EventRecord record;
  for (std::uint32_t i = 0; i < ring.capacity() && ring.pop(record); ++i) write(to_text(record));
  const std::uint32_t lost = ring.overflow();
  if (lost != lost_before) write(std::to_string(lost - lost_before) + " events lost: ring full");
  return lost;
}

}  // namespace unimapper::events
