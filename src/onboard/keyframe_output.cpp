#include "keyframe_output.hpp"

#include <algorithm>
#include <utility>

#include "ground.hpp"

namespace unimapper::onboard {
namespace {

std::uint16_t saturated(std::uint32_t points) noexcept {
  return static_cast<std::uint16_t>(std::min(points, 65535U));
}

}  // namespace

void KeyframeOutput::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  ground_ = config.ground;
  feet_.allocate(arena, config);
  cells_ = arena.allocate<FineCell>(config.voxel.max_cells);
  cells_before_ = config.deferred ? arena.allocate<FineCell>(config.voxel.max_cells) : cells_;
  dynamic_from_ = arena.allocate<std::uint16_t>(CellStore::max_entries(config.voxel));
  capacity_ = config.voxel.max_cells;
}

void KeyframeOutput::build(const BlockWindow& window, const CellTable& cells,
                           const CoarseVoxels& voxels, const Pose& T_odometry_keyframe) noexcept {
  const Eigen::Matrix3f r = T_odometry_keyframe.rotation.transpose().cast<float>();
  const Eigen::Vector3f t = (T_odometry_keyframe.rotation.transpose() *
                             (cells.grid().origin_m() - T_odometry_keyframe.translation))
                                .cast<float>();
  std::swap(cells_, cells_before_);
  static_count_ = 0;
  dynamic_count_ = 0;
  feet_.find(window, cells);
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    const CellMarks& marks = cells.marks(b);
    const std::uint64_t feet = feet_.cells_of(b, marks);
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      const bool dynamic = (marks.dynamic & cell) != 0;
      add({r * cells.position(row) + t, saturated(cells.points(row)),
           static_cast<std::uint8_t>((marks.ground & cell) != 0), 0},
          dynamic);
      std::uint32_t from = kAboveCell;
      if (dynamic) from = ground_level_in_cell(ground_, voxels, cells, row);
      if ((feet & cell) != 0) from = feet_.level_in_cell(window, voxels, cells, row);
      dynamic_from_[cells.entry(row)] = static_cast<std::uint16_t>(from);
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
