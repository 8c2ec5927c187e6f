// Plane overlap of two places under a relative pose.
#pragma once

#include <cstdint>
#include <span>

#include "src/core/fixed_vector.hpp"
#include "src/core/voxel_key.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::place {

/// Visible extent of one place: the farthest plane in every direction and the range of elevations.
/// Planes of the other place beyond it are not counted.
struct VisibleExtent {
  static constexpr std::uint32_t kSectors = 64;
  float range_m[kSectors];
  float slope_min;  ///< height over distance of the lowest and the highest plane
  float slope_max;

  void build(std::span<const PlanePatch> planes) noexcept;
  [[nodiscard]] bool contains(const Eigen::Vector3f& position) const noexcept;
};

/// Outcome of a comparison.
struct OverlapResult {
  float overlap = 0.0F;  ///< share of the commonly visible planes that coincide, [0, 1]
  /// Share of the commonly visible upright planes that coincide, [0, 1].
  float upright_overlap = 0.0F;
  std::uint32_t upright = 0;  ///< upright planes that coincide, both directions
};

/// Compares the planes of a match and a query (paper section V-B). The counterpart of a plane is
/// searched for in the voxels around it only, and only planes that both places can see
/// are counted, in both directions: a narrow view inside a wide one scores like a wide one.
class PlaneOverlap {
 public:
  void allocate(Arena& arena, std::uint32_t max_planes, float voxel_size_m) noexcept;

  void set_query(std::span<const PlanePatch> planes) noexcept;
  void set_match(std::span<const PlanePatch> planes) noexcept;

  /// Cost: eight look-ups for each of at most `kMaxSampled` planes of either place.
  [[nodiscard]] OverlapResult compare(const Pose& T_match_query) const noexcept;

  /// Moves the pose so that coinciding planes coincide better: point-to-plane least squares with
  /// a bounded number of re-associations and the information about its tilt, which is zero, 1/rad².
  /// Unchanged where the planes do not determine it.
  [[nodiscard]] Pose refine(const Pose& T_match_query,
                            const Eigen::Matrix2d& tilt_information) const noexcept;

 private:
  static constexpr std::uint32_t kMaxSampled = 288;
  struct Side {
    std::uint16_t* voxels;               // 1 + index into planes, 0 where there is none
    FixedVector<std::uint32_t> entries;  // those that are not 0
    std::span<const PlanePatch> planes;
    VisibleExtent extent;
    std::uint32_t sampled[kMaxSampled];  // indices into planes
    std::uint32_t sampled_count;
    float weight[2];  // planes that each sampled one stands for, level and upright
  };
  // Voxels repeat every 64 in x and y and every 16 in z: what lies farther apart than that, 128 m
  // and 32 m, shares an entry, and the first one has it.
  static constexpr std::int32_t kWidth = 64;
  static constexpr std::int32_t kHeight = 16;
  static std::uint32_t entry_of(const VoxelIndex& v) noexcept {
    return static_cast<std::uint32_t>(
        ((v.z & (kHeight - 1)) * kWidth + (v.y & (kWidth - 1))) * kWidth + (v.x & (kWidth - 1)));
  }
  static void sample_planes(Side& side) noexcept;
  void fill(Side& side, std::span<const PlanePatch> planes) noexcept;
  [[nodiscard]] const PlanePatch* counterpart(const Side& side, const Eigen::Vector3f& center,
                                              const Eigen::Vector3f& normal) const noexcept;

  Side query_;
  Side match_;
  float inverse_size_ = 0.5F;
};

}  // namespace unimapper::place
