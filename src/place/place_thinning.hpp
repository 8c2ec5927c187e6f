// Eviction policy of a full place database: spatial thinning.
#pragma once

#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::place {

/// Keeps where places were recorded and finds the most redundant one: the older of the two that are
/// nearest to each other. Evicting that one thins what is dense (a robot that waits, a street
/// driven daily) and keeps what was recorded once, however long ago.
///
/// Near means position and heading: `distance^2 = metres^2 + (4 m x |difference of unit
/// headings|)^2`, because two LiDARs that look in opposite directions may have little in common.
/// Only places of one session are compared: two sessions have no common frame.
class PlaceThinning {
 public:
  void allocate(Arena& arena, std::uint32_t capacity) noexcept;

  /// Enters the place in `slot`. O(slots).
  void add(std::uint32_t slot, std::uint32_t session, const Pose& T_session_place) noexcept;

  /// Removes the place in `slot`. O(slots) for each place it was the nearest of, at most `kUpdates`
  /// of them; the others are updated in later calls.
  void remove(std::uint32_t slot) noexcept;

  /// The slot of the most redundant place. At least one must be in use. O(slots).
  [[nodiscard]] std::uint32_t most_redundant() const noexcept;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::uint32_t kUpdates = 8;

  struct Slot {
    float position[3];
    float heading[2];  // scaled to metres
    std::uint32_t session;
    std::uint32_t nearest;  // slot of the nearest other place, kNone if there is none
    float nearest_squared;  // lower bound while `stale`
    std::uint64_t age;      // grows with every place added
    bool in_use;
    bool stale;  // its nearest was removed
  };

  [[nodiscard]] static float squared_distance(const Slot& a, const Slot& b) noexcept;
  void find_nearest(std::uint32_t slot) noexcept;
  void update_stale() noexcept;

  Slot* slots_ = nullptr;
  std::uint32_t count_ = 0;  // slots ever used
  std::uint32_t stale_ = 0;
  std::uint64_t added_ = 0;
};

}  // namespace unimapper::place
