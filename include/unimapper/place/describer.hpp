// DynaSTD: keypoints and planes from the static cells of a keyframe.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/local_ground.hpp"
#include "unimapper/place/plane_voxels.hpp"
#include "unimapper/place/structure_map.hpp"

namespace unimapper {

/// Describes keyframes (paper section V-A). Works in the levelled keyframe frame, so the result
/// depends neither on the odometry frame's origin nor on its yaw, and not on the order in
/// which the cells come.
class PlaceDescriber {
 public:
  /// Takes all memory it will ever need from `arena`.
  void allocate(Arena& arena, const DescriptorConfig& config) noexcept;

  /// Describes one keyframe. The view stays valid until the next call. Bounded by the
  /// configured capacities; what did not fit is in `dropped()`.
  PlaceView describe(std::span<const FineCell> cells) noexcept;

  /// The planes alone, as `describe` finds them: for whoever has cells and keypoints already. Valid
  /// until the next call.
  std::span<const PlanePatch> find_planes(std::span<const FineCell> cells) noexcept;

  /// Cells, voxels and keypoints refused for want of capacity in the last call.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  void admit(std::span<const FineCell> cells) noexcept;
  void select_keypoints() noexcept;

  DescriptorConfig config_{};
  FixedVector<FineCell> structure_cells_;  // not ground, within range
  FixedVector<Keypoint> keypoints_;
  LocalGround ground_;
  PlaneVoxels planes_;
  StructureMap structure_;
  std::uint64_t dropped_ = 0;
};

}  // namespace unimapper
