// Terrain interface: height and normal of the ground under actors.
#pragma once

#include "geometry.hpp"

namespace unimapper::simulator {

class Terrain {
 public:
  virtual ~Terrain() = default;
  /// Height of the surface that vehicles drive on.
  [[nodiscard]] virtual double height(Vec2 at) const = 0;
  /// Height of the surface that persons walk on, kerbs included.
  [[nodiscard]] virtual double walking_height(Vec2 at) const = 0;
  /// Upward normal of the slope.
  [[nodiscard]] virtual Vec3 up(Vec2 at) const = 0;

 protected:
  Terrain() = default;
  Terrain(const Terrain&) = default;
  Terrain& operator=(const Terrain&) = default;
};

}  // namespace unimapper::simulator
