#include "components.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace unimapper::onboard {
namespace {

constexpr std::uint32_t kNone = FixedHashMap<Block>::kNotFound;

/// The 26 neighbours, upper ones first. The first half meets every touching pair once.
constexpr std::array<Components::Step, 26> kSteps{
    {{0, 0, 1},   {1, 0, 1},   {-1, 0, 1},  {0, 1, 1},   {0, -1, 1},  {1, 1, 1},   {-1, 1, 1},
     {1, -1, 1},  {-1, -1, 1}, {1, 0, 0},   {0, 1, 0},   {1, 1, 0},   {-1, 1, 0},  {-1, 0, 0},
     {0, -1, 0},  {-1, -1, 0}, {1, -1, 0},  {0, 0, -1},  {1, 0, -1},  {-1, 0, -1}, {0, 1, -1},
     {0, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}};

}  // namespace

/// The blocks around one block, looked up when first asked for.
class Components::Surroundings {
 public:
  Surroundings(const FixedHashMap<Block>& blocks, std::uint32_t center) noexcept
      : blocks_(blocks), index_(unpack(blocks.key(center))) {
    entries_.fill(kUnasked);
    entries_[13] = center;
  }

  /// Entry of the block at an offset of -1, 0 or 1 per axis.
  std::uint32_t at(std::int32_t x, std::int32_t y, std::int32_t z) noexcept {
    std::uint32_t& entry = entries_[static_cast<std::size_t>((x + 1) + 3 * (y + 1) + 9 * (z + 1))];
    if (entry == kUnasked) {
      entry = blocks_.find(pack({index_.x + x, index_.y + y, index_.z + z}));
    }
    return entry;
  }

 private:
  static constexpr std::uint32_t kUnasked = kNone - 1;
  const FixedHashMap<Block>& blocks_;
  VoxelIndex index_;
  std::array<std::uint32_t, 27> entries_;
};

void Components::attach(Arena& arena, const PipelineConfig& config) noexcept {
  config_ = config.removal;
  parent_ = arena.allocate<std::uint32_t>(config.voxel.max_cells);
  connecting_ = arena.allocate<std::uint64_t>(config.voxel.max_cells);
  low_ = arena.allocate<std::uint64_t>(config.voxel.max_cells);
  tally_ = arena.allocate<Tally>(config.voxel.max_cells);
}

std::uint32_t Components::run(const EvidenceWindow& window, CellTable& cells) noexcept {
  mark_candidates(cells);
  join_neighbours(cells);
  attach_low_cells(cells);
  const std::uint32_t components = count(window, cells);
  settle(cells);
  return components;
}

void Components::mark_candidates(const CellTable& cells) noexcept {
  const FixedHashMap<Block>& blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    connecting_[b] = 0;
    low_[b] = 0;
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      if ((cells.flags(row) & kCellCandidate) == 0) continue;
      const bool low = (cells.flags(row) & kCellLow) != 0;
      (low ? low_ : connecting_)[b] |= left & (~left + 1);
      parent_[row] = row;
      tally_[row] = {};
    }
  }
}

void Components::join_neighbours(const CellTable& cells) noexcept {
  const FixedHashMap<Block>& blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    if (connecting_[b] == 0) continue;
    Surroundings surroundings(blocks, b);
    for (std::uint64_t left = connecting_[b]; left != 0; left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint32_t row = row_of(blocks[b], bit);
      for (std::size_t i = 0; i < kSteps.size() / 2; ++i) {
        const std::uint32_t other = connecting_neighbour(surroundings, blocks, bit, kSteps[i]);
        if (other != CellTable::kNoRow) join(row, other);
      }
    }
  }
}

void Components::attach_low_cells(const CellTable& cells) noexcept {
  const FixedHashMap<Block>& blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    if (low_[b] == 0) continue;
    Surroundings surroundings(blocks, b);
    for (std::uint64_t left = low_[b]; left != 0; left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      for (const Step& step : kSteps) {
        const std::uint32_t other = connecting_neighbour(surroundings, blocks, bit, step);
        if (other == CellTable::kNoRow) continue;
        parent_[row_of(blocks[b], bit)] = root(other);
        break;
      }
    }
  }
}

std::uint32_t Components::connecting_neighbour(Surroundings& surroundings,
                                               const FixedHashMap<Block>& blocks, std::uint32_t bit,
                                               const Step& step) const noexcept {
  const VoxelIndex neighbour{static_cast<std::int32_t>(bit & 3U) + step.x,
                             static_cast<std::int32_t>(bit >> 2U & 3U) + step.y,
                             static_cast<std::int32_t>(bit >> 4U) + step.z};
  const VoxelIndex offset = block_of(neighbour);
  const std::uint32_t other = surroundings.at(offset.x, offset.y, offset.z);
  const std::uint32_t other_bit = bit_of(neighbour);
  if (other == kNone || (connecting_[other] >> other_bit & 1U) == 0) return CellTable::kNoRow;
  return row_of(blocks[other], other_bit);
}

std::uint32_t Components::count(const EvidenceWindow& window, const CellTable& cells) noexcept {
  const bool has_before = window.earlier_count() > 0;
  const KeyframeEvidence& before = window.earlier(1);
  const GridShift shift = shift_between(cells.grid(), before.grid);
  VoxelKey last_key = ~VoxelKey{0};
  BlockHistory history{};
  std::uint32_t components = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if ((cells.flags(row) & kCellCandidate) == 0) continue;
    const std::uint32_t top = root(row);
    Tally& tally = tally_[top];
    components += top == row ? 1U : 0U;
    ++tally.cells;
    tally.dynamic += (cells.flags(row) & kCellDynamic) != 0 ? 1U : 0U;
    if (!has_before || !shift.representable) continue;
    const VoxelIndex& cell = cells.index(row);
    const VoxelIndex then{cell.x + shift.cells.x, cell.y + shift.cells.y, cell.z + shift.cells.z};
    const VoxelKey key = pack(block_of(then));
    if (key != last_key) {
      last_key = key;
      const std::uint32_t entry = before.blocks.find(key);
      history = entry == kNone ? BlockHistory{} : before.blocks[entry];
    }
    const std::uint64_t bit = std::uint64_t{1} << bit_of(then);
    tally.was_dynamic += (history.proven & bit) != 0 ? 1U : 0U;
    tally.was_static += (history.occupied & ~history.dynamic & bit) != 0 ? 1U : 0U;
  }
  return components;
}

bool Components::persists(const Tally& tally) const noexcept {
  return config_.persistence_share > 0.0F && tally.was_dynamic > 0 &&
         static_cast<float>(tally.was_dynamic) >=
             config_.persistence_share * static_cast<float>(tally.cells) &&
         tally.was_dynamic >= 2 * tally.was_static;
}

void Components::settle(CellTable& cells) const noexcept {
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if ((cells.flags(row) & kCellCandidate) == 0) continue;
    // After `count` every parent is a root.
    const Tally& tally = tally_[parent_[row]];
    const float share = static_cast<float>(tally.dynamic) / static_cast<float>(tally.cells);
    const bool firm = (cells.flags(row) & kCellFirm) != 0;
    if (persists(tally)) {
      cells.set_flag(row, kCellDynamic);
      cells.set_flag(row, kCellProven);
    } else if (share >= config_.component_dynamic_share && !firm) {
      cells.set_flag(row, kCellDynamic);
    } else if (share < config_.component_static_share) {
      cells.clear_flag(row, kCellDynamic);
    }
  }
}

std::uint32_t Components::root(std::uint32_t row) noexcept {
  std::uint32_t top = row;
  while (parent_[top] != top) top = parent_[top];
  while (parent_[row] != top) {
    const std::uint32_t next = parent_[row];
    parent_[row] = top;
    row = next;
  }
  return top;
}

void Components::join(std::uint32_t a, std::uint32_t b) noexcept {
  a = root(a);
  b = root(b);
  // The smaller row becomes the root, so the result does not depend on the order of joins.
  if (a < b) {
    parent_[b] = a;
  } else {
    parent_[a] = b;
  }
}

}  // namespace unimapper::onboard
