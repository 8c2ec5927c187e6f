// What one keyframe saw through, asked by others.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "unimapper/core/image_projection.hpp"
#include "unimapper/merge/refinement.hpp"

namespace unimapper::merge {

/// The decoded images of a keyframe at their place in the map.
class Witness {
 public:
  /// Damaged images are left out. O(pixels).
  Witness(const PlacedSession& placed, std::size_t keyframe);

  [[nodiscard]] bool has_seen() const { return !images_.empty(); }

  /// Adds to `log_odds` what the images know about the points (metres from `origin`, map frame):
  /// more if they were seen through, less if a surface was met about there. The images of a
  /// keyframe repeat each other: together they weigh no more than two. O(points x images).
  void judge(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& origin,
             const RefinementConfig& config, std::span<float> log_odds) const;

 private:
  struct Image {
    Pose T_sensor_map;
    std::vector<std::uint16_t> pixels;
  };
  void judge(const Image& image, std::span<const Eigen::Vector3f> points,
             const Eigen::Vector3d& origin, const RefinementConfig& config, float scale,
             std::span<float> log_odds) const;

  /// What a pixel says of a point at `range_m`.
  [[nodiscard]] float verdict(std::uint16_t pixel, float range_m,
                              const RefinementConfig& config) const;

  ImageProjection projection_;
  float full_weight_range_m_ = 0.0F;
  std::vector<Image> images_;
};

}  // namespace unimapper::merge
