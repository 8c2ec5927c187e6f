// Sliding window of free-space evidence
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "src/free_space/free_columns.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/free_space/inverse_sensor_model.hpp"
#include "unimapper/free_space/range_image.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The range image of one scan (see `RangePainter`).
struct RangeImage {
  std::uint16_t* pixels = nullptr;
  std::uint32_t scan = 0;  ///< of the keyframe
  Eigen::Matrix3f R_grid_sensor = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_grid_sensor = Eigen::Vector3f::Zero();  ///< metres from the grid's origin
};

/// The free-space evidence of one keyframe (part of the measurement Z of paper section IV-D).
struct KeyframeEvidence {
  Grid grid;
  RangeImageShape shape;  ///< of its images
  ImageProjection projection;
  InverseSensorModel model;
  float full_weight_range_m = 0.0F;
  FreeColumns columns;
  RangeImage* images = nullptr;  ///< as many as configured
  std::uint32_t image_count = 0;

  [[nodiscard]] std::span<const RangeImage> painted() const noexcept {
    return {images, image_count};
  }
  /// Adds what every `stride`-th image, the last one among them, tells of points in `points_grid`.
  /// O(points x images).
  void observe(std::uint32_t stride, const Grid& points_grid,
               const ObservedPoints& points) const noexcept;
};

/// The evidence of the last N keyframes and of the current one. A ring: the oldest makes room.
class EvidenceWindow {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Forgets all earlier keyframes.
  void forget() noexcept {
    earlier_ = 0;
    blocks_.forget();
  }

  /// Occupied cells and what became of them.
  [[nodiscard]] BlockWindow& blocks() noexcept { return blocks_; }
  [[nodiscard]] const BlockWindow& blocks() const noexcept { return blocks_; }

  /// The slot of the current keyframe: images and columns are filled while it is being built.
  [[nodiscard]] KeyframeEvidence& current() noexcept { return slots_[current_]; }
  [[nodiscard]] const KeyframeEvidence& current() const noexcept { return slots_[current_]; }

  /// Earlier keyframes in the window.
  [[nodiscard]] std::uint32_t earlier_count() const noexcept { return earlier_; }
  /// The one `age` keyframes ago, from 1 to `earlier_count()`.
  [[nodiscard]] const KeyframeEvidence& earlier(std::uint32_t age) const noexcept {
    return slots_[(current_ + slot_count_ - age) % slot_count_];
  }

  /// Images of the keyframes begun from now on have this shape and count up to this range in full;
  /// there is room for their pixels.
  void follow(const FreeSpaceConfig& free_space) noexcept;

  /// Begins the current keyframe in `grid`.
  void begin(const Grid& grid) noexcept;

  /// The image that scan `scan` of the current keyframe, taken at `T_odometry_sensor`, is to be
  /// painted into, or null. Evenly spread scans are painted, the first and the last among them:
  /// what drives away is seen through only by later scans, what approaches only by earlier ones.
  [[nodiscard]] RangeImage* image_for(std::uint32_t scan, const Pose& T_odometry_sensor) noexcept;

  /// Takes the ground of the current keyframe out of the occupancy that later keyframes count:
  /// where a walker puts his feet, ground was seen before, and that is no evidence that he stood
  /// there. Once ground and obstacles are split. O(blocks).
  void leave_out_ground(const CellTable& cells) noexcept;

  /// Records the decided cells and moves on: the current keyframe becomes the latest earlier one.
  /// O(blocks).
  void record(const CellTable& cells) noexcept;

  /// Instead of `record`: the current keyframe leaves no evidence. O(blocks).
  void discard() noexcept { blocks_.discard(); }

  /// Columns of the current keyframe that found no room.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return current().columns.left_out(); }

 private:
  Executor executor_;
  BlockWindow blocks_;
  EvidenceWeights weights_;
  FreeSpaceConfig free_space_;
  std::uint32_t scans_per_keyframe_ = 10;
  std::uint32_t images_per_keyframe_ = 2;
  bool last_scan_unknown_ = false;  ///< keyframes close by distance, too
  std::array<KeyframeEvidence, RemovalConfig::kMaxWindow + 1> slots_;
  std::uint32_t slot_count_ = 2;  ///< N + 1
  std::uint32_t current_ = 0;
  std::uint32_t earlier_ = 0;
};

}  // namespace unimapper::onboard
