#include "unimapper/place/place_thinning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unimapper {
namespace {

constexpr float kHeadingScale = 4.0F;
// Of a place that stands alone in its session.
constexpr float kFar = std::numeric_limits<float>::max();

}  // namespace

void PlaceThinning::allocate(Arena& arena, std::uint32_t capacity) noexcept {
  spots_ = arena.allocate<Spot>(capacity);
  count_ = 0;
  stale_ = 0;
  added_ = 0;
}

float PlaceThinning::squared_distance(const Spot& a, const Spot& b) noexcept {
  if (a.session != b.session) return kFar;
  float sum = 0.0F;
  for (int i = 0; i < 3; ++i) {
    sum += (a.position[i] - b.position[i]) * (a.position[i] - b.position[i]);
  }
  for (int i = 0; i < 2; ++i) sum += (a.heading[i] - b.heading[i]) * (a.heading[i] - b.heading[i]);
  return sum;
}

void PlaceThinning::look_for_nearest(std::uint32_t slot) noexcept {
  Spot& spot = spots_[slot];
  spot.nearest = kNone;
  spot.nearest_squared = kFar;
  spot.stale = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (i == slot || !spots_[i].taken) continue;
    const float squared = squared_distance(spot, spots_[i]);
    if (!(squared < spot.nearest_squared)) continue;
    spot.nearest = i;
    spot.nearest_squared = squared;
  }
}

void PlaceThinning::add(std::uint32_t slot, std::uint32_t session,
                        const Pose& T_session_place) noexcept {
  if (spots_ == nullptr) return;
  count_ = std::max(count_, slot + 1);
  Spot& spot = spots_[slot];
  for (int i = 0; i < 3; ++i) spot.position[i] = static_cast<float>(T_session_place.translation(i));
  for (int i = 0; i < 2; ++i) {
    spot.heading[i] = kHeadingScale * static_cast<float>(T_session_place.rotation(i, 0));
  }
  spot.session = session;
  spot.age = added_++;
  spot.taken = true;
  look_for_nearest(slot);
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (i == slot || !spots_[i].taken) continue;
    const float squared = squared_distance(spot, spots_[i]);
    if (!(squared < spots_[i].nearest_squared)) continue;
    stale_ -= spots_[i].stale ? 1 : 0;
    spots_[i].nearest = slot;
    spots_[i].nearest_squared = squared;
    spots_[i].stale = false;
  }
  repair();
}

void PlaceThinning::remove(std::uint32_t slot) noexcept {
  if (spots_ == nullptr || !spots_[slot].taken) return;
  stale_ -= spots_[slot].stale ? 1 : 0;
  spots_[slot].taken = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!spots_[i].taken || spots_[i].nearest != slot || spots_[i].stale) continue;
    spots_[i].stale = true;
    ++stale_;
  }
  repair();
}

// A standing robot's places may all have had the same nearest: more than can be looked at again in
// one go.
void PlaceThinning::repair() noexcept {
  std::uint32_t repaired = 0;
  for (std::uint32_t i = 0; i < count_ && stale_ > 0 && repaired < kRepairs; ++i) {
    if (!spots_[i].taken || !spots_[i].stale) continue;
    look_for_nearest(i);
    --stale_;
    ++repaired;
  }
}

std::uint32_t PlaceThinning::most_redundant() const noexcept {
  std::uint32_t best = 0;
  bool found = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Spot& spot = spots_[i];
    if (!spot.taken || spot.stale) continue;
    const bool better =
        !found || spot.nearest_squared < spots_[best].nearest_squared ||
        (spot.nearest_squared == spots_[best].nearest_squared && spot.age < spots_[best].age);
    if (!better) continue;
    best = i;
    found = true;
  }
  return best;
}

}  // namespace unimapper
