#include "keyframe_output.hpp"

#include <algorithm>

#include "ground.hpp"

namespace unimapper::onboard {
namespace {

std::uint16_t saturated(std::uint32_t points) noexcept {
  return static_cast<std::uint16_t>(std::min(points, 65535U));
}

}  // namespace

void KeyframeOutput::attach(Arena& arena, const PipelineConfig& config) noexcept {
  ground_ = config.ground;
  cells_ = arena.allocate<FineCell>(config.voxel.max_cells);
  dynamic_from_ = arena.allocate<std::uint16_t>(config.voxel.max_cells);
  capacity_ = config.voxel.max_cells;
}

void KeyframeOutput::build(const CellTable& cells, const CoarseVoxels& voxels,
                           const ScanAccumulator& scans, const Pose& T_odometry_keyframe) noexcept {
  const Eigen::Matrix3f r = T_odometry_keyframe.rotation.transpose().cast<float>();
  const Eigen::Vector3f t = (T_odometry_keyframe.rotation.transpose() *
                             (cells.grid().origin_m() - T_odometry_keyframe.translation))
                                .cast<float>();
  static_count_ = 0;
  dynamic_count_ = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    const std::uint8_t flags = cells.flags(row);
    add({r * cells.position(row) + t, saturated(cells.points(row)),
         static_cast<std::uint8_t>((flags & kCellGround) != 0), 0},
        (flags & kCellDynamic) != 0);
  }
  for (std::uint32_t cell = 0; cell < scans.cells().size(); ++cell) {
    const std::uint32_t row = cells.row_of_cell(cell);
    dynamic_from_[cell] = kNever;
    if (row == CellTable::kNoRow) {
      // Nothing was learnt about it, so it is static, as its points are.
      const CellSums& sums = scans.cells()[cell];
      const VoxelIndex index = unpack(scans.cells().key(cell));
      add({r * mean_of(index, sums, cells.grid().cell_size_m) + t, saturated(sums.points), 0, 0},
          false);
    } else if ((cells.flags(row) & kCellDynamic) != 0) {
      dynamic_from_[cell] =
          static_cast<std::uint16_t>(ground_level_in_cell(ground_, voxels, cells, row));
    }
  }
}

void KeyframeOutput::add(const FineCell& cell, bool dynamic) noexcept {
  if (dynamic) {
    ++dynamic_count_;
    cells_[capacity_ - dynamic_count_] = cell;
  } else {
    cells_[static_count_++] = cell;
  }
}

std::uint64_t KeyframeOutput::count_dynamic(const ScanAccumulator& scans) const noexcept {
  std::uint64_t dynamic = 0;
  for (std::uint32_t scan = 0; scan < scans.scans(); ++scan) {
    for (const PointCode code : scans.codes(scan)) {
      dynamic += label(code) == PointLabel::kDynamic ? 1U : 0U;
    }
  }
  return dynamic;
}

}  // namespace unimapper::onboard
