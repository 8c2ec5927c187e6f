// Labels and cells of a finished keyframe
#pragma once

#include <cstdint>
#include <span>

#include "cell_table.hpp"
#include "coarse_voxels.hpp"
#include "scan_accumulator.hpp"
#include "src/onboard/removal/feet.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/vector_width.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Turns decided cells into labels of points and into cells of the levelled keyframe frame.
class KeyframeOutput {
 public:
  /// What is in use from `begin` on, labels until the keyframe's scans are forgotten, cells as long
  /// as the view of it is valid.
  void allocate_labels(Arena& arena, const PipelineConfig& config) noexcept;
  void allocate_cells(Arena& arena, const PipelineConfig& config) noexcept;

  /// Begins to convert the table's cells, all of which are labelled. With `deferred`, the cells of
  /// the keyframe before stay as they are, wherever a view of it points to. `intensities`: as of
  /// `ScanAccumulator`, until the last step. O(blocks and room for cells).
  void begin(const BlockWindow& window, const CellTable& cells, const Pose& T_odometry_keyframe,
             const IntensitySum* intensities) noexcept;
  /// Converts those of the next blocks, with `deferred` 4,096. False once none is
  /// left. O(cells).
  bool step(const BlockWindow& window, const CellTable& cells, const CoarseVoxels& voxels) noexcept;

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
    return height_of(code) >= dynamic_from(dynamic_from_, cell_of(code)) ? PointLabel::kDynamic
                                                                         : PointLabel::kStatic;
  }

  /// Dynamic points in all scans, eight at a time where registers allow. O(points).
  [[nodiscard]] std::uint64_t count_dynamic(const ScanAccumulator& scans) const noexcept;

 private:
  /// Where cells go.
  struct Ends {
    FineCell* next_static;
    FineCell* last_dynamic;
  };
  /// Converts some blocks, before which so many cells are dynamic.
  Ends add_blocks(Slice some, std::uint32_t dynamic_before, const BlockWindow& window,
                  const CellTable& cells, const CoarseVoxels& voxels) noexcept;
  Ends add_block(std::uint32_t b, Ends ends, const BlockWindow& window, const CellTable& cells,
                 const CoarseVoxels& voxels) noexcept;
  /// How high in the cell of an entry dynamic points begin, out of words of two entries each: what
  /// a vector gathers are words.
  [[nodiscard]] static std::uint32_t dynamic_from(const std::uint32_t* pairs,
                                                  std::uint32_t entry) noexcept {
    return pairs[entry >> 1U] >> ((entry & 1U) << 4U) & 0xFFFFU;
  }
  void set_dynamic_from(std::uint32_t entry, std::uint32_t height) noexcept {
    const std::uint32_t shift = (entry & 1U) << 4U;
    std::uint32_t& pair = dynamic_from_[entry >> 1U];
    pair = (pair & ~(0xFFFFU << shift)) | height << shift;
  }

  GroundConfig ground_;
  Feet feet_;
  Executor executor_;
  std::uint32_t slice_blocks_ = 0;
  SlicedLoop loop_;
  Eigen::Matrix3f R_keyframe_grid_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_keyframe_grid_ = Eigen::Vector3f::Zero();
  const IntensitySum* intensities_ = nullptr;
  std::uint32_t capacity_ = 0;
  std::uint32_t static_count_ = 0;
  std::uint32_t dynamic_count_ = 0;
  FineCell* cells_ = nullptr;         ///< static ones from the front, dynamic ones from the back
  FineCell* cells_before_ = nullptr;  ///< of the keyframe before; `cells_` itself unless `deferred`
  std::uint32_t entries_ = 0;         ///< of the store; one more belongs to no cell
  std::uint32_t* dynamic_from_ = nullptr;  ///< lowest dynamic heights, see `dynamic_from`
  VectorWidth width_ = VectorWidth::kBaseline;
};

}  // namespace unimapper::onboard
