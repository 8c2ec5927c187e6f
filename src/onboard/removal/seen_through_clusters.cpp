#include "seen_through_clusters.hpp"

#include <algorithm>
#include <bit>

#include "src/free_space/block_bits.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::onboard {

void SeenThroughClusters::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  fewest_ = config.removal.cluster_cells;
  lowest_ =
      static_cast<std::int32_t>(RemovalConfig::kClusterHeightM / config.voxel.fine_size_m + 0.5F);
  least_ = in_thousandths(RemovalConfig::kClusterLogOdds);
  against_ = in_thousandths(config.removal.log_odds_weakly_occupied);
  seen_through_ = arena.allocate<std::uint64_t>(fewest_ > 0 ? config.voxel.max_blocks() : 0);
}

void SeenThroughClusters::collect(std::span<const std::int16_t> log_odds, const CellTable& cells,
                                  Slice blocks) noexcept {
  if (fewest_ == 0) return;
  for (std::uint32_t b = blocks.first; b < blocks.end; ++b) {
    const CellMarks& marks = cells.marks(b);
    std::uint64_t strong = 0;
    for (std::uint64_t left = marks.dynamic & marks.candidate & ~marks.follower; left != 0;
         left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      if (log_odds[row_of(cells.blocks()[b], bit)] >= least_) strong |= lowest_bit(left);
    }
    seen_through_[b] = strong;
  }
}

void SeenThroughClusters::mark(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                               ComponentLabels& labels, ComponentTally* tallies,
                               CellTable& cells) const noexcept {
  if (fewest_ == 0) return;
  const std::span<const Block> blocks = cells.blocks();
  labels.label(
      static_cast<std::uint32_t>(blocks.size()),
      [&](std::uint32_t b) noexcept {
        return LabelledCells{seen_through_[b], 0};
      },
      [&](std::uint32_t b, const BlockOffset& offset) noexcept {
        return window.neighbour(b, offset);
      });
  std::fill_n(tallies, labels.size(), ComponentTally{});
  const auto visit_all = [&](const auto& visit) noexcept {
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      if (seen_through_[b] == 0) continue;
      labels.visit(b, [&](std::uint32_t cluster, std::uint64_t some) noexcept {
        visit(b, tallies[cluster], some);
      });
    }
  };
  visit_all([&](std::uint32_t b, ComponentTally& tally, std::uint64_t some) noexcept {
    tally.cells += popcount(some);
    tally.box.include(blocks[b].index, some);
  });
  visit_all([&](std::uint32_t b, const ComponentTally& tally, std::uint64_t some) noexcept {
    if (!is_large(tally)) return;
    cells.marks(b).dynamic |= some;
    mark_around(window, log_odds, b, some, cells);
  });
}

void SeenThroughClusters::mark_around(const BlockWindow& window,
                                      std::span<const std::int16_t> log_odds, std::uint32_t b,
                                      std::uint64_t dynamic, CellTable& cells) const noexcept {
  mark_undecided(log_odds, b, dilated(dynamic), cells);
  for (std::int32_t z = -1; z <= 1; ++z) {
    for (std::int32_t y = -1; y <= 1; ++y) {
      for (std::int32_t x = -1; x <= 1; ++x) {
        if (x == 0 && y == 0 && z == 0) continue;
        const std::uint64_t touched = touched_in_neighbour(dynamic, x, y, z);
        if (touched == 0) continue;
        const std::uint32_t other = window.neighbour(b, {x, y, z});
        if (other != BlockWindow::kNone) mark_undecided(log_odds, other, touched, cells);
      }
    }
  }
}

void SeenThroughClusters::mark_undecided(std::span<const std::int16_t> log_odds, std::uint32_t b,
                                         std::uint64_t touched, CellTable& cells) const noexcept {
  CellMarks& marks = cells.marks(b);
  for (std::uint64_t left = touched & marks.candidate & ~marks.dynamic; left != 0;
       left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    if (log_odds[row_of(cells.blocks()[b], bit)] >= -against_) marks.dynamic |= lowest_bit(left);
  }
}

}  // namespace unimapper::onboard
