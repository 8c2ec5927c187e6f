// Test of whether a robot is in a closed cabin, as in a lift
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace unimapper {

/// Counts points by distance and direction on the level. In a cabin they surround the sensor within
/// 3.5 m, but for one in fifty that is seen through a gap of the door. A narrow view cannot tell a
/// cabin from a wall.
class CabinTest {
 public:
  /// Of at most `points` points.
  explicit constexpr CabinTest(std::size_t points) noexcept : most_beyond_(points / kOneBeyondOf) {}

  /// Adds a point in the sensor's frame or a level one about it, metres. False as soon as the
  /// points added are no cabin's, whatever follows. O(1).
  bool add(float x, float y) noexcept {
    constexpr float kCabin_m = 3.5F;
    ++points_;
    if (!(x * x + y * y <= kCabin_m * kCabin_m)) return ++beyond_ <= most_beyond_;
    const unsigned eighth =
        (x > 0.0F ? 1U : 0U) | (y > 0.0F ? 2U : 0U) | (std::fabs(x) > std::fabs(y) ? 4U : 0U);
    ++by_eighth_[eighth];
    return true;
  }

  /// Whether the points added show a cabin: of few nothing is known.
  [[nodiscard]] bool is_shut_in() const noexcept {
    constexpr std::size_t kFewest = 200;
    constexpr std::size_t kOneIn = 100;  // of all points, in each eighth of the circle
    return points_ >= kFewest && beyond_ * kOneBeyondOf <= points_ &&
           std::all_of(by_eighth_.begin(), by_eighth_.end(),
                       [this](std::size_t count) { return count * kOneIn >= points_; });
  }

 private:
  static constexpr std::size_t kOneBeyondOf = 50;

  std::size_t most_beyond_;
  std::size_t points_ = 0;
  std::size_t beyond_ = 0;
  std::array<std::size_t, 8> by_eighth_{};
};

/// Whether a robot that is shut in is in a room, and no cabin, `level_m` away on the level from
/// where it was first shut in: it hardly drives in a lift.
[[nodiscard]] constexpr bool is_in_room(double level_m) noexcept { return level_m > 1.5; }

/// Whether a robot that was shut in for so long may have taken a lift: one storey takes three
/// seconds.
[[nodiscard]] constexpr bool is_ride(double lasts_s) noexcept { return lasts_s >= 3.0; }

/// Whether such a ride may have changed the storey though the odometry rose or sank by `rise_m`
/// only. Rooms and the slab between them are 2.3 m and more: what is less is a part of a ride.
[[nodiscard]] constexpr bool is_unfelt_ride(double lasts_s, double rise_m) noexcept {
  return is_ride(lasts_s) && rise_m < 2.0 && rise_m > -2.0;
}

}  // namespace unimapper
