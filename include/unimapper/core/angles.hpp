// Portable trigonometry: the same bits on every platform.
#pragma once

#include <cmath>

namespace unimapper {

/// Sine of an angle in degrees, |angle| <= 180. Error below 1e-11.
[[nodiscard]] constexpr double sin_deg(double degrees) noexcept {
  // Folded to a quarter turn, where the Taylor series to x^15 suffices.
  if (degrees > 90.0) degrees = 180.0 - degrees;
  if (degrees < -90.0) degrees = -180.0 - degrees;
  const double x = degrees * (3.14159265358979323846 / 180.0);
  const double s = x * x;
  double term = x;
  double sum = x;
  for (int n = 1; n <= 8; ++n) {
    term *= -s / static_cast<double>((2 * n) * (2 * n + 1));
    sum += term;
  }
  return sum;
}

/// Cosine of an angle in degrees, |angle| <= 90.
[[nodiscard]] constexpr double cos_deg(double degrees) noexcept { return sin_deg(90.0 - degrees); }

/// Direction of (x, y) in turns, within [-0.5, 0.5], counter-clockwise from x. Error below 1e-6
/// turns; (0, 0) gives 0. Branch-free after inlining, so loops over it vectorise.
[[nodiscard]] inline float direction_turns(float x, float y) noexcept {
  const float ax = std::fabs(x);
  const float ay = std::fabs(y);
  const float longer = ax > ay ? ax : ay;
  const float shorter = ax > ay ? ay : ax;
  // The smallest normal number keeps 0 / 0 away and changes nothing else.
  const float a = shorter / (longer + 1.17549435e-38F);
  const float s = a * a;
  // Least-squares fit of atan(a) / (2 pi) on [0, 1] in odd powers.
  float turns = -0.00187317F;
  turns = turns * s + 0.00840671F;
  turns = turns * s - 0.01856524F;
  turns = turns * s + 0.03082345F;
  turns = turns * s - 0.05294374F;
  turns = turns * s + 0.15915173F;
  turns *= a;
  turns = ay > ax ? 0.25F - turns : turns;
  turns = x < 0.0F ? 0.5F - turns : turns;
  return y < 0.0F ? -turns : turns;
}

}  // namespace unimapper
