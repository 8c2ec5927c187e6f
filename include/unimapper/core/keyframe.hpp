// Data types of a keyframe, shared by robot and base.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>

#include "unimapper/core/grid_size.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper {

/// One occupied fine cell of a keyframe: the mean of the points of a 0.2 m cell (L_f).
/// `position` is in the levelled keyframe frame (see `level_frame`), metres.
struct FineCell {
  Eigen::Vector3f position;  ///< mean of its points
  std::uint16_t points;      ///< scan points in the cell, saturating; 0: not known at the base
  std::uint8_t ground;       ///< 1 if the cell belongs to the ground
  /// Mean intensity of its points, from 1; 0: not known (`PipelineConfig::intensity`).
  std::uint8_t intensity;
};

/// One scan of a keyframe: when and where it was taken.
struct KeyframeScan {
  std::uint32_t scan_index;  ///< running number of the scan in its session, from 0
  std::int64_t stamp_ns;     ///< time of the scan, by the caller's clock
  Pose T_odometry_sensor;    ///< sensor frame to odometry frame, metres
};

/// How far one scan of a keyframe could see: nothing was in the way up to a pixel's range. Pixels
/// row by row as in `ImageProjection`, in 1/128 m, `kNoRange` where nothing is known.
struct FreeSpaceImage {
  std::uint32_t scan;                     ///< index into the keyframe's scans
  std::span<const std::uint16_t> pixels;  ///< one per pixel of the image's shape
};

/// A repeatable point of the static scene (paper section V-A), in the levelled keyframe frame.
struct Keypoint {
  Eigen::Vector3f position;  ///< metres
  Eigen::Vector3f normal;    ///< unit normal of the plane it was projected onto
  std::uint64_t occupancy;   ///< which heights of its column are occupied, one bit a slice
  std::uint16_t strength;    ///< what suppression ranks by; larger is stronger
};

/// One planar 2 m voxel, in the levelled keyframe frame; loop verification overlaps these.
struct PlanePatch {
  Eigen::Vector3f center;  ///< metres
  Eigen::Vector3f normal;  ///< unit length, oriented towards the sensor's origin
};

/// Larger eigenvalue of the symmetric matrix (xx, xy; xy, yy): the variance about the less certain
/// axis.
[[nodiscard]] inline double largest_variance(double xx, double xy, double yy) noexcept {
  const double half = 0.5 * (xx - yy);
  return 0.5 * (xx + yy) + std::sqrt(half * half + xy * xy);
}

/// Drift of the odometry's roll and pitch from one keyframe to the next, standard deviation
/// (docs/design/gravity.md).
inline constexpr double kTiltDriftDeg = 0.05;

/// How well the z axis of a keyframe's frame is known to point up.
struct KeyframeUp {
  bool known = false;  ///< false: z is the odometry's z axis, and nothing tells how level that is
  /// Covariance of up's x and y in the keyframe's frame, rad²; 0 where up is not known.
  float variance_x = 0.0F;
  float covariance_xy = 0.0F;  ///< of x with y
  float variance_y = 0.0F;     ///< of y

  /// Standard deviation of up about its less certain axis, rad; 0 where up is not known.
  [[nodiscard]] double sigma() const noexcept {
    return std::sqrt(largest_variance(static_cast<double>(variance_x),
                                      static_cast<double>(covariance_xy),
                                      static_cast<double>(variance_y)));
  }
  friend bool operator==(const KeyframeUp&, const KeyframeUp&) = default;
};

/// Covariance of a translation along the odometry frame's axes, m²: how far the odometry slipped on
/// axes that its sensors did not determine. Zero where they determined all.
using SlipCovariance = Eigen::Matrix3f;

/// Largest variance of a slip, m²: more says no more.
inline constexpr float kMostSlip_m2 = 1e6F;

/// Whether it is one that is not zero: finite, symmetric, without negative eigenvalues but for
/// rounding, at most `kMostSlip_m2`.
[[nodiscard]] bool is_slip(const SlipCovariance& covariance) noexcept;

/// What one keyframe looks like to loop search, in its levelled frame (paper section V-A).
/// Triangles are not part of it: they follow from the keypoints, bit-identically, wherever they are
/// needed, so only keypoints are transmitted.
struct PlaceView {
  std::span<const Keypoint> keypoints;  ///< repeatable points of the static scene
  std::span<const PlanePatch> planes;   ///< planar voxels
  KeyframeUp up{};                      ///< how level the frame is
};

/// What a keyframe consists of, to be sent or stored. Every span points into memory
/// that the view does not own.
struct KeyframeContent {
  std::uint32_t sequence = 0;  ///< running number, from 0
  /// The robot stands and sees nothing new: the keyframe repeats the one of `sequence`. It has
  /// labels, cells and counts, but is never finished, has no place, no images and no up, and leaves
  /// no evidence. Encoding it is refused (docs/using.md).
  bool repeats = false;
  std::uint32_t reference_scan = 0;  ///< index into `scans`; the keyframe's pose is this scan's
  Pose T_odometry_keyframe;          ///< levelled frame at the reference scan's sensor pose
  KeyframeUp up;                     ///< how level that frame is
  SlipCovariance slip = SlipCovariance::Zero();  ///< since the keyframe before
  std::span<const KeyframeScan> scans;           ///< in order of time
  float cell_size_m = kFineCellSizeM;       ///< edge of the cells, whose grid is the odometry's
  std::span<const FineCell> static_cells;   ///< the map's contribution
  std::span<const FineCell> dynamic_cells;  ///< what was removed, for display and audit
  /// Free-space images: evidence about the cells of neighbouring keyframes.
  RangeImageShape image_shape;
  /// Farther out, what was seen through counts in proportion less (`FreeSpaceConfig`), metres; 0:
  /// never.
  float image_full_weight_range_m = 0.0F;
  std::span<const FreeSpaceImage> images;  ///< of scans spread over the keyframe
  PlaceView place;                         ///< keypoints and planes of the static cells
  std::uint64_t points_in = 0;             ///< scan points that went into the keyframe
  std::uint64_t points_dynamic = 0;        ///< scan points removed as dynamic
  /// Far more cells than in the keyframes before are dynamic: the scans contradict the odometry.
  bool odometry_contradicted = false;
};

}  // namespace unimapper
