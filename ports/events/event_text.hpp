// Text formatting of the onboard pipeline's events, for a logging thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "unimapper/core/event_ring.hpp"

namespace unimapper::events {

/// "the poses look like ...; do ...": what undoes a mistake by the number that events have
/// (docs/design/plausibility.md#while-the-robot-drives); empty for 0 and unknown ones.
[[nodiscard]] std::string_view remedy_of_mistake(std::int64_t mistake);

/// One line without a line break: the stamp in seconds, then what happened, e.g.
/// "12.300000000 keyframe 4 closed: 10 scans, 5120 static cells, 31 dynamic cells". Records of
/// unknown kind are shown with their numbers. Allocates: call it on the consumer's thread.
[[nodiscard]] std::string to_text(const EventRecord& record);

/// Whether a record says that poses and scans contradict each other.
[[nodiscard]] bool is_contradiction(const EventRecord& record);

/// Takes every record out of the ring and passes its line to `write`, and the record if it takes
/// one; finally a line with the
/// number of records lost to a full ring since `lost_before`, if any. Returns
/// the ring's new count of lost records, to be passed next time.
template <typename Write>
std::uint32_t drain(EventRing& ring, std::uint32_t lost_before, Write write) {
  // At most the ring's capacity: bounded even if the producer never stops.
  EventRecord record;
  for (std::uint32_t i = 0; i < ring.capacity() && ring.pop(record); ++i) {
    if constexpr (std::is_invocable_v<Write, std::string, const EventRecord&>) {
      write(to_text(record), record);
    } else {
      write(to_text(record));
    }
  }
  const std::uint32_t lost = ring.overflow();
  if (lost == lost_before) return lost;
  const std::string line = std::to_string(lost - lost_before) + " events lost: ring full";
  if constexpr (std::is_invocable_v<Write, std::string, const EventRecord&>) {
    write(line, EventRecord{});
  } else {
    write(line);
  }
  return lost;
}

}  // namespace unimapper::events
