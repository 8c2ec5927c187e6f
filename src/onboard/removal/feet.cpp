#include "feet.hpp"

#include <algorithm>
#include <cstddef>
#include <span>

#include "ground.hpp"
#include "src/free_space/block_bits.hpp"
#include "src/free_space/feet.hpp"
#include "unimapper/core/assert.hpp"

namespace unimapper::onboard {
namespace {

/// Cells from a foot's to the farthest that tells the level: across, and up or down.
constexpr std::int32_t kAcross = 2;
constexpr std::int32_t kUpOrDown = 1;
constexpr std::size_t kMostCells = (2 * kAcross + 1) * (2 * kAcross + 1) * (2 * kUpOrDown + 1);
/// With fewer ground cells, half of those that level ground fills, its level is not known.
constexpr std::size_t kFewestCells = 13;

/// Cells of a block within `reach` of cell `center` of another, `offset` blocks before it, along
/// one axis; `layers_from` gives the layers of that axis.
template <typename Layers>
std::uint64_t layers_near(std::int32_t center, std::int32_t reach, std::int32_t offset,
                          const Layers& layers_from) noexcept {
  const std::int32_t middle = center - offset * Block::kEdge;
  const std::int32_t last = middle + reach;
  if (last < 0) return 0;
  return layers_from(std::max(middle - reach, 0)) & ~layers_from(last + 1);
}

}  // namespace

void Feet::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  foot_height_m_ = config.ground.foot_height_m;
  on_ = foot_height_m_ > 0.0F;
  below_ = arena.allocate<std::uint64_t>(on_ ? config.voxel.max_blocks() : 0);
}

void Feet::find(const BlockWindow& window, const CellTable& cells) noexcept {
  if (!on_) return;
  UNIMAPPER_ASSERT(window.numbered() == cells.blocks().size(),
                   "the keyframe must be the window's current one");
  const std::span<const Block> blocks = cells.blocks();
  std::fill_n(below_, blocks.size(), 0);
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    const std::uint64_t dynamic = cells.marks(b).dynamic;
    if (dynamic == 0) continue;
    // In the layer of the dynamic cells and in the two below it.
    mark_around(window, b, dynamic | shifted_z(dynamic, -1) | dynamic >> 32U, 0);
    mark_around(window, b, dynamic << 48U | (dynamic & ~layers_from_z(2)) << 32U, -1);
  }
}

void Feet::mark_around(const BlockWindow& window, std::uint32_t block, std::uint64_t cells,
                       std::int32_t z) noexcept {
  if (cells == 0) return;
  for (std::int32_t y = -1; y <= 1; ++y) {
    for (std::int32_t x = -1; x <= 1; ++x) {
      const std::uint64_t touched = touched_beside(cells, x, y);
      if (touched == 0) continue;
      const std::uint32_t other = window.neighbour(block, {x, y, z});
      if (other != BlockWindow::kNone) below_[other] |= touched;
    }
  }
}

std::uint32_t Feet::level_in_cell(const BlockWindow& window, const CoarseVoxels& voxels,
                                  const CellTable& cells, std::uint32_t row) const noexcept {
  const CoarseVoxel& voxel = voxels.map()[voxels.of_row(row)];
  const std::uint32_t block = cells.block_of_row(row);
  const auto bit = static_cast<std::int32_t>(cells.bit_of_row(row));
  float free[kMostCells];
  float all[kMostCells];
  std::size_t free_count = 0;
  std::size_t count = 0;
  for (std::int32_t z = -1; z <= 1; ++z) {
    const std::uint64_t near_z = layers_near(bit >> 4, kUpOrDown, z, layers_from_z);
    for (std::int32_t y = -1; y <= 1; ++y) {
      const std::uint64_t near_yz = near_z & layers_near(bit >> 2 & 3, kAcross, y, layers_from_y);
      for (std::int32_t x = -1; x <= 1; ++x) {
        const std::uint64_t near = near_yz & layers_near(bit & 3, kAcross, x, layers_from_x);
        if (near == 0) continue;
        const std::uint32_t other = window.neighbour(block, {x, y, z});
        if (other == BlockWindow::kNone) continue;
        const CellMarks& marks = cells.marks(other);
        visit_rows(cells.blocks()[other], near & marks.ground & ~marks.dynamic,
                   [&](std::uint64_t cell, std::uint32_t at) noexcept {
                     const float height_m = height_above_ground(voxel, cells.position(at));
                     all[count++] = height_m;
                     if ((below_[other] & cell) == 0) free[free_count++] = height_m;
                   });
      }
    }
  }
  if (count < kFewestCells) return kAboveCell;
  const float level_m =
      ground_level({free, free_count}, {all, count}, [](std::span<float> heights_m) noexcept {
        return quantile(heights_m, 0.9);  // the upper side of a kerb
      });
  return level_in_cell_above(voxel, level_m + foot_height_m_, cells, row);
}

}  // namespace unimapper::onboard
