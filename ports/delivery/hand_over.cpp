#include "ports/delivery/hand_over.hpp"

#include <cstring>
#include <exception>
#include <utility>

namespace unimapper::delivery {

HandOver::HandOver(std::size_t slots, std::size_t slot_bytes, Take take)
    : slots_(slots), take_(std::move(take)) {
  for (Slot& slot : slots_) slot.memory.resize(slot_bytes);
  thread_ = std::thread([this] { run(); });
}

HandOver::~HandOver() { finish(); }

bool HandOver::put(wire::Bytes keyframe, std::int64_t stamp_ns) noexcept {
  const std::uint64_t number = put_.load(std::memory_order_relaxed);
  if (number - taken_.load(std::memory_order_acquire) >= slots_.size()) return false;
  Slot& slot = slots_[static_cast<std::size_t>(number % slots_.size())];
  if (keyframe.size() > slot.memory.size()) return false;
  std::memcpy(slot.memory.data(), keyframe.data(), keyframe.size());
  slot.bytes = keyframe.size();
  slot.stamp_ns = stamp_ns;
  put_.store(number + 1, std::memory_order_release);
  queued_.release();
  return true;
}

void HandOver::finish() noexcept {
  finishing_.store(true, std::memory_order_release);
  queued_.release();
  if (thread_.joinable()) thread_.join();
}

void HandOver::run() {
  for (std::uint64_t number = 0;; ++number) {
    while (put_.load(std::memory_order_acquire) == number) {
      // What was put in came before the word to finish.
      if (finishing_.load(std::memory_order_acquire) &&
          put_.load(std::memory_order_acquire) == number) {
        return;
      }
      queued_.acquire();
    }
    const Slot& slot = slots_[static_cast<std::size_t>(number % slots_.size())];
    try {
      take_(wire::Bytes(slot.memory).first(slot.bytes), slot.stamp_ns);
    } catch (const std::exception&) {
      failed_.fetch_add(1, std::memory_order_relaxed);
    }
    taken_.store(number + 1, std::memory_order_release);
  }
}

}  // namespace unimapper::delivery
