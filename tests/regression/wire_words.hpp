// Counters of a receiver in words
#pragma once

#include "unimapper/wire/receiver.hpp"
#include "words.hpp"

namespace unimapper::regression {

inline std::string counters_text(const wire::ReceiverCounters& c) {
  return line_of("messages", c.messages, "foreign", c.foreign, "malformed", c.malformed, "refused",
                 c.refused, "contradictory", c.contradictory, "duplicate", c.pieces_duplicate,
                 "keyframes", c.keyframes, "damaged", c.keyframes_damaged, "abandoned",
                 c.keyframes_abandoned);
}

}  // namespace unimapper::regression
