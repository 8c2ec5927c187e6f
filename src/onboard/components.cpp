#include "components.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "block_bits.hpp"

namespace unimapper::onboard {
namespace {

/// The 26 neighbours, upper ones first. The first half meets every touching pair once.
constexpr std::array<BlockOffset, 26> kOffsets{
    {{0, 0, 1},   {1, 0, 1},   {-1, 0, 1},  {0, 1, 1},   {0, -1, 1},  {1, 1, 1},   {-1, 1, 1},
     {1, -1, 1},  {-1, -1, 1}, {1, 0, 0},   {0, 1, 0},   {1, 1, 0},   {-1, 1, 0},  {-1, 0, 0},
     {0, -1, 0},  {-1, -1, 0}, {1, -1, 0},  {0, 0, -1},  {1, 0, -1},  {-1, 0, -1}, {0, 1, -1},
     {0, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}};

std::uint64_t lowest_bit(std::uint64_t word) noexcept { return word & (~word + 1); }

}  // namespace

void Components::attach(Arena& arena, const PipelineConfig& config) noexcept {
  config_ = config.removal;
  masks_ = arena.allocate<BlockMasks>(config.voxel.max_blocks());
  max_parts_ = config.voxel.max_blocks() * 2;
  parts_ = arena.allocate<Part>(max_parts_);
  tally_ = arena.allocate<Tally>(max_parts_);
  part_of_low_ = arena.allocate<std::uint32_t>(config.voxel.max_cells);
}

std::uint32_t Components::run(const BlockWindow& window, CellTable& cells) noexcept {
  collect_masks(cells);
  split_into_parts();
  join_parts(window);
  attach_low_cells(window, cells);
  const std::uint32_t components = count(window, cells);
  settle(cells);
  return components;
}

void Components::collect_masks(const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  block_count_ = static_cast<std::uint32_t>(blocks.size());
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    BlockMasks masks{};
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      const std::uint8_t flags = cells.flags(row);
      if ((flags & kCellCandidate) == 0) continue;
      const std::uint64_t bit = lowest_bit(left);
      ((flags & kCellLow) != 0 ? masks.low : masks.connecting) |= bit;
      if ((flags & kCellDynamic) != 0) masks.dynamic |= bit;
      if ((flags & kCellFirm) != 0) masks.firm |= bit;
    }
    masks_[b] = masks;
  }
}

void Components::split_into_parts() noexcept {
  part_count_ = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    BlockMasks& masks = masks_[b];
    masks.first_part = part_count_;
    for (std::uint64_t left = masks.connecting; left != 0;) {
      // Every later block needs room for a part; where it grows short, what is left of a block
      // stands together.
      const bool is_short = part_count_ + (block_count_ - b) >= max_parts_;
      const std::uint64_t part = is_short ? left : flooded(lowest_bit(left), masks.connecting);
      left &= ~part;
      tally_[part_count_] = {};
      parts_[part_count_] = {part, part_count_};
      ++part_count_;
    }
    masks.parts = part_count_ - masks.first_part;
  }
}

void Components::join_parts(const BlockWindow& blocks) noexcept {
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    for (std::uint32_t p = 0; p < masks_[b].parts; ++p) {
      const std::uint32_t part = masks_[b].first_part + p;
      for (std::size_t i = 0; i < kOffsets.size() / 2; ++i) {
        const BlockOffset& offset = kOffsets[i];
        const std::uint64_t touched =
            touched_in_neighbour(parts_[part].cells, offset.x, offset.y, offset.z);
        if (touched == 0) continue;
        const std::uint32_t other = blocks.neighbour(b, offset);
        if (other == BlockWindow::kNone) continue;
        for (std::uint32_t q = 0; q < masks_[other].parts; ++q) {
          const std::uint32_t neighbour = masks_[other].first_part + q;
          if ((parts_[neighbour].cells & touched) != 0) join(part, neighbour);
        }
      }
    }
  }
}

std::uint32_t Components::part_with(std::uint32_t block, std::uint64_t cells) const noexcept {
  for (std::uint32_t p = 0; p < masks_[block].parts; ++p) {
    const std::uint32_t part = masks_[block].first_part + p;
    if ((parts_[part].cells & cells) != 0) return part;
  }
  return kNoPart;
}

void Components::attach_low_cells(const BlockWindow& window, const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    for (std::uint64_t left = masks_[b].low; left != 0; left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      std::uint32_t part = part_with(b, dilated(cell));
      for (std::size_t i = 0; i < kOffsets.size() && part == kNoPart; ++i) {
        const BlockOffset& offset = kOffsets[i];
        const std::uint64_t touched = touched_in_neighbour(cell, offset.x, offset.y, offset.z);
        if (touched == 0) continue;
        const std::uint32_t other = window.neighbour(b, offset);
        if (other != BlockWindow::kNone) part = part_with(other, touched);
      }
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
      part_of_low_[row_of(blocks[b], bit)] = part;
    }
  }
}

std::uint32_t Components::count(const BlockWindow& window, const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  std::uint32_t components = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    const BlockMasks& masks = masks_[b];
    if ((masks.connecting | masks.low) == 0) continue;
    const BlockHistory before = window.before(b);
    for (std::uint32_t p = 0; p < masks.parts; ++p) {
      const std::uint32_t part = masks.first_part + p;
      const std::uint32_t top = root(part);
      components += top == part ? 1U : 0U;
      count_part(tally_[top], parts_[part].cells, masks, before);
    }
    for (std::uint64_t left = masks.low; left != 0; left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
      const std::uint32_t part = part_of_low_[row_of(blocks[b], bit)];
      if (part != kNoPart) count_part(tally_[root(part)], cell, masks, before);
    }
  }
  return components;
}

void Components::count_part(Tally& tally, std::uint64_t cells, const BlockMasks& masks,
                            const BlockHistory& before) const noexcept {
  tally.cells += count_bits(cells);
  tally.dynamic += count_bits(cells & masks.dynamic);
  tally.was_dynamic += count_bits(cells & before.proven);
  tally.was_static += count_bits(cells & before.occupied & ~before.dynamic);
}

bool Components::persists(const Tally& tally) const noexcept {
  return config_.persistence_share > 0.0F && tally.was_dynamic > 0 &&
         static_cast<float>(tally.was_dynamic) >=
             config_.persistence_share * static_cast<float>(tally.cells) &&
         tally.was_dynamic >= 2 * tally.was_static;
}

void Components::settle(CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  const auto settle_cell = [&](std::uint32_t row, std::uint32_t part) {
    const Tally& tally = tally_[root(part)];
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
  };
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    for (std::uint32_t p = 0; p < masks_[b].parts; ++p) {
      const std::uint32_t part = masks_[b].first_part + p;
      for (std::uint64_t left = parts_[part].cells; left != 0; left &= left - 1) {
        settle_cell(row_of(blocks[b], static_cast<std::uint32_t>(std::countr_zero(left))), part);
      }
    }
    // A low cell that touches no obstacle stands for itself.
    for (std::uint64_t left = masks_[b].low; left != 0; left &= left - 1) {
      const std::uint32_t row =
          row_of(blocks[b], static_cast<std::uint32_t>(std::countr_zero(left)));
      if (part_of_low_[row] != kNoPart) settle_cell(row, part_of_low_[row]);
    }
  }
}

std::uint32_t Components::root(std::uint32_t part) noexcept {
  std::uint32_t top = part;
  while (parts_[top].parent != top) top = parts_[top].parent;
  while (parts_[part].parent != top) {
    const std::uint32_t next = parts_[part].parent;
    parts_[part].parent = top;
    part = next;
  }
  return top;
}

void Components::join(std::uint32_t a, std::uint32_t b) noexcept {
  a = root(a);
  b = root(b);
  // The smaller number becomes the root, so the result does not depend on the order of joins.
  parts_[std::max(a, b)].parent = std::min(a, b);
}

}  // namespace unimapper::onboard
