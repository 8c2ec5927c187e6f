// Queue of received messages that is bounded by bytes.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

/// A message as it came from the network.
struct InboundMessage {
  std::string channel;             ///< of LCM
  std::vector<std::uint8_t> data;  ///< as it came, an envelope included
  wire::ProbeArrival arrival;      ///< when it came
};

/// Hands messages from the thread that receives to the one that uses them. What does not fit is
/// dropped and counted, as in a socket's buffer. Thread safe; O(1) but for copying.
class InboundQueue {
 public:
  /// Room for so many bytes: data, channels and 128 for each message.
  explicit InboundQueue(std::size_t capacity_bytes) : capacity_(capacity_bytes) {}

  /// False if it did not fit.
  bool push(InboundMessage message);
  /// The oldest message; waits for one until this time, or until `close`.
  std::optional<InboundMessage> pop(std::chrono::steady_clock::time_point until);
  /// Nothing will come any more; what is there can be taken.
  void close();

  /// Room that is left.
  [[nodiscard]] std::size_t free_bytes() const;
  /// Messages that did not fit.
  [[nodiscard]] std::uint64_t dropped() const;
  /// Whether it was closed and is empty.
  [[nodiscard]] bool is_over() const;

 private:
  static std::size_t cost_of(const InboundMessage& message);

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<InboundMessage> messages_;
  std::size_t used_ = 0;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace unimapper::lcm_port
