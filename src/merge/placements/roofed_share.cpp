// Share of the ground that has structure above it.
#include "roofed_share.hpp"

#include <array>
#include <cmath>
#include <cstdint>

namespace unimapper::merge {

double roofed_share(const KeyframeRecord& keyframe) {
  constexpr float kReachM = 30.0F;
  constexpr float kColumnM = 2.0F;
  constexpr float kAboveSensorM = 0.5F;
  constexpr int kSide = static_cast<int>(2.0F * kReachM / kColumnM);
  enum : std::uint8_t { kGround = 1, kAbove = 2 };
  std::array<std::uint8_t, static_cast<std::size_t>(kSide * kSide)> columns{};
  for (const FineCell& cell : keyframe.static_cells) {
    const auto column = [&](float v) {
      return static_cast<int>(std::floor((v + kReachM) / kColumnM));
    };
    const int x = column(cell.position.x());
    const int y = column(cell.position.y());
    if (x < 0 || y < 0 || x >= kSide || y >= kSide) continue;
    auto& seen = columns[static_cast<std::size_t>(y * kSide + x)];
    if (cell.ground != 0) seen |= kGround;
    if (cell.ground == 0 && cell.position.z() > kAboveSensorM) seen |= kAbove;
  }
  std::size_t ground = 0;
  std::size_t roofed = 0;
  for (const std::uint8_t seen : columns) {
    if ((seen & kGround) == 0) continue;
    ++ground;
    roofed += (seen & kAbove) != 0 ? 1 : 0;
  }
  return ground == 0 ? 0.0 : static_cast<double>(roofed) / static_cast<double>(ground);
}

}  // namespace unimapper::merge
