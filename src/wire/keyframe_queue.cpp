#include "unimapper/wire/keyframe_queue.hpp"

#include <algorithm>
#include <new>
#include <span>

namespace unimapper::wire {

namespace {

constexpr std::uint32_t kUseBits = 2;
constexpr std::uint32_t kUseMask = (1U << kUseBits) - 1;

/// Copies a list behind another; the copy.
template <typename T>
std::span<const T> copy_list(std::span<const T> from, T* to) noexcept {
  std::copy_n(from.data(), from.size(), to);
  return {to, from.size()};
}

/// Whether an order came before another, also where the count has begun anew.
bool is_before(std::uint32_t a, std::uint32_t b) noexcept {
  constexpr std::uint32_t kHalf = 1U << 31U;
  return ((a - b) & ~kUseMask) >= kHalf;
}

}  // namespace

void KeyframeQueue::allocate(Arena& arena, const KeyframeRoom& room,
                             const std::uint32_t& slots) noexcept {
  room_ = room;
  slot_count_ = slots < 2 ? 2 : (slots > kMaxSlots ? kMaxSlots : slots);
  slots_ = arena.allocate<Slot>(slot_count_);
  for (std::uint32_t i = 0; i < slot_count_; ++i) {
    Slot layout;
    layout.scans = arena.allocate<KeyframeScan>(room.scans);
    layout.cells = arena.allocate<FineCell>(room.cells);
    layout.keypoints = arena.allocate<Keypoint>(room.keypoints);
    layout.images = arena.allocate<FreeSpaceImage>(room.images);
    layout.pixels = arena.allocate<std::uint16_t>(room.images * room.pixels);
    if (slots_ == nullptr) continue;
    Slot& slot = *new (&slots_[i]) Slot;
    slot.scans = layout.scans;
    slot.cells = layout.cells;
    slot.keypoints = layout.keypoints;
    slot.images = layout.images;
    slot.pixels = layout.pixels;
  }
}

bool KeyframeQueue::fits(const KeyframeContent& keyframe) const noexcept {
  if (keyframe.scans.size() > room_.scans || keyframe.images.size() > room_.images ||
      keyframe.place.keypoints.size() > room_.keypoints ||
      keyframe.static_cells.size() + keyframe.dynamic_cells.size() > room_.cells) {
    return false;
  }
  for (const FreeSpaceImage& image : keyframe.images) {
    if (image.pixels.size() > room_.pixels) return false;
  }
  return true;
}

void KeyframeQueue::copy(const KeyframeContent& keyframe, Slot& slot) const noexcept {
  slot.content = keyframe;
  slot.content.scans = copy_list(keyframe.scans, slot.scans);
  slot.content.static_cells = copy_list(keyframe.static_cells, slot.cells);
  slot.content.dynamic_cells =
      copy_list(keyframe.dynamic_cells, slot.cells + keyframe.static_cells.size());
  slot.content.place.keypoints = copy_list(keyframe.place.keypoints, slot.keypoints);
  slot.content.place.planes = {};
  for (std::size_t i = 0; i < keyframe.images.size(); ++i) {
    const FreeSpaceImage& image = keyframe.images[i];
    slot.images[i] = {image.scan, copy_list(image.pixels, slot.pixels + i * room_.pixels)};
  }
  slot.content.images = {slot.images, keyframe.images.size()};
}

KeyframeQueue::Slot* KeyframeQueue::oldest(std::uint32_t& state) const noexcept {
  Slot* best = nullptr;
  for (std::uint32_t i = 0; i < slot_count_; ++i) {
    const std::uint32_t seen = slots_[i].state.load(std::memory_order_acquire);
    if ((seen & kUseMask) != static_cast<std::uint32_t>(Use::kReadable)) continue;
    if (best != nullptr && !is_before(seen, state)) continue;
    best = &slots_[i];
    state = seen;
  }
  return best;
}

KeyframeQueue::Slot* KeyframeQueue::find_free() const noexcept {
  for (std::uint32_t i = 0; i < slot_count_; ++i) {
    const std::uint32_t seen = slots_[i].state.load(std::memory_order_acquire);
    if ((seen & kUseMask) == static_cast<std::uint32_t>(Use::kFree)) return &slots_[i];
  }
  return nullptr;
}

HandedOver KeyframeQueue::push(const KeyframeContent& keyframe, bool drop_oldest) noexcept {
  if (!fits(keyframe)) return HandedOver::kTooLarge;
  Slot* slot = find_free();
  HandedOver result = HandedOver::kQueued;
  // The reader may take the oldest first, but it holds one at a time: few attempts are enough.
  for (std::uint32_t attempt = 0; slot == nullptr && drop_oldest && attempt < kMaxSlots;
       ++attempt) {
    std::uint32_t state = 0;
    Slot* const victim = oldest(state);
    if (victim != nullptr &&
        victim->state.compare_exchange_strong(state, static_cast<std::uint32_t>(Use::kWriting),
                                              std::memory_order_acq_rel)) {
      slot = victim;
      result = HandedOver::kReplacedOldest;
    } else {
      slot = find_free();
    }
  }
  if (slot == nullptr) return HandedOver::kFull;
  slot->state.store(static_cast<std::uint32_t>(Use::kWriting), std::memory_order_relaxed);
  copy(keyframe, *slot);
  order_ += 1U << kUseBits;
  slot->state.store(order_ | static_cast<std::uint32_t>(Use::kReadable), std::memory_order_release);
  return result;
}

const KeyframeContent* KeyframeQueue::front() noexcept {
  while (reading_ == nullptr) {
    std::uint32_t state = 0;
    Slot* const slot = oldest(state);
    if (slot == nullptr) return nullptr;
    // An older keyframe may have come into a slot that was looked at already, before this one came
    // here. It was put in before, so a second look finds it.
    std::uint32_t again = 0;
    if (oldest(again) != slot || again != state) continue;
    // In vain where the writer has just dropped it.
    if (slot->state.compare_exchange_strong(state, static_cast<std::uint32_t>(Use::kReading),
                                            std::memory_order_acq_rel)) {
      reading_ = slot;
    }
  }
  return &reading_->content;
}

void KeyframeQueue::pop() noexcept {
  if (reading_ == nullptr) return;
  reading_->state.store(static_cast<std::uint32_t>(Use::kFree), std::memory_order_release);
  reading_ = nullptr;
}

}  // namespace unimapper::wire
