#include "coarse_voxels.hpp"

#include <algorithm>
#include <bit>

#include "src/core/symmetric_eigen.hpp"
#include "src/free_space/block_bits.hpp"

namespace unimapper::onboard {
namespace {

using Lanes = float __attribute__((vector_size(16)));

// Without integer divisions, which are slow. Exact: an index has at most 21 bits, and the middle of
// a cell lies half a cell from where voxels begin.
VoxelIndex voxel_of(const VoxelIndex& cell, std::int32_t cells_per_voxel) noexcept {
  const float per_cell = 1.0F / static_cast<float>(cells_per_voxel);
  const auto voxel = [per_cell](std::int32_t axis) {
    return floor_of_bounded((static_cast<float>(axis) + 0.5F) * per_cell);
  };
  return {voxel(cell.x), voxel(cell.y), voxel(cell.z)};
}

Eigen::Vector3f corner_of(const VoxelIndex& voxel, float size_m) noexcept {
  return {static_cast<float>(voxel.x) * size_m, static_cast<float>(voxel.y) * size_m,
          static_cast<float>(voxel.z) * size_m};
}

}  // namespace

void CoarseVoxels::allocate(Arena& arena, const VoxelConfig& config) noexcept {
  config_ = config;
  map_.allocate(arena, config.max_voxels);
  of_row_ = arena.allocate<std::uint32_t>(config.max_cells);
}

void CoarseVoxels::begin() noexcept {
  map_.reset();
  left_out_ = 0;
}

void CoarseVoxels::find_planes(const Grid& grid, Slice voxels) noexcept {
  const float size_m = grid.voxel_size_m();
  for (std::uint32_t i = voxels.first; i < voxels.end; ++i) {
    find_plane(map_[i], corner_of(unpack(map_.key(i)), size_m));
  }
}

template <typename Take>
void CoarseVoxels::split_by_voxel(const CellTable& cells, Slice blocks, const Take& take) noexcept {
  const std::int32_t cells_per_voxel = cells.grid().cells_per_voxel;
  for (const Block& block : cells.blocks().subspan(blocks.first, blocks.size())) {
    // The block's first cell decides; the others lie in its voxel or in the next one.
    const VoxelIndex first = cell_in(block.index, 0);
    const VoxelIndex corner = voxel_of(first, cells_per_voxel);
    const std::uint64_t next_x = layers_from_x((corner.x + 1) * cells_per_voxel - first.x);
    const std::uint64_t next_y = layers_from_y((corner.y + 1) * cells_per_voxel - first.y);
    const std::uint64_t next_z = layers_from_z((corner.z + 1) * cells_per_voxel - first.z);
    for (std::uint64_t left = block.occupied; left != 0;) {
      const std::uint64_t cell = lowest_bit(left);
      const bool x = (next_x & cell) != 0;
      const bool y = (next_y & cell) != 0;
      const bool z = (next_z & cell) != 0;
      const std::uint64_t here =
          left & (x ? next_x : ~next_x) & (y ? next_y : ~next_y) & (z ? next_z : ~next_z);
      left &= ~here;
      take(block, here,
           VoxelIndex{corner.x + (x ? 1 : 0), corner.y + (y ? 1 : 0), corner.z + (z ? 1 : 0)});
    }
  }
}

// The order of the blocks numbers the voxels and rounds their sums. Two workers follow each other
// through it: one finds voxels, the other adds up those of the blocks before.
void CoarseVoxels::add(const CellTable& cells, Slice some, const Executor& executor) noexcept {
  RecentVoxels recent;
  if (executor.workers == 1) {
    split_by_voxel(cells, some,
                   [&](const Block& block, std::uint64_t here, const VoxelIndex& index) noexcept {
                     const std::uint32_t entry = find(here, index, recent);
                     add_cells<true>(cells, block, here, entry, index);
                   });
    return;
  }
  constexpr std::uint32_t kLeast = 512;
  const Cut cut(executor, some, std::max(kLeast, some.size() / 16 + 1));
  for (std::uint32_t step = 0; step <= cut.parts(); ++step) {
    for_parts(executor, 2, [&](std::uint32_t part, std::uint32_t) noexcept {
      if (part == 0 && step > 0) add_up(cells, cut[step - 1]);
      if (part == 1 && step < cut.parts()) enter(cells, cut[step], recent);
    });
  }
}

void CoarseVoxels::enter(const CellTable& cells, Slice blocks, RecentVoxels& recent) noexcept {
  split_by_voxel(cells, blocks,
                 [&](const Block& block, std::uint64_t here, const VoxelIndex& index) noexcept {
                   note_cells(block, here, find(here, index, recent));
                 });
}

void CoarseVoxels::add_up(const CellTable& cells, Slice blocks) noexcept {
  split_by_voxel(cells, blocks,
                 [&](const Block& block, std::uint64_t here, const VoxelIndex& index) noexcept {
                   const auto bit = static_cast<std::uint32_t>(std::countr_zero(here));
                   add_cells<false>(cells, block, here, of_row_[row_of(block, bit)], index);
                 });
}

std::uint32_t CoarseVoxels::find(std::uint64_t some, const VoxelIndex& index,
                                 RecentVoxels& recent) noexcept {
  const std::uint32_t entry =
      recent.entry(index, [this](VoxelKey key) { return map_.find_or_insert(key); });
  if (entry == kNone) left_out_ += popcount(some);
  return entry;
}

void CoarseVoxels::note_cells(const Block& block, std::uint64_t some,
                              std::uint32_t entry) noexcept {
  visit_rows(block, some,
             [this, entry](std::uint64_t, std::uint32_t row) noexcept { of_row_[row] = entry; });
}

template <bool kNotes>
void CoarseVoxels::add_cells(const CellTable& cells, const Block& block, std::uint64_t some,
                             std::uint32_t entry, const VoxelIndex& index) noexcept {
  if (entry == kNone) {
    if (kNotes) note_cells(block, some, entry);
    return;
  }
  const Eigen::Vector3f corner = corner_of(index, cells.grid().voxel_size_m());
  CoarseVoxel& voxel = map_[entry];
  // In registers while cells are added: x, y and z of a moment are lanes.
  const Lanes lower = {corner.x(), corner.y(), corner.z(), 0.0F};
  Lanes sum = {voxel.sum.x(), voxel.sum.y(), voxel.sum.z(), voxel.weight};
  Lanes xx_xy_yy = {voxel.squares(0, 0), voxel.squares(0, 1), voxel.squares(1, 1), 0.0F};
  Lanes xz_yz_zz = {voxel.squares(0, 2), voxel.squares(1, 2), voxel.squares(2, 2), 0.0F};
  std::uint32_t all_points = voxel.points;
  visit_rows(block, some, [&](std::uint64_t, std::uint32_t row) noexcept {
    if (kNotes) of_row_[row] = entry;
    const auto points = static_cast<float>(cells.points(row));
    const Lanes local = Lanes{cells.x()[row], cells.y()[row], cells.z()[row], 1.0F} - lower;
    const Lanes weighted = local * (points * points);
    sum += weighted;
    xx_xy_yy += Lanes{weighted[0], weighted[0], weighted[1], 0.0F} *
                Lanes{local[0], local[1], local[1], 0.0F};
    xz_yz_zz += weighted * local[2];
    all_points += cells.points(row);
  });
  voxel.sum = {sum[0], sum[1], sum[2]};
  voxel.weight = sum[3];
  voxel.squares(0, 0) = xx_xy_yy[0];
  voxel.squares(0, 1) = xx_xy_yy[1];
  voxel.squares(1, 1) = xx_xy_yy[2];
  voxel.squares(0, 2) = xz_yz_zz[0];
  voxel.squares(1, 2) = xz_yz_zz[1];
  voxel.squares(2, 2) = xz_yz_zz[2];
  voxel.points = all_points;
}

void CoarseVoxels::find_plane(CoarseVoxel& voxel, const Eigen::Vector3f& corner) const noexcept {
  const float inverse = 1.0F / voxel.weight;
  const Eigen::Vector3f mean = voxel.sum * inverse;
  voxel.mean = corner + mean;
  if (voxel.points < VoxelConfig::kPlaneMinPoints) return;
  const Eigen::Matrix3f covariance = voxel.squares * inverse - mean * mean.transpose();
  const SymmetricEigen<float> eigen = symmetric_eigen<float>(covariance);
  // Points on a line lie in every plane through it: the normal would be arbitrary.
  const bool is_line = eigen.values(1) < VoxelConfig::kPlaneMaxEigenvalueM2;
  if (is_line || eigen.values(0) >= VoxelConfig::kPlaneMaxEigenvalueM2) return;
  voxel.plane = true;
  voxel.normal = eigen.vectors.col(0);
  voxel.flatness = eigen.values(0) / eigen.values(1);
  if (voxel.normal.z() < 0.0F) voxel.normal = -voxel.normal;
}

}  // namespace unimapper::onboard
