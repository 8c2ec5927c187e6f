// Free space that one keyframe observed
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/free_space/inverse_sensor_model.hpp"

namespace unimapper::merge {

/// How far in front of a surface space is free to loops and changes, metres. Wider than the robot's
/// margin: poses of other sessions are less certain than those of one second.
inline constexpr float kFreeMarginM = 0.6F;

/// Points that keyframes observe, and their evidence; structure of arrays.
class PointEvidence {
 public:
  void push_back(const Eigen::Vector3f& point) {
    x_.push_back(point.x());
    y_.push_back(point.y());
    z_.push_back(point.z());
    log_odds_.push_back(0);
  }
  [[nodiscard]] std::size_t size() const { return x_.size(); }
  [[nodiscard]] ObservedPoints points() {
    return {x_.data(), y_.data(), z_.data(), log_odds_.data(),
            static_cast<std::uint32_t>(x_.size())};
  }
  /// Log-odds of "free", thousandths; 0 where nothing is known.
  [[nodiscard]] std::int32_t log_odds(std::size_t i) const { return log_odds_[i]; }
  [[nodiscard]] const std::vector<std::int32_t>& log_odds() const { return log_odds_; }
  void clear_log_odds() { log_odds_.assign(log_odds_.size(), 0); }

 private:
  std::vector<float> x_;
  std::vector<float> y_;
  std::vector<float> z_;
  std::vector<std::int32_t> log_odds_;
};

/// Robots of older versions send no images.
enum class WithoutImages : std::uint8_t {
  kUnknown,         ///< nothing is known of such a keyframe's free space
  kPaintFromCells,  ///< one coarse image is painted from its cells
};

/// The decoded free-space images of one keyframe.
class KeyframeFreeSpace {
 public:
  /// Damaged images are left out. O(pixels).
  KeyframeFreeSpace(const KeyframeRecord& keyframe, WithoutImages without);

  [[nodiscard]] bool empty() const { return images_.empty(); }

  /// Adds what the images tell of points that `T_keyframe_points` maps to the keyframe's frame. The
  /// images of a keyframe repeat each other: together they weigh no more than two.
  /// O(points x images).
  void observe(const VisibilityTest& visibility, const EvidenceWeights& weights,
               const Pose& T_keyframe_points, const ObservedPoints& points) const;

  /// Share of all directions of which any image holds a range, the mean of the images.
  [[nodiscard]] double field_of_view() const;

 private:
  struct Image {
    Pose T_keyframe_sensor;
    std::vector<std::uint16_t> pixels;
  };
  void decode(const KeyframeRecord& keyframe);
  void paint(const KeyframeRecord& keyframe);

  RangeImageShape shape_;
  ImageProjection projection_;
  float full_weight_range_m_ = 0.0F;
  std::vector<Image> images_;
};

}  // namespace unimapper::merge
