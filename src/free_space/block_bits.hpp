// Morphology of 4 x 4 x 4 cells held in one word, x changing fastest and z slowest
#pragma once

#include <cstdint>

namespace unimapper {

/// Cells moved by one along x, y or z; what leaves the block is lost.
[[nodiscard]] constexpr std::uint64_t shifted_x(std::uint64_t cells, int by) noexcept {
  if (by > 0) return (cells << 1U) & 0xEEEEEEEEEEEEEEEEULL;
  if (by < 0) return (cells >> 1U) & 0x7777777777777777ULL;
  return cells;
}
[[nodiscard]] constexpr std::uint64_t shifted_y(std::uint64_t cells, int by) noexcept {
  if (by > 0) return (cells << 4U) & 0xFFF0FFF0FFF0FFF0ULL;
  if (by < 0) return (cells >> 4U) & 0x0FFF0FFF0FFF0FFFULL;
  return cells;
}
[[nodiscard]] constexpr std::uint64_t shifted_z(std::uint64_t cells, int by) noexcept {
  if (by > 0) return cells << 16U;
  if (by < 0) return cells >> 16U;
  return cells;
}

/// All cells of the layers from number `first` on, 0 or more, along x, y or z.
[[nodiscard]] constexpr std::uint64_t layers_from_x(std::int32_t first) noexcept {
  return first < 4 ? (0xFULL << first & 0xFULL) * 0x1111111111111111ULL : 0;
}
[[nodiscard]] constexpr std::uint64_t layers_from_y(std::int32_t first) noexcept {
  return first < 4 ? (0xFFFFULL << 4 * first & 0xFFFFULL) * 0x0001000100010001ULL : 0;
}
[[nodiscard]] constexpr std::uint64_t layers_from_z(std::int32_t first) noexcept {
  return first < 4 ? ~0ULL << 16 * first : 0;
}

/// The cells and all that touch them within the block, by face, edge or corner.
[[nodiscard]] constexpr std::uint64_t dilated(std::uint64_t cells) noexcept {
  cells |= shifted_x(cells, 1) | shifted_x(cells, -1);
  cells |= shifted_y(cells, 1) | shifted_y(cells, -1);
  cells |= shifted_z(cells, 1) | shifted_z(cells, -1);
  return cells;
}

/// What of `allowed` is connected to `seed`, a subset of it.
[[nodiscard]] constexpr std::uint64_t flooded(std::uint64_t seed, std::uint64_t allowed) noexcept {
  // A path through 64 cells is at most 63 steps long.
  for (int step = 0; step < 64; ++step) {
    const std::uint64_t grown = dilated(seed) & allowed;
    if (grown == seed) break;
    seed = grown;
  }
  return seed;
}

/// Cells of the block beside (further along x and y by -1, 0 or 1 blocks) that touch any of `cells`
/// in the same layer; of the block itself also these.
[[nodiscard]] constexpr std::uint64_t touched_beside(std::uint64_t cells, int x, int y) noexcept {
  // Along each axis: the border layer, brought to the opposite side; or all layers, dilated.
  if (x > 0) {
    cells = (cells & 0x8888888888888888ULL) >> 3U;
  } else if (x < 0) {
    cells = (cells & 0x1111111111111111ULL) << 3U;
  } else {
    cells |= shifted_x(cells, 1) | shifted_x(cells, -1);
  }
  if (y > 0) {
    cells = (cells & 0xF000F000F000F000ULL) >> 12U;
  } else if (y < 0) {
    cells = (cells & 0x000F000F000F000FULL) << 12U;
  } else {
    cells |= shifted_y(cells, 1) | shifted_y(cells, -1);
  }
  return cells;
}

/// Cells of the neighbouring block (one block further along each axis by -1, 0 or 1) that touch
/// any of `cells`.
[[nodiscard]] constexpr std::uint64_t touched_in_neighbour(std::uint64_t cells, int x, int y,
                                                           int z) noexcept {
  cells = touched_beside(cells, x, y);
  if (z > 0) return cells >> 48U;
  if (z < 0) return cells << 48U;
  return cells | shifted_z(cells, 1) | shifted_z(cells, -1);
}

}  // namespace unimapper
