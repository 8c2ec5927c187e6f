// Which place can be spared when a database is full?
#pragma once

#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper {

/// Knows where places were recorded, and which of them another one stands in for best: the older of
/// the two that are nearest to each other. Forgetting that one thins what is dense (a robot that
/// waits, a street driven daily) and keeps what was seen once, however long ago.
///
/// Near means position and heading: `distance^2 = metres^2 + (4 m x |difference of unit
/// headings|)^2`, because two LiDARs that look in opposite directions may have little in common.
/// Only places of one session are compared: two sessions have no common frame.
class PlaceThinning {
 public:
  void allocate(Arena& arena, std::uint32_t capacity) noexcept;

  /// Enters the place in `slot`. O(slots).
  void add(std::uint32_t slot, std::uint32_t session, const Pose& T_session_place) noexcept;

  /// Takes the place in `slot` out. O(slots) for each place it was the nearest of, at most
  /// `kRepairs` of them; the others catch up in later calls.
  void remove(std::uint32_t slot) noexcept;

  /// The slot that can be spared best. At least one must be taken. O(slots).
  [[nodiscard]] std::uint32_t most_redundant() const noexcept;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::uint32_t kRepairs = 8;

  struct Spot {
    float position[3];
    float heading[2];  // scaled to metres
    std::uint32_t session;
    std::uint32_t nearest;  // slot of the nearest other place, kNone if there is none
    float nearest_squared;  // how near; kept too small while `stale`, which does no harm
    std::uint64_t age;      // grows with every place added
    bool taken;
    bool stale;  // its nearest was taken out
  };

  [[nodiscard]] static float squared_distance(const Spot& a, const Spot& b) noexcept;
  void look_for_nearest(std::uint32_t slot) noexcept;
  void repair() noexcept;

  Spot* spots_ = nullptr;
  std::uint32_t count_ = 0;  // slots ever used
  std::uint32_t stale_ = 0;
  std::uint64_t added_ = 0;
};

}  // namespace unimapper
