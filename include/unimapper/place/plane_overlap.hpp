// Do the planes of two places coincide?
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/core/voxel_key.hpp"

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
  void allocate(Arena& arena, std::uint32_t max_planes, float voxel_size_m) noexcept;

  void set_query(std::span<const PlanePatch> planes) noexcept;
  void set_match(std::span<const PlanePatch> planes) noexcept;

  /// Cost: eight look-ups for each of at most `kMaxAsked` planes of either place.
  [[nodiscard]] OverlapResult compare(const Pose& T_match_query) const noexcept;

  /// Moves the pose so that coinciding planes coincide better: point-to-plane least squares with
  /// a bounded number of re-associations. Unchanged where the planes do not determine it.
  [[nodiscard]] Pose refine(const Pose& T_match_query) const noexcept;

 private:
  static constexpr std::uint32_t kMaxAsked = 288;
  struct Side {
    std::uint16_t* voxels;               // 1 + index into planes, 0 where there is none
    FixedVector<std::uint32_t> entries;  // those that are not 0
    std::span<const PlanePatch> planes;
    Horizon horizon;
    std::uint32_t asked[kMaxAsked];  // indices into planes
    std::uint32_t asked_count;
    float weight[2];  // how many planes each level and each upright one that is asked stands for
  };
  // Voxels repeat every 64 in x and y and every 16 in z: what lies farther apart than that, 128 m
  // and 32 m, shares an entry, and the first one has it.
  static constexpr std::int32_t kWidth = 64;
  static constexpr std::int32_t kHeight = 16;
  static std::uint32_t entry_of(const VoxelIndex& v) noexcept {
    return static_cast<std::uint32_t>(
        ((v.z & (kHeight - 1)) * kWidth + (v.y & (kWidth - 1))) * kWidth + (v.x & (kWidth - 1)));
  }
  static void choose_asked(Side& side) noexcept;
  void fill(Side& side, std::span<const PlanePatch> planes) noexcept;
  [[nodiscard]] const PlanePatch* counterpart(const Side& side, const Eigen::Vector3f& center,
                                              const Eigen::Vector3f& normal) const noexcept;

  Side query_;
  Side match_;
  float inverse_size_ = 0.5F;
};

}  // namespace unimapper
