// Thread that takes messages from LCM into a queue bounded by bytes.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "ports/lcm/inbound_queue.hpp"

namespace lcm {
class LCM;
struct ReceiveBuffer;
}  // namespace lcm

namespace unimapper::lcm_port {

/// LCM bounds its queue by messages alone; a thread that does nothing else keeps it nearly empty,
/// and what waits for a slower user waits in an `InboundQueue`.
class ReceivingThread {
 public:
  /// Subscribes to the project's channels but those from the base. `link` outlives it.
  ReceivingThread(lcm::LCM& link, std::size_t capacity_bytes);
  /// Ends within 0.1 s.
  ~ReceivingThread();
  ReceivingThread(const ReceivingThread&) = delete;
  ReceivingThread& operator=(const ReceivingThread&) = delete;

  /// What has arrived; it is closed if LCM broke.
  [[nodiscard]] InboundQueue& queue() { return queue_; }

 private:
  void run();
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel);

  lcm::LCM& link_;
  InboundQueue queue_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace unimapper::lcm_port
