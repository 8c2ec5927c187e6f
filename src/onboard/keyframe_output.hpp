// Labels and cells of a finished keyframe
#pragma once

#include <cstdint>
#include <span>

#include "cell_table.hpp"
#include "coarse_voxels.hpp"
#include "feet.hpp"
#include "scan_accumulator.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Turns decided cells into labels of points and into cells of the levelled keyframe frame.
class KeyframeOutput {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Converts the table's cells. O(cells). With `deferred`, the cells of the keyframe before stay
  /// as they are, wherever a view of it points to.
  void build(const BlockWindow& window, const CellTable& cells, const CoarseVoxels& voxels,
             const Pose& T_odometry_keyframe) noexcept;

  [[nodiscard]] std::span<const FineCell> static_cells() const noexcept {
    return {cells_, static_count_};
  }
  [[nodiscard]] std::span<const FineCell> dynamic_cells() const noexcept {
    return {cells_ + capacity_ - dynamic_count_, dynamic_count_};
  }

  /// Label of one point. In a dynamic cell, points at the height of the ground stay static; in a
  /// ground cell below one, points above the ground are dynamic.
  [[nodiscard]] PointLabel label(PointCode code) const noexcept {
    if (code == kPointInvalid) return PointLabel::kUnknown;
    if (!has_cell(code)) return PointLabel::kStatic;
    return height_of(code) >= dynamic_from_[cell_of(code)] ? PointLabel::kDynamic
                                                           : PointLabel::kStatic;
  }

  /// Dynamic points in all scans. O(points).
  [[nodiscard]] std::uint64_t count_dynamic(const ScanAccumulator& scans) const noexcept;

 private:
  void add(const FineCell& cell, bool dynamic) noexcept;

  GroundConfig ground_;
  Feet feet_;
  std::uint32_t capacity_ = 0;
  std::uint32_t static_count_ = 0;
  std::uint32_t dynamic_count_ = 0;
  FineCell* cells_ = nullptr;         ///< static ones from the front, dynamic ones from the back
  FineCell* cells_before_ = nullptr;  ///< of the keyframe before; with `deferred` not the same
  std::uint16_t* dynamic_from_ = nullptr;  ///< by entry of the store: lowest dynamic height
};

}  // namespace unimapper::onboard
