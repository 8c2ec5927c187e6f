// Corner detector on a top-view map of vertical structure.
#pragma once

#include <cstdint>
#include <span>

#include "local_ground.hpp"
#include "src/core/fixed_vector.hpp"
#include "src/core/parts.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// A position where vertical structure ends, bends or is isolated.
struct StructureCorner {
  float x;  ///< metres, between the grid's nodes
  float y;
  float response;
};

/// A symmetric smoothing kernel, its weights from the centre outwards.
struct SmoothingKernel {
  static constexpr std::int32_t kMaxRadius = 6;
  float weight[kMaxRadius + 1];
  std::int32_t radius;
};

/// Counts occupied fine cells above ground per column and finds maxima of the corner response
/// (structure tensor): corners and ends of walls, poles, trunks. Occupied cells count once, so the
/// result depends neither on density nor on dwell time; each is distributed bilinearly over the
/// four nearest columns, so it hardly depends on the grid's phase. Only columns near structure are
/// processed: most of a keyframe's surroundings is empty.
class StructureMap {
 public:
  void allocate(Arena& arena, const DescriptorConfig& config) noexcept;

  /// Begins anew. What follows may be spread over any number of calls: all cells accumulated, then
  /// every pass. Independent of the cells' order. Cost: O(columns of the grid).
  void begin() noexcept;
  /// Adds cells that are not ground. O(cells).
  void accumulate(std::span<const FineCell> structure, const LocalGround& ground) noexcept;
  /// From the map to its corners, in passes from 0 to `kPasses`. Cost of each: linear in the part
  /// of the grid that lies near any cell.
  static constexpr std::uint32_t kPasses = 6;
  void run_pass(std::uint32_t pass, const Executor& executor = {}) noexcept;

  /// Local maxima of the corner response, strongest first, ties by position.
  [[nodiscard]] std::span<const StructureCorner> corners() const noexcept {
    return corners_.view();
  }

  /// Which 0.2 m slices above the local ground are occupied within `kCodeRadius` of (x, y).
  [[nodiscard]] std::uint64_t occupancy(float x, float y) const noexcept;

  static constexpr float kCodeRadius = 1.2F;
  static constexpr float kSliceHeight = 0.2F;

  /// Corners refused because a container was full since `begin`.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return corners_.refused(); }

 private:
  // Empty columns around the map, so that no kernel reaches beyond it.
  static constexpr std::int32_t kMargin = SmoothingKernel::kMaxRadius + 1;
  // Rows are worked on in blocks of so many columns.
  static constexpr std::int32_t kBlock = 8;

  void clear() noexcept;
  void mark_reach() noexcept;
  template <typename Work>
  void for_each_block(const Executor& executor, const Work& work) const noexcept;
  void gradients(const Executor& executor) noexcept;
  void smooth(float* field, const Executor& executor) noexcept;
  void corner_response(const Executor& executor) noexcept;
  void find_corners(const Executor& executor) noexcept;
  [[nodiscard]] bool is_maximum(std::int32_t column) const noexcept;
  void add_corner(std::int32_t column) noexcept;

  DescriptorConfig config_{};
  std::int32_t width_ = 0;   // a multiple of kBlock
  std::int32_t blocks_ = 0;  // of one row
  float half_extent_m_ = 0.0F;
  std::uint8_t* occupied_ = nullptr;  // blocks that hold structure
  std::uint8_t* reach_ = nullptr;     // and those that kernels reach from there
  std::int32_t* counts_ = nullptr;
  std::uint64_t* masks_ = nullptr;  // occupied slices of every column
  float* xx_ = nullptr;             // structure tensor; `xx_` then holds the response
  float* xy_ = nullptr;
  float* yy_ = nullptr;
  float* scratch_ = nullptr;
  SmoothingKernel window_kernel_{};
  FixedVector<StructureCorner> corners_;
};

}  // namespace unimapper::place
