// Ground plan of the town: a jittered street grid, warped and laid over hills.
#pragma once

#include <array>
#include <cstdint>

#include "terrain.hpp"

namespace unimapper::simulator {

/// Cross-section of every street, metres from its centre line.
namespace street {
inline constexpr double kLaneCentre = 1.6;
inline constexpr double kCyclePath = 2.75;
inline constexpr double kParkedCar = 4.2;
inline constexpr double kKerb = 5.4;
inline constexpr double kKerbHeight = 0.14;
inline constexpr double kProperty = 8.2;  ///< inner edge of the sidewalk
inline constexpr double kCornerRadius = 4.0;
}  // namespace street

/// Plan coordinates (u, v) are those of the unbent grid, with the town's centre near (0, 0);
/// town coordinates (x, y, z) are what everything else uses.
class TownPlan : public Terrain {
 public:
  static constexpr int kLines = 7;  ///< streets in either direction
  static constexpr int kBlocks = kLines - 1;

  explicit TownPlan(std::uint64_t seed);

  /// Plan coordinate of street `i` that runs along v, or along u.
  [[nodiscard]] double line_u(int i) const { return u_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] double line_v(int i) const { return v_[static_cast<std::size_t>(i)]; }

  [[nodiscard]] Vec2 warp(Vec2 plan) const;
  /// Height of the road surface at a point of the town.
  [[nodiscard]] double height(Vec2 town) const override;
  [[nodiscard]] double walking_height(Vec2 town) const override {
    return height(town) + sidewalk_lift(town);
  }
  /// How far the sidewalk or road stands above `height`: the kerb's height away from the roads,
  /// falling to zero across the kerb.
  [[nodiscard]] double sidewalk_lift(Vec2 town) const;
  /// Upward normal of the hills.
  [[nodiscard]] Vec3 up(Vec2 town) const override;
  /// Point of the road surface above a plan coordinate, raised by `lift`.
  [[nodiscard]] Vec3 ground(Vec2 plan, double lift = 0.0) const;
  /// Level frame at a plan coordinate, x along the bent plan direction `along`.
  [[nodiscard]] Frame level_frame(Vec2 plan, Vec2 along, double lift = 0.0) const;
  /// As level_frame, but tilted with the slope.
  [[nodiscard]] Frame tilted_frame(Vec2 plan, Vec2 along, double lift = 0.0) const;

 private:
  struct Wave {
    double amplitude, kx, ky, phase;
    [[nodiscard]] double at(Vec2 p) const {
      return amplitude * std::sin(kx * p.x + ky * p.y + phase);
    }
  };

  std::array<double, kLines> u_{};
  std::array<double, kLines> v_{};
  std::array<Wave, 2> warp_x_{};
  std::array<Wave, 2> warp_y_{};
  std::array<Wave, 3> hills_{};
};

}  // namespace unimapper::simulator
