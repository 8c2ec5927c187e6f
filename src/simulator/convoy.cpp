#include "convoy.hpp"

namespace unimapper::simulator {

double Convoy::travelled(int vehicle, double time_s) const {
  if (vehicle == 0) return robot_.travelled(time_s);
  const double breathing = 0.5 * std::sin(0.21 * time_s + phase_ * vehicle);
  const double gap = gap_s_[static_cast<std::size_t>(vehicle)] + breathing;
  return robot_.travelled(time_s + gap) + gap_m_[static_cast<std::size_t>(vehicle)];
}

Vec2 Convoy::position(int vehicle, double time_s) const {
  return path().at(travelled(vehicle, time_s));
}

Vec2 Convoy::heading(int vehicle, double time_s) const {
  return path().heading(travelled(vehicle, time_s));
}

bool Convoy::passes(Vec2 p, double radius, double from_s, double to_s) const {
  constexpr double kStep = 0.5;
  for (double t = from_s; t <= to_s; t += kStep) {
    for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
      if (norm(position(vehicle, t) - p) < radius) return true;
    }
  }
  return false;
}

bool Convoy::touches(Vec2 p, double radius, double time_s) const {
  constexpr double kHalfLength = 2.7;
  constexpr double kHalfWidth = 1.1;
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    const Vec2 offset = p - position(vehicle, time_s);
    if (norm(offset) > kHalfLength + kHalfWidth + radius) continue;
    const Vec2 heading = this->heading(vehicle, time_s);
    if (std::abs(dot(offset, heading)) < kHalfLength + radius &&
        std::abs(cross(offset, heading)) < kHalfWidth + radius) {
      return true;
    }
  }
  return false;
}

}  // namespace unimapper::simulator
