#include "coarse_voxels.hpp"

#include "unimapper/core/symmetric_eigen.hpp"

namespace unimapper::onboard {
namespace {

VoxelIndex voxel_of(const VoxelIndex& cell, std::int32_t cells_per_voxel) noexcept {
  return {floor_divide(cell.x, cells_per_voxel), floor_divide(cell.y, cells_per_voxel),
          floor_divide(cell.z, cells_per_voxel)};
}

Eigen::Vector3f corner_of(const VoxelIndex& voxel, float size_m) noexcept {
  return {static_cast<float>(voxel.x) * size_m, static_cast<float>(voxel.y) * size_m,
          static_cast<float>(voxel.z) * size_m};
}

}  // namespace

void CoarseVoxels::attach(Arena& arena, const VoxelConfig& config) noexcept {
  config_ = config;
  map_.attach(arena, config.max_voxels);
  of_row_ = arena.allocate<std::uint32_t>(config.max_cells);
}

void CoarseVoxels::build(const CellTable& cells) noexcept {
  map_.clear();
  left_out_ = 0;
  collect_moments(cells);
  const float size_m = cells.grid().cell_size_m * static_cast<float>(cells.grid().cells_per_voxel);
  for (std::uint32_t i = 0; i < map_.size(); ++i) {
    find_plane(map_[i], corner_of(unpack(map_.key(i)), size_m));
  }
}

void CoarseVoxels::collect_moments(const CellTable& cells) noexcept {
  const std::int32_t cells_per_voxel = cells.grid().cells_per_voxel;
  const float size_m = cells.grid().cell_size_m * static_cast<float>(cells_per_voxel);
  // Rows of a block follow each other and mostly share their voxel.
  VoxelKey last_key = ~VoxelKey{0};
  std::uint32_t last = kNone;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    const VoxelIndex index = voxel_of(cells.index(row), cells_per_voxel);
    const VoxelKey key = pack(index);
    if (key != last_key) {
      last_key = key;
      last = map_.find_or_insert(key);
    }
    of_row_[row] = last;
    if (last == kNone) {
      ++left_out_;
      continue;
    }
    CoarseVoxel& voxel = map_[last];
    const auto weight = static_cast<float>(cells.points(row));
    const Eigen::Vector3f local = cells.position(row) - corner_of(index, size_m);
    const Eigen::Vector3f weighted = local * weight;
    voxel.sum += weighted;
    voxel.squares.noalias() += weighted * local.transpose();
    voxel.points += cells.points(row);
  }
}

void CoarseVoxels::find_plane(CoarseVoxel& voxel, const Eigen::Vector3f& corner) const noexcept {
  const float inverse = 1.0F / static_cast<float>(voxel.points);
  const Eigen::Vector3f mean = voxel.sum * inverse;
  voxel.mean = corner + mean;
  if (voxel.points < config_.plane_min_points) return;
  const Eigen::Matrix3f covariance = voxel.squares * inverse - mean * mean.transpose();
  const SymmetricEigen<float> eigen = symmetric_eigen<float>(covariance);
  // Points on a line lie in every plane through it: the normal would be arbitrary.
  const bool is_line = eigen.values(1) < config_.plane_max_eigenvalue_m2;
  if (is_line || eigen.values(0) >= config_.plane_max_eigenvalue_m2) return;
  voxel.plane = true;
  voxel.normal = eigen.vectors.col(0);
  if (voxel.normal.z() < 0.0F) voxel.normal = -voxel.normal;
}

}  // namespace unimapper::onboard
