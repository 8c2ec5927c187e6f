// Feet in ground cells
#pragma once

#include <cstdint>

#include "block_window.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Finds the ground cells below dynamic ones, and how high in them feet begin: above the level of
/// the ground around (`ground_level`), measured from the plane that splits the cell's voxel, so
/// that slopes do not count.
class Feet {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Finds the cells below dynamic ones; all labels are decided, and the keyframe is still the
  /// window's current one. O(blocks + dynamic blocks x 18).
  void find(const BlockWindow& window, const CellTable& cells) noexcept;

  /// Ground cells of a block that may hold feet, one bit per cell, after `find`.
  [[nodiscard]] std::uint64_t cells_of(std::uint32_t block, const CellMarks& marks) const noexcept {
    return on_ ? marks.ground & ~marks.dynamic & below_[block] : 0;
  }
  /// How high in such a cell (0 to `kAboveCell`) feet begin; nowhere if too little ground is
  /// seen around it. At most 75 cells are looked at.
  [[nodiscard]] std::uint32_t level_in_cell(const BlockWindow& window, const CoarseVoxels& voxels,
                                            const CellTable& cells,
                                            std::uint32_t row) const noexcept;

 private:
  void mark_around(const BlockWindow& window, std::uint32_t block, std::uint64_t cells,
                   std::int32_t z) noexcept;

  bool on_ = false;
  float foot_height_m_ = 0.0F;
  std::uint64_t* below_ = nullptr;  ///< by block: cells below dynamic ones, or beside such
};

}  // namespace unimapper::onboard
