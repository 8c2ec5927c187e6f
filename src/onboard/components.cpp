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

/// The cells of a block that touch the neighbour at each of `kOffsets`.
constexpr auto kBorders = [] {
  std::array<std::uint64_t, kOffsets.size()> borders{};
  for (std::size_t i = 0; i < kOffsets.size(); ++i) {
    for (std::uint32_t bit = 0; bit < Block::kCells; ++bit) {
      const std::uint64_t cell = std::uint64_t{1} << bit;
      const auto [x, y, z] = kOffsets[i];
      if (touched_in_neighbour(cell, x, y, z) != 0) borders[i] |= cell;
    }
  }
  return borders;
}();

/// Cells that join what they touch.
std::uint64_t connecting(const CellMarks& marks) noexcept { return marks.candidate & ~marks.low; }

}  // namespace

void Components::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  config_ = config.removal;
  firm_ = static_cast<std::int32_t>(
      std::min(config.removal.confirmed_static_log_odds, 30.0F) * 1000.0F + 0.5F);
  parts_of_ = arena.allocate<Parts>(config.voxel.max_blocks());
  max_parts_ = config.voxel.max_blocks() * 2;
  parts_ = arena.allocate<Part>(max_parts_);
  tally_ = arena.allocate<Tally>(max_parts_);
  part_of_low_ = arena.allocate<std::uint32_t>(config.voxel.max_cells);
}

std::uint32_t Components::run(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                              CellTable& cells) noexcept {
  block_count_ = static_cast<std::uint32_t>(cells.blocks().size());
  split_into_parts(cells);
  join_parts(window, cells);
  attach_low_cells(window, cells);
  const std::uint32_t components = count(window, log_odds, cells);
  settle(cells);
  return components;
}

void Components::split_into_parts(const CellTable& cells) noexcept {
  part_count_ = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    const std::uint32_t first = part_count_;
    const std::uint64_t joining = connecting(cells.marks(b));
    for (std::uint64_t left = joining; left != 0;) {
      // Every later block needs room for a part; where it grows short, what is left of a block
      // stands together.
      const bool is_short = part_count_ + (block_count_ - b) >= max_parts_;
      const std::uint64_t part = is_short ? left : flooded(lowest_bit(left), joining);
      left &= ~part;
      tally_[part_count_] = {};
      parts_[part_count_] = {part, part_count_};
      ++part_count_;
    }
    parts_of_[b] = {first, part_count_ - first};
  }
}

void Components::join_parts(const BlockWindow& window, const CellTable& cells) noexcept {
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    const std::uint64_t joining = connecting(cells.marks(b));
    if (joining == 0) continue;
    for (std::size_t i = 0; i < kOffsets.size() / 2; ++i) {
      if ((joining & kBorders[i]) == 0) continue;
      const std::uint32_t other = window.neighbour(b, kOffsets[i]);
      if (other != BlockWindow::kNone) join_blocks(b, other, i);
    }
  }
}

void Components::join_blocks(std::uint32_t block, std::uint32_t other,
                             std::size_t offset) noexcept {
  const auto [x, y, z] = kOffsets[offset];
  const Parts& mine = parts_of_[block];
  const Parts& others = parts_of_[other];
  if (others.count == 0) return;
  for (std::uint32_t p = mine.first; p < mine.first + mine.count; ++p) {
    if ((parts_[p].cells & kBorders[offset]) == 0) continue;
    const std::uint64_t touched = touched_in_neighbour(parts_[p].cells, x, y, z);
    for (std::uint32_t q = others.first; q < others.first + others.count; ++q) {
      if ((parts_[q].cells & touched) != 0) join(p, q);
    }
  }
}

std::uint32_t Components::part_with(std::uint32_t block, std::uint64_t cells) const noexcept {
  for (std::uint32_t p = 0; p < parts_of_[block].count; ++p) {
    const std::uint32_t part = parts_of_[block].first + p;
    if ((parts_[part].cells & cells) != 0) return part;
  }
  return kNoPart;
}

void Components::attach_low_cells(const BlockWindow& window, const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    for (std::uint64_t left = cells.marks(b).low; left != 0; left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      std::uint32_t part = part_with(b, dilated(cell));
      for (std::size_t i = 0; i < kOffsets.size() && part == kNoPart; ++i) {
        if ((cell & kBorders[i]) == 0) continue;
        const auto [x, y, z] = kOffsets[i];
        const std::uint32_t other = window.neighbour(b, kOffsets[i]);
        if (other != BlockWindow::kNone) {
          part = part_with(other, touched_in_neighbour(cell, x, y, z));
        }
      }
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
      part_of_low_[row_of(blocks[b], bit)] = part;
    }
  }
}

std::uint32_t Components::count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                                const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  std::uint32_t components = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    const CellMarks& marks = cells.marks(b);
    if (marks.candidate == 0) continue;
    const BlockHistory before = window.before(b);
    for (std::uint32_t p = 0; p < parts_of_[b].count; ++p) {
      const std::uint32_t part = parts_of_[b].first + p;
      const std::uint32_t top = root(part);
      components += top == part ? 1U : 0U;
      count_part(tally_[top], parts_[part].cells, blocks[b], log_odds, before);
    }
    for (std::uint64_t left = marks.low; left != 0; left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
      const std::uint32_t part = part_of_low_[row_of(blocks[b], bit)];
      if (part != kNoPart) {
        count_part(tally_[root(part)], cell, blocks[b], log_odds, before);
      }
    }
  }
  return components;
}

void Components::count_part(Tally& tally, std::uint64_t cells, const Block& block,
                            std::span<const std::int16_t> log_odds,
                            const BlockHistory& before) const noexcept {
  tally.cells += popcount(cells);
  for (std::uint64_t left = cells; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::int32_t sum = std::clamp<std::int32_t>(log_odds[row_of(block, bit)], -firm_, firm_);
    tally.evidence += static_cast<std::uint32_t>(sum < 0 ? -sum : sum);
    tally.evidence_dynamic += static_cast<std::uint32_t>(sum < 0 ? 0 : sum);
  }
  tally.was_dynamic += popcount(cells & before.proven);
  tally.was_static += popcount(cells & before.occupied & ~before.dynamic);
}

bool Components::persists(const Tally& tally) const noexcept {
  return config_.persistence_share > 0.0F && tally.was_dynamic > 0 &&
         static_cast<float>(tally.was_dynamic) >=
             config_.persistence_share * static_cast<float>(tally.cells) &&
         tally.was_dynamic >= 2 * tally.was_static;
}

void Components::settle(CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    CellMarks& marks = cells.marks(b);
    for (std::uint32_t p = 0; p < parts_of_[b].count; ++p) {
      const std::uint32_t part = parts_of_[b].first + p;
      settle_cells(parts_[part].cells, part, marks);
    }
    // A low cell that touches no obstacle stands for itself.
    for (std::uint64_t left = marks.low; left != 0; left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
      const std::uint32_t part = part_of_low_[row_of(blocks[b], bit)];
      if (part != kNoPart) settle_cells(cell, part, marks);
    }
  }
}

void Components::settle_cells(std::uint64_t cells, std::uint32_t part, CellMarks& marks) noexcept {
  const Tally& tally = tally_[root(part)];
  const float share = tally.evidence == 0 ? 0.0F
                                          : static_cast<float>(tally.evidence_dynamic) /
                                                static_cast<float>(tally.evidence);
  if (persists(tally)) {
    marks.dynamic |= cells;
    marks.proven |= cells;
  } else if (share >= config_.component_dynamic_share) {
    marks.dynamic |= cells & ~marks.firm;
  } else if (share < config_.component_static_share) {
    marks.dynamic &= ~cells;
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
