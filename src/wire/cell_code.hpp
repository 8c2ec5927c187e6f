// Context coding of sorted cells: occupancy of blocks as octrees, then where in the cells
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>

#include "cell_key.hpp"
#include "range_coder.hpp"

namespace unimapper::wire {

/// Which of the nodes of one level of a block's octree are occupied, with a border of empty ones.
/// Nodes are counted from 1.
class LevelMap {
 public:
  static constexpr std::size_t kSide = kBlockCells + 2;  ///< of rows, along y

  void set(int x, int y, int z) noexcept {
    rows_[index(x, y)] |= std::uint64_t{1} << bit(z);
    filled_[static_cast<std::size_t>(x)] |= std::uint64_t{1} << bit(y);
    planes_ |= std::uint64_t{1} << bit(x);
  }
  /// Adds the eight nodes from (x, y, z) on, one bit each.
  void set_eight(int x, int y, int z, unsigned nodes) noexcept {
    const std::size_t first = index(x, y);
    rows_[first] |= std::uint64_t{nodes & 3U} << bit(z);
    rows_[first + 1] |= std::uint64_t{nodes >> 2U & 3U} << bit(z);
    rows_[first + kSide] |= std::uint64_t{nodes >> 4U & 3U} << bit(z);
    rows_[first + kSide + 1] |= std::uint64_t{nodes >> 6U & 3U} << bit(z);
    constexpr std::array<std::uint8_t, 16> kRows{0, 1, 1, 1, 2, 3, 3, 3, 2, 3, 3, 3, 2, 3, 3, 3};
    filled_[static_cast<std::size_t>(x)] |= std::uint64_t{kRows[nodes & 15U]} << bit(y);
    filled_[static_cast<std::size_t>(x) + 1] |= std::uint64_t{kRows[nodes >> 4U & 15U]} << bit(y);
    planes_ |= std::uint64_t{3} << bit(x);
  }
  /// The nodes of a row along z.
  [[nodiscard]] std::uint64_t row(int x, int y) const noexcept { return rows_[index(x, y)]; }
  /// That row and all behind it.
  [[nodiscard]] const std::uint64_t* rows_from(int x, int y) const noexcept {
    return &rows_[index(x, y)];
  }
  /// Calls `visit(x, y)` for the rows with nodes, in order, until it returns false.
  template <typename Visit>
  bool visit_rows(const Visit& visit) const noexcept {
    for (std::uint64_t planes = planes_; planes != 0; planes &= planes - 1) {
      const int x = std::countr_zero(planes);
      for (std::uint64_t left = filled_[static_cast<std::size_t>(x)]; left != 0; left &= left - 1) {
        if (!visit(x, std::countr_zero(left))) return false;
      }
    }
    return true;
  }
  void clear() noexcept {
    for (; planes_ != 0; planes_ &= planes_ - 1) {
      const int x = std::countr_zero(planes_);
      std::uint64_t& left = filled_[static_cast<std::size_t>(x)];
      for (; left != 0; left &= left - 1) rows_[index(x, std::countr_zero(left))] = 0;
    }
  }

 private:
  static unsigned bit(int node) noexcept { return static_cast<unsigned>(node); }
  static std::size_t index(int x, int y) noexcept {
    return static_cast<std::size_t>(x) * kSide + static_cast<std::size_t>(y);
  }

  std::array<std::uint64_t, kSide * kSide> rows_{};
  std::array<std::uint64_t, kSide> filled_{};  ///< rows with nodes, one bit each, by x
  std::uint64_t planes_ = 0;                   ///< x with such rows, and others, one bit each
};

/// A row of cells along z, one bit each, and what is known of them besides.
struct CellRow {
  std::uint64_t cells = 0;
  std::uint64_t not_ground = 0;
  std::uint64_t above_lower = 0;  ///< means in the middle third of their cell or above
  std::uint64_t upper = 0;        ///< in the upper third

  static constexpr std::size_t kUnknownHeight = 3;

  /// 0: not occupied, 1: ground, 2: not ground.
  [[nodiscard]] std::size_t ground_at(unsigned z) const noexcept {
    return (cells >> z & 1U) + (not_ground >> z & 1U);
  }
  /// Part of a cell in which the surface lies at this height: known where a cell here, below or
  /// above is occupied.
  [[nodiscard]] std::size_t height_at(unsigned z) const noexcept {
    constexpr std::array<std::uint8_t, 8> kBeside{kUnknownHeight, 0, 0, 0, 2, 0, 0, 0};
    const std::size_t third = (above_lower >> z & 1U) + (upper >> z & 1U);
    return kBeside[cells >> (z - 1) & 7U] + third;
  }
  /// Of several means in a cell the last one counts.
  void set(unsigned z, bool is_not_ground, unsigned third) noexcept {
    const std::uint64_t others = ~(std::uint64_t{1} << z);
    not_ground = (not_ground & others) | std::uint64_t{is_not_ground} << z;
    above_lower = (above_lower & others) | std::uint64_t{third > 0} << z;
    upper = (upper & others) | std::uint64_t{third > 1} << z;
  }
};
static_assert(kCellParts == std::array<std::int32_t, 3>{2, 2, 3});

/// What is known beside the eight children of a node, a byte each, where a node among 4 by 4 by 4
/// with the children in their midst is occupied. From the top of a byte: before the child along x,
/// y, z; along x and y; along x, or y, and one below or above; one of the children before it.
constexpr std::uint64_t contexts_after(int x, int y, int z) noexcept {
  const bool is_own_row = x > 0 && y > 0;
  // What lies above the children in their own rows is not coded yet.
  if (is_own_row && z == 3) return 0;
  std::uint64_t contexts = 0;
  for (int child = 0; child < 8; ++child) {
    const int dx = 1 + (child >> 2) - x;
    const int dy = 1 + ((child >> 1) & 1) - y;
    const int dz = 1 + (child & 1) - z;
    const bool is_beside = dz == 1 || dz == -1;
    std::uint64_t context = 0;
    if (dx == 1 && dy == 0) context = dz == 0 ? 64U : (is_beside ? 4U : 0U);
    if (dx == 0 && dy == 1) context = dz == 0 ? 32U : (is_beside ? 2U : 0U);
    if (dx == 0 && dy == 0 && dz == 1) context = 16;
    if (dx == 1 && dy == 1 && dz == 0) context = 8;
    if (is_own_row && z > 0 && 4 * x + 2 * y + z < 7 + child) context |= 1U;
    contexts |= context << static_cast<unsigned>(8 * child);
  }
  return contexts;
}

/// `contexts_after` of a row of four nodes along z, by their bits.
inline constexpr auto kContextsAfter = [] {
  std::array<std::array<std::uint64_t, 16>, 9> after{};
  for (std::size_t i = 0; i < after.size() * 16 * 4; ++i) {
    const auto row = static_cast<int>(i / 64);
    const auto z = static_cast<int>(i % 4);
    const std::size_t nodes = i / 4 % 16;
    if ((nodes >> (i % 4) & 1U) != 0) after[i / 64][nodes] |= contexts_after(row / 3, row % 3, z);
  }
  return after;
}();

/// The probabilities of a list of cells and the block that is being coded. Encoder and decoder run
/// the same code on it (`Coder`: `RangeEncoder` or `RangeDecoder`), so they expect the same.
class CellCode {
 public:
  static constexpr int kLevels = 5;  ///< 32 cells an axis

  /// Forgets everything: before each list.
  void reset() noexcept {
    clear_block();
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
      maps_[level].visit_rows([&](int x, int y) {
        for (std::uint64_t left = maps_[level].row(x, y); left != 0; left &= left - 1) {
          const int z = std::countr_zero(left);
          if (level + 1 == kLevels) {
            code_children<true>(coder, level, x, y, z);
          } else {
            code_children<false>(coder, level, x, y, z);
          }
        }
        return true;
      });
    }
  }

  /// Calls `visit(index in block)` for the occupied cells of the block, in order, until it returns
  /// false.
  template <typename Visit>
  bool visit_cells(const Visit& visit) noexcept {
    return maps_[kLevels].visit_rows([&](int x, int y) {
      x_before_ = row_at(x - 1, y);
      y_before_ = row_at(x, y - 1);
      own_ = &row_memory(x, y);
      *own_ = {maps_[kLevels].row(x, y)};
      for (std::uint64_t left = own_->cells; left != 0; left &= left - 1) {
        if (!visit(((x - 1) * kBlockCells + y - 1) * kBlockCells + std::countr_zero(left) - 1))
          return false;
      }
      return true;
    });
  }

  /// Whether one more mean lies in the cell.
  template <typename Coder>
  bool code_more(Coder& coder, bool more) noexcept {
    return coder.code(more, more_);
  }

  /// Codes the part of a key that tells where in the cell that is visited its mean lies, and
  /// returns it.
  template <typename Coder>
  CellKey code_detail(Coder& coder, int index, CellKey key) noexcept {
    const unsigned z = static_cast<unsigned>(index & 31) + 1;
    const std::size_t ground =
        9 * x_before_.ground_at(z) + 3 * y_before_.ground_at(z) + own_->ground_at(z - 1);
    const bool not_ground = coder.code((key >> 4U & 1U) != 0, ground_[ground]);
    const bool high_x = coder.code((key >> 3U & 1U) != 0);
    const bool high_y = coder.code((key >> 2U & 1U) != 0);
    auto& height = height_[x_before_.height_at(z)][y_before_.height_at(z)];
    unsigned third = coder.code((key & 3U) > 0, height[0]) ? 1 : 0;
    if (third > 0 && coder.code((key & 3U) > 1, height[1])) third = 2;
    own_->set(z, not_ground, third);
    return (not_ground ? 16U : 0U) | (high_x ? 8U : 0U) | (high_y ? 4U : 0U) | third;
  }

  /// Makes room for the next block.
  void clear_block() noexcept {
    for (LevelMap& map : maps_) map.clear();
  }

 private:
  static constexpr std::uint32_t kMostGapBits = 24;

  template <bool kFinest, typename Coder>
  void code_children(Coder& coder, std::size_t level, int x, int y, int z) noexcept {
    const LevelMap& parents = maps_[level];
    LevelMap& children = maps_[level + 1];
    const auto at = static_cast<unsigned>(z);
    // Behind the parent nothing is known in more detail.
    const std::size_t behind = (parents.row(x + 1, y) >> at & 1U) << 2U |
                               (parents.row(x, y + 1) >> at & 1U) << 1U |
                               (parents.row(x, y) >> (at + 1) & 1U);
    std::uint64_t contexts = 0;
    unsigned nodes = 0;
    const std::uint64_t* const rows = children.rows_from(2 * x - 2, 2 * y - 2);
    for (unsigned dx = 0; dx < 3; ++dx) {
      for (unsigned dy = 0; dy < 3; ++dy) {
        const std::uint64_t row = rows[LevelMap::kSide * dx + dy] >> (2 * at - 2);
        contexts |= kContextsAfter[3 * dx + dy][row & 15U];
        if (dx > 0 && dy > 0) nodes |= (row >> 1U & 3U) << (4 * dx + 2 * dy - 6);
      }
    }
    unsigned occupied = 0;
    const auto code_child = [&](unsigned child) {
      const std::size_t beside = contexts >> (8 * child) & 127U;
      const std::size_t context = child * 8 + behind;
      bool bit = (nodes >> child & 1U) != 0;
      if (child == 7 && occupied == 0) {
        // An occupied node has an occupied child.
        bit = true;
      } else if constexpr (kFinest) {
        bit = coder.code(bit, finest_[context * 128 + beside]);
      } else {
        bit = coder.code(
            bit, coarse_[level][(context * 8 + (beside >> 4U)) * 3 + std::min(occupied, 2U)]);
      }
      if (!bit) return;
      ++occupied;
      nodes |= 1U << child;
      contexts |= kContextsAfter[4 + 3 * (child >> 2U) + (child >> 1U & 1U)][2U << (child & 1U)];
    };
    [&]<unsigned... child>(std::integer_sequence<unsigned, child...>) { (code_child(child), ...); }
    (std::make_integer_sequence<unsigned, 8>{});
    children.set_eight(2 * x - 1, 2 * y - 1, 2 * z - 1, nodes);
  }

  /// Only the plane of cells before a cell is looked at.
  CellRow& row_memory(int x, int y) noexcept {
    return rows_[static_cast<std::size_t>(x & 1)][static_cast<std::size_t>(y)];
  }
  CellRow row_at(int x, int y) noexcept {
    return maps_[kLevels].row(x, y) != 0 ? row_memory(x, y) : CellRow{};
  }

  std::array<LevelMap, kLevels + 1> maps_;
  std::array<std::array<CellRow, kBlockCells + 1>, 2> rows_;
  // Of the row that is visited: those before it, and it.
  CellRow x_before_;
  CellRow y_before_;
  CellRow* own_ = nullptr;
  std::array<BitModel, kMostGapBits> gap_;
  std::array<std::array<BitModel, std::size_t{512} * 3>, kLevels - 1> coarse_;
  std::array<BitModel, std::size_t{64} * 128> finest_;
  BitModel more_;
  std::array<BitModel, 27> ground_;
  std::array<std::array<std::array<BitModel, 2>, CellRow::kUnknownHeight + 1>,
             CellRow::kUnknownHeight + 1>
      height_;
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
