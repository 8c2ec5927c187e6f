// Context coding of sorted cells: occupancy of blocks as octrees, then where in the cells
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "cell_key.hpp"
#include "range_coder.hpp"

namespace unimapper::wire {

/// Which of the nodes of one level of a block's octree are occupied, with a border of empty ones.
/// Nodes are counted from 1.
class LevelMap {
 public:
  [[nodiscard]] bool test(int x, int y, int z) const noexcept {
    return ((rows_[index(x, y)] >> static_cast<unsigned>(z)) & 1U) != 0;
  }
  void set(int x, int y, int z) noexcept {
    rows_[index(x, y)] |= std::uint64_t{1} << static_cast<unsigned>(z);
  }
  /// The nodes of a row along z, one bit each.
  [[nodiscard]] std::uint64_t row(int x, int y) const noexcept { return rows_[index(x, y)]; }
  void clear_row(int x, int y) noexcept { rows_[index(x, y)] = 0; }
  void clear() noexcept { rows_.fill(0); }

 private:
  static constexpr int kSide = kBlockCells + 2;
  static std::size_t index(int x, int y) noexcept {
    return static_cast<std::size_t>(x * kSide + y);
  }
  std::array<std::uint64_t, std::size_t{kSide} * kSide> rows_{};
};

/// What is known of a cell besides that it is occupied.
struct CellDetail {
  bool not_ground = false;
  bool high_x = false;  ///< upper half of the cell along x
  bool high_y = false;
  std::uint8_t z = 0;  ///< third of the cell along z, from below

  static CellDetail of(CellKey key) noexcept {
    return {((key >> 4U) & 1U) != 0, ((key >> 3U) & 1U) != 0, ((key >> 2U) & 1U) != 0,
            static_cast<std::uint8_t>(key & 3U)};
  }
  [[nodiscard]] CellKey bits() const noexcept {
    return (not_ground ? 16U : 0U) | (high_x ? 8U : 0U) | (high_y ? 4U : 0U) | z;
  }
};
static_assert(kCellParts == std::array<std::int32_t, 3>{2, 2, 3});

/// The probabilities of a list of cells and the block that is being coded. Encoder and decoder run
/// the same code on it (`Coder`: `RangeEncoder` or `RangeDecoder`), so they expect the same.
class CellCode {
 public:
  static constexpr int kLevels = 5;  ///< 32 cells an axis

  /// Forgets everything: before each list.
  void reset() noexcept {
    for (LevelMap& map : maps_) map.clear();
    gap_.fill({});
    for (auto& level : coarse_) level.fill({});
    finest_.fill({});
    more_ = {};
    ground_.fill({});
    for (auto& row : height_) {
      for (auto& models : row) models.fill({});
    }
  }

  /// A number below 2^25: how many bits it has, and those.
  template <typename Coder>
  std::uint32_t code_gap(Coder& coder, std::uint32_t gap) noexcept {
    const auto bits = static_cast<std::uint32_t>(std::bit_width(gap + 1) - 1);
    std::uint32_t count = 0;
    while (count < kMostGapBits && coder.code(count < bits, gap_[count])) ++count;
    std::uint32_t value = 1;
    for (std::uint32_t i = count; i-- > 0;) {
      value = value << 1U | (coder.code((((gap + 1) >> i) & 1U) != 0) ? 1U : 0U);
    }
    return value - 1;
  }

  /// Marks a cell of the block to be encoded.
  void mark(CellKey key) noexcept {
    const auto index = static_cast<int>(index_in_block(key));
    maps_[kLevels].set((index >> 10) + 1, ((index >> 5) & 31) + 1, (index & 31) + 1);
    for (int level = 0; level < kLevels; ++level) {
      const int shift = kLevels - level;
      maps_[static_cast<std::size_t>(level)].set((index >> (10 + shift)) + 1,
                                                 ((index & 1023) >> (5 + shift)) + 1,
                                                 ((index & 31) >> shift) + 1);
    }
  }

  /// Codes which cells of the block are occupied, level by level. The encoder has marked them.
  template <typename Coder>
  void code_occupancy(Coder& coder) noexcept {
    maps_[0].set(1, 1, 1);
    for (std::size_t level = 0; level < kLevels; ++level) {
      const int side = 1 << level;
      for (int x = 1; x <= side; ++x) {
        for (int y = 1; y <= side; ++y) {
          for (std::uint64_t left = maps_[level].row(x, y); left != 0; left &= left - 1) {
            code_children(coder, level, x, y, std::countr_zero(left));
          }
        }
      }
    }
  }

  /// Calls `visit(index in block)` for the occupied cells of the block, in order, until it returns
  /// false.
  template <typename Visit>
  bool visit_cells(const Visit& visit) const noexcept {
    for (int x = 0; x < kBlockCells; ++x) {
      for (int y = 0; y < kBlockCells; ++y) {
        for (std::uint64_t left = maps_[kLevels].row(x + 1, y + 1); left != 0; left &= left - 1) {
          if (!visit((x * kBlockCells + y) * kBlockCells + std::countr_zero(left) - 1))
            return false;
        }
      }
    }
    return true;
  }

  /// Whether one more mean lies in the cell.
  template <typename Coder>
  bool code_more(Coder& coder, bool more) noexcept {
    return coder.code(more, more_);
  }

  /// Codes what is known of a mean in the cell.
  template <typename Coder>
  CellDetail code_detail(Coder& coder, int index, const CellDetail& detail) noexcept {
    const int x = (index >> 10) + 1;
    const int y = ((index >> 5) & 31) + 1;
    const int z = (index & 31) + 1;
    CellDetail coded;
    const std::size_t ground =
        9 * ground_at(x - 1, y, z) + 3 * ground_at(x, y - 1, z) + ground_at(x, y, z - 1);
    coded.not_ground = coder.code(detail.not_ground, ground_[ground]);
    coded.high_x = coder.code(detail.high_x);
    coded.high_y = coder.code(detail.high_y);
    auto& height = height_[height_at(x - 1, y, z)][height_at(x, y - 1, z)];
    coded.z = coder.code(detail.z > 0, height[0]) ? 1 : 0;
    if (coded.z > 0 && coder.code(detail.z > 1, height[1])) coded.z = 2;
    details_[detail_index(x, y, z)] = coded;
    return coded;
  }

  /// Makes room for the next block.
  void clear_block() noexcept {
    for (std::size_t level = 0; level <= kLevels; ++level) {
      const int side = 1 << level;
      for (int x = 1; x <= side; ++x) {
        for (int y = 1; y <= side; ++y) maps_[level].clear_row(x, y);
      }
    }
  }

 private:
  static constexpr std::uint32_t kMostGapBits = 24;
  static constexpr std::size_t kUnknownHeight = 3;

  template <typename Coder>
  void code_children(Coder& coder, std::size_t level, int x, int y, int z) noexcept {
    const LevelMap& parents = maps_[level];
    LevelMap& children = maps_[level + 1];
    // Behind the parent nothing is known in more detail.
    const std::size_t behind = (parents.test(x + 1, y, z) ? 4U : 0U) |
                               (parents.test(x, y + 1, z) ? 2U : 0U) |
                               (parents.test(x, y, z + 1) ? 1U : 0U);
    std::size_t occupied = 0;
    for (int child = 0; child < 8; ++child) {
      const int cx = 2 * x - 1 + (child >> 2);
      const int cy = 2 * y - 1 + ((child >> 1) & 1);
      const int cz = 2 * z - 1 + (child & 1);
      // An occupied node has an occupied child.
      if (child == 7 && occupied == 0) {
        children.set(cx, cy, cz);
        break;
      }
      const std::size_t before = (children.test(cx - 1, cy, cz) ? 4U : 0U) |
                                 (children.test(cx, cy - 1, cz) ? 2U : 0U) |
                                 (children.test(cx, cy, cz - 1) ? 1U : 0U);
      std::size_t context = (static_cast<std::size_t>(child) * 8 + before) * 8 + behind;
      bool bit = children.test(cx, cy, cz);
      if (level + 1 == kLevels) {
        // Above a child in the upper half lies another parent: coded if it is in another row.
        const auto shift = static_cast<unsigned>(cz - 1);
        const std::uint64_t x_before = std::uint64_t{(child & 5) == 5 ? 1U : 5U} << shift;
        const std::uint64_t y_before = std::uint64_t{(child & 3) == 3 ? 1U : 5U} << shift;
        const std::size_t diagonal = (children.test(cx - 1, cy - 1, cz) ? 4U : 0U) |
                                     ((children.row(cx - 1, cy) & x_before) != 0 ? 2U : 0U) |
                                     ((children.row(cx, cy - 1) & y_before) != 0 ? 1U : 0U);
        context = (context * 8 + diagonal) * 2 + std::min<std::size_t>(occupied, 1);
        bit = coder.code(bit, finest_[context]);
      } else {
        bit = coder.code(bit, coarse_[level][context * 3 + std::min<std::size_t>(occupied, 2)]);
      }
      if (!bit) continue;
      children.set(cx, cy, cz);
      ++occupied;
    }
  }

  /// 0: not occupied, 1: ground, 2: not ground.
  [[nodiscard]] std::size_t ground_at(int x, int y, int z) const noexcept {
    if (!maps_[kLevels].test(x, y, z)) return 0;
    return details_[detail_index(x, y, z)].not_ground ? 2 : 1;
  }
  /// Part of a column in which its surface lies at this height: known where a cell here, below or
  /// above is occupied.
  [[nodiscard]] std::size_t height_at(int x, int y, int z) const noexcept {
    const std::uint64_t column = maps_[kLevels].row(x, y) >> static_cast<unsigned>(z - 1);
    if ((column & 2U) != 0) {
      return static_cast<std::size_t>(details_[detail_index(x, y, z)].z);
    }
    if ((column & 1U) != 0) return 0;
    if ((column & 4U) != 0) return 2;
    return kUnknownHeight;
  }
  /// Only the plane of cells before this one is looked at.
  static std::size_t detail_index(int x, int y, int z) noexcept {
    return static_cast<std::size_t>(((x & 1) * (kBlockCells + 1) + y) * (kBlockCells + 1) + z);
  }

  std::array<LevelMap, kLevels + 1> maps_;
  std::array<CellDetail, std::size_t{2} * (kBlockCells + 1) * (kBlockCells + 1)> details_;
  std::array<BitModel, kMostGapBits> gap_;
  std::array<std::array<BitModel, std::size_t{512} * 3>, kLevels - 1> coarse_;
  std::array<BitModel, std::size_t{512} * 16> finest_;
  BitModel more_;
  std::array<BitModel, 27> ground_;
  std::array<std::array<std::array<BitModel, 2>, kUnknownHeight + 1>, kUnknownHeight + 1> height_;
};

/// Codes the cells that `cells` walks through, block by block; false if it ended early. `Cells` has
/// `bool next_block(Coder&, CellCode&)` and `bool code_cell(Coder&, CellCode&, int index)`.
template <typename Coder, typename Cells>
bool code_cells(Coder& coder, CellCode& code, Cells& cells) noexcept {
  code.reset();
  while (cells.next_block(coder, code)) {
    code.code_occupancy(coder);
    if (!code.visit_cells([&](int index) { return cells.code_cell(coder, code, index); })) {
      return false;
    }
    code.clear_block();
  }
  return true;
}

}  // namespace unimapper::wire
