#include "ports/lcm/receiving_thread.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <lcm/lcm-cpp.hpp>

#include "ports/lcm/arrival.hpp"
#include "ports/lcm/messages.hpp"

namespace unimapper::lcm_port {

namespace {

constexpr int kPollMs = 100;

/// In LCM's own queue, 31 MB of the largest datagrams: what comes while this thread waits for a
/// processor.
constexpr int kLcmQueueMessages = 512;

}  // namespace

ReceivingThread::ReceivingThread(lcm::LCM& link, std::size_t capacity_bytes)
    : link_(link), queue_(capacity_bytes) {
  link_.subscribe("UNIMAPPER_.*", &ReceivingThread::on_message, this)
      ->setQueueCapacity(kLcmQueueMessages);
  thread_ = std::thread([this] { run(); });
}

ReceivingThread::~ReceivingThread() {
  stopping_ = true;
  thread_.join();
}

void ReceivingThread::run() {
  while (!stopping_) {
    errno = 0;
    if (link_.handleTimeout(kPollMs) < 0 && errno != EINTR) break;
  }
  queue_.close();
}

void ReceivingThread::on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  // Our own, or another base's; and what processes on a robot tell each other.
  if (channel == kStoredChannel || channel == kReceiptChannel) return;
  const auto* const bytes = static_cast<const std::uint8_t*>(buffer->data);
  (void)queue_.push({channel, {bytes, bytes + buffer->data_size}, arrival_of(buffer->recv_utime)});
}

}  // namespace unimapper::lcm_port
