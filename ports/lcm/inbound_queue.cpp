#include "ports/lcm/inbound_queue.hpp"

#include <utility>

namespace unimapper::lcm_port {

namespace {

/// What a message takes beside its bytes: the object, and the heap's own.
constexpr std::size_t kBytesPerMessage = 128;

}  // namespace

std::size_t InboundQueue::cost_of(const InboundMessage& message) {
  return message.data.size() + message.channel.size() + kBytesPerMessage;
}

bool InboundQueue::push(InboundMessage message) {
  const std::size_t cost = cost_of(message);
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || cost > capacity_ - used_) {
      ++dropped_;
      return false;
    }
    used_ += cost;
    messages_.push_back(std::move(message));
  }
  filled_.notify_one();
  return true;
}

std::optional<InboundMessage> InboundQueue::pop(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(mutex_);
  filled_.wait_until(lock, until, [this] { return !messages_.empty() || closed_; });
  if (messages_.empty()) return std::nullopt;
  InboundMessage message = std::move(messages_.front());
  messages_.pop_front();
  used_ -= cost_of(message);
  return message;
}

void InboundQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  filled_.notify_all();
}

std::size_t InboundQueue::free_bytes() const {
  const std::lock_guard lock(mutex_);
  return capacity_ - used_;
}

std::uint64_t InboundQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

bool InboundQueue::is_over() const {
  const std::lock_guard lock(mutex_);
  return closed_ && messages_.empty();
}

}  // namespace unimapper::lcm_port
