// Do the planes of two places coincide?
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_hash_map.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper {

/// What one place can see: the farthest plane in every direction and the range of elevations.
/// Beyond it, a plane of the other place is neither confirmed nor contradicted.
struct Horizon {
  static constexpr std::uint32_t kSectors = 64;
  float range_m[kSectors];
  float slope_min;  ///< height over distance of the lowest and the highest plane
  float slope_max;

  void build(std::span<const PlanePatch> planes) noexcept;
  [[nodiscard]] bool sees(const Eigen::Vector3f& position) const noexcept;
};

/// Outcome of a comparison.
struct OverlapResult {
  float overlap = 0.0F;          ///< share of the commonly visible planes that coincide, [0, 1]
  float upright_overlap = 0.0F;  ///< the same for upright planes only
  std::uint32_t upright = 0;     ///< upright planes that coincide, both directions
};

/// Compares the planes of a match and a query (paper section V-B). The neighbour of a plane is
/// looked for in the voxels around it and nowhere else, and only planes that both places can see
/// are counted, in both directions: a narrow view inside a wide one scores like a wide one.
class PlaneOverlap {
 public:
  void attach(Arena& arena, std::uint32_t max_planes, float voxel_size_m) noexcept;

  void set_query(std::span<const PlanePatch> planes) noexcept;
  void set_match(std::span<const PlanePatch> planes) noexcept;

  /// Cost: eight look-ups per plane.
  [[nodiscard]] OverlapResult compare(const Pose& T_match_query) const noexcept;

  /// Moves the pose so that coinciding planes coincide better: point-to-plane least squares with
  /// a bounded number of re-associations. Unchanged where the planes do not determine it.
  [[nodiscard]] Pose refine(const Pose& T_match_query) const noexcept;

 private:
  struct Side {
    FixedHashMap<std::uint32_t> voxels;  // voxel -> 1 + index into planes
    std::span<const PlanePatch> planes;
    Horizon horizon;
  };
  void fill(Side& side, std::span<const PlanePatch> planes) noexcept;
  [[nodiscard]] const PlanePatch* counterpart(const Side& side, const Eigen::Vector3f& center,
                                              const Eigen::Vector3f& normal) const noexcept;

  Side query_;
  Side match_;
  float inverse_size_ = 0.5F;
};

}  // namespace unimapper
