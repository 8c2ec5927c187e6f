// Ring of events for a pipeline, and what is taken out of it
#pragma once

#include <vector>

#include "unimapper/core/event_ring.hpp"
#include "unimapper/onboard/events.hpp"

namespace unimapper::test {

struct EventLog {
  alignas(64) std::byte memory[EventRing::required_bytes(256)];
  EventRing* ring = EventRing::create(256, memory).value();

  std::vector<EventRecord> take() const {
    std::vector<EventRecord> records;
    EventRecord record;
    while (ring->pop(record)) records.push_back(record);
    return records;
  }
  std::vector<EventRecord> take(EventId id) const {
    std::vector<EventRecord> records = take();
    std::erase_if(records, [id](const EventRecord& record) {
      return record.id != static_cast<std::uint32_t>(id);
    });
    return records;
  }
};

}  // namespace unimapper::test
