// Memory of a publisher: which keyframes it holds, and which only its storage.
#include <algorithm>

#include "ports/lcm/publisher.hpp"

namespace unimapper::lcm_port {

/// The oldest keyframe in the queue's memory stays there by number if the storage has it.
void Publisher::make_queue_room() {
  const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Queued& queued) {
    return !queued.keyframe.bytes.empty();
  });
  if (oldest == queue_.end()) return;
  --queued_in_memory_;
  if (storage_ != nullptr && storage_->holds(session_.info.id, oldest->keyframe.sequence)) {
    oldest->keyframe.bytes = {};
    return;
  }
  queue_.erase(oldest);
  ++counters_.keyframes_dropped;
}

void Publisher::hold(const Queued& queued) {
  const std::uint32_t sequence = queued.keyframe.sequence;
  const std::uint32_t pieces = count_messages(queued.bytes, options_.datagram_bytes);
  if (pieces == 0) return;
  release(sequence);
  Held& held = held_[sequence];
  held.bytes = queued.bytes;
  const std::uint32_t leading =
      count_leading_messages(queued.keyframe.bytes, options_.datagram_bytes);
  if (queued.was_sent) {
    outbox_.add_sent(sequence, pieces, leading);
    return;
  }
  outbox_.add(sequence, pieces, leading);
  if (queued.keyframe.bytes.empty()) return;
  fresh_ = sequence;
  held.messages = cut_into_messages(queued.keyframe, options_.datagram_bytes);
  held_bytes_ += held.bytes;
  loaded_.insert(sequence);
  limit_memory();
}

/// Reads a keyframe back that is to be sent; false if it is gone.
bool Publisher::load(std::uint32_t sequence) {
  Held& held = held_.at(sequence);
  if (!held.messages.empty()) return true;
  const auto keyframe =
      storage_ == nullptr ? std::nullopt : storage_->read(session_.info.id, sequence);
  if (!keyframe || keyframe->bytes.size() != held.bytes) {
    evict(sequence);
    return false;
  }
  held.messages = cut_into_messages(*keyframe, options_.datagram_bytes);
  held_bytes_ += held.bytes;
  loaded_.insert(sequence);
  limit_memory();
  return true;
}

void Publisher::unload(std::uint32_t sequence) {
  if (loaded_.erase(sequence) == 0) return;
  Held& held = held_.at(sequence);
  held_bytes_ -= held.bytes;
  held.messages = {};
}

/// The oldest goes first; with a storage, that of which nothing is to be sent soon.
void Publisher::limit_memory() {
  while (held_bytes_ > options_.unacknowledged_bytes && loaded_.size() > 1) {
    auto victim = loaded_.begin();
    if (storage_ != nullptr) {
      victim = std::find_if(loaded_.begin(), loaded_.end(),
                            [this](std::uint32_t one) { return !outbox_.is_due(one); });
      if (victim == loaded_.end()) {
        victim = std::find_if(loaded_.begin(), loaded_.end(),
                              [this](std::uint32_t one) { return !outbox_.may_be_next(one); });
      }
      if (victim == loaded_.end()) return;
    }
    if (storage_ != nullptr && storage_->holds(session_.info.id, *victim)) {
      unload(*victim);
    } else {
      evict(*victim);
    }
  }
}

void Publisher::release(std::uint32_t sequence) {
  outbox_.forget(sequence);
  const auto held = held_.find(sequence);
  if (held == held_.end()) return;
  unload(sequence);
  held_.erase(held);
}

void Publisher::evict(std::uint32_t sequence) {
  const bool was_sent = outbox_.was_sent(sequence);
  release(sequence);
  const std::lock_guard lock(mutex_);
  ++(was_sent ? counters_.keyframes_unacknowledged : counters_.keyframes_dropped);
}

/// What the storage has waits there for the next start.
void Publisher::evict_rest() {
  const auto is_kept = [this](std::uint32_t sequence) {
    return storage_ != nullptr && storage_->holds(session_.info.id, sequence);
  };
  while (const auto sequence = outbox_.oldest()) {
    is_kept(*sequence) ? release(*sequence) : evict(*sequence);
  }
  const std::lock_guard lock(mutex_);
  for (const Queued& queued : queue_) {
    counters_.keyframes_dropped += is_kept(queued.keyframe.sequence) ? 0 : 1;
  }
  queue_.clear();
}

}  // namespace unimapper::lcm_port
