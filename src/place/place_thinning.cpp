#include "place_thinning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unimapper::place {
namespace {

constexpr float kHeadingScale = 4.0F;
// Of the only place of its session.
constexpr float kFar = std::numeric_limits<float>::max();

}  // namespace

void PlaceThinning::allocate(Arena& arena, std::uint32_t capacity) noexcept {
  slots_ = arena.allocate<Slot>(capacity);
  count_ = 0;
  stale_ = 0;
  added_ = 0;
}

float PlaceThinning::squared_distance(const Slot& a, const Slot& b) noexcept {
  if (a.session != b.session) return kFar;
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    sum += (a.position[i] - b.position[i]) * (a.position[i] - b.position[i]);
  }
  for (int i = 0; i < 2; ++i) sum += (a.heading[i] - b.heading[i]) * (a.heading[i] - b.heading[i]);
  return sum;
}

void PlaceThinning::find_nearest(std::uint32_t slot) noexcept {
  Slot& at = slots_[slot];
  at.nearest = kNone;
  at.nearest_squared = kFar;
  at.stale = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (i == slot || !slots_[i].in_use) continue;
    const float squared = squared_distance(at, slots_[i]);
    if (!(squared < at.nearest_squared)) continue;
    at.nearest = i;
    at.nearest_squared = squared;
  }
}

void PlaceThinning::add(std::uint32_t slot, std::uint32_t session,
                        const Pose& T_session_place) noexcept {
  if (slots_ == nullptr) return;
  count_ = std::max(count_, slot + 1);
  Slot& at = slots_[slot];
  for (int i = 0; i < 3; ++i) at.position[i] = static_cast<float>(T_session_place.translation(i));
  for (int i = 0; i < 2; ++i) {
    at.heading[i] = kHeadingScale * static_cast<float>(T_session_place.rotation(i, 0));
  }
  at.session = session;
  at.age = added_++;
  at.in_use = true;
  find_nearest(slot);
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (i == slot || !slots_[i].in_use) continue;
    const float squared = squared_distance(at, slots_[i]);
    if (!(squared < slots_[i].nearest_squared)) continue;
    stale_ -= slots_[i].stale ? 1 : 0;
    slots_[i].nearest = slot;
    slots_[i].nearest_squared = squared;
    slots_[i].stale = false;
  }
  update_stale();
}

void PlaceThinning::remove(std::uint32_t slot) noexcept {
  if (slots_ == nullptr || !slots_[slot].in_use) return;
  stale_ -= slots_[slot].stale ? 1 : 0;
  slots_[slot].in_use = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!slots_[i].in_use || slots_[i].nearest != slot || slots_[i].stale) continue;
    slots_[i].stale = true;
    ++stale_;
  }
  update_stale();
}

// The places of a robot that stands still may all have had the same nearest: more than can be
// updated in one call.
void PlaceThinning::update_stale() noexcept {
  std::uint32_t updated = 0;
  for (std::uint32_t i = 0; i < count_ && stale_ > 0 && updated < kUpdates; ++i) {
    if (!slots_[i].in_use || !slots_[i].stale) continue;
    find_nearest(i);
    --stale_;
    ++updated;
  }
}

std::uint32_t PlaceThinning::most_redundant() const noexcept {
  std::uint32_t best = 0;
  bool found = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Slot& at = slots_[i];
    if (!at.in_use || at.stale) continue;
    const bool better =
        !found || at.nearest_squared < slots_[best].nearest_squared ||
        (at.nearest_squared == slots_[best].nearest_squared && at.age < slots_[best].age);
    if (!better) continue;
    best = i;
    found = true;
  }
  return best;
}

}  // namespace unimapper::place
