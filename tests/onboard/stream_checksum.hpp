// Checksums of the keyframe stream, part by part
#pragma once

#include <initializer_list>

#include "src/place/triangles.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::test {

/// FNV-1a, 64 bit.
class Fnv1a {
 public:
  /// `value` must have no padding.
  template <typename T>
  void add(const T& value) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (const unsigned char byte : bytes) state_ = (state_ ^ byte) * 0x100000001B3ULL;
  }
  template <typename Derived>
  void add_matrix(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) add(matrix.derived().coeff(i));
  }
  void add_pose(const Pose& pose) {
    for (Eigen::Index i = 0; i < 9; ++i) add(pose.rotation.data()[i]);
    add_matrix(pose.translation);
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325ULL;
};

/// What is said of a keyframe, part by part.
inline void add_poses(const KeyframeView& view, Fnv1a& sum) {
  sum.add(view.sequence);
  sum.add(view.reference_scan);
  sum.add_pose(view.T_odometry_keyframe);
  sum.add(static_cast<std::uint8_t>(view.up.known));
  for (const float value : {view.up.variance_x, view.up.covariance_xy, view.up.variance_y}) {
    sum.add(value);
  }
  for (const KeyframeScan& scan : view.scans) {
    sum.add(scan.scan_index);
    sum.add(scan.stamp_ns);
    sum.add_pose(scan.T_odometry_sensor);
  }
}

inline void add_cells(std::span<const FineCell> cells, Fnv1a& sum) {
  for (const FineCell& cell : cells) {
    sum.add_matrix(cell.position);
    sum.add(cell.points);
    sum.add(cell.ground);
  }
}

inline void add_keypoints(std::span<const Keypoint> keypoints, Fnv1a& sum) {
  for (const Keypoint& keypoint : keypoints) {
    sum.add_matrix(keypoint.position);
    sum.add_matrix(keypoint.normal);
    sum.add(keypoint.occupancy);
    sum.add(keypoint.strength);
  }
}

inline void add_planes(std::span<const PlanePatch> planes, Fnv1a& sum) {
  for (const PlanePatch& plane : planes) {
    sum.add_matrix(plane.center);
    sum.add_matrix(plane.normal);
  }
}

inline void add_loops(std::span<const LoopCandidate> candidates, Fnv1a& sum) {
  sum.add(static_cast<std::uint32_t>(candidates.size()));
  for (const LoopCandidate& loop : candidates) {
    sum.add(loop.match.session);
    sum.add(loop.match.keyframe);
    sum.add(loop.confidence);
    sum.add(loop.accepted);
    sum.add(loop.votes);
    sum.add(loop.inliers);
    sum.add(loop.plane_overlap);
    sum.add_pose(loop.T_match_query);
  }
}

/// What was seen and what was dropped; the capacities' fill may differ between word sizes.
inline void add_counts(const KeyframeStatistics& statistics, Fnv1a& sum) {
  for (const std::uint64_t points : {statistics.points_in, statistics.points_valid,
                                     statistics.points_static, statistics.points_dynamic}) {
    sum.add(points);
  }
  for (const std::uint32_t count : {statistics.cells, statistics.dynamic_cells, statistics.voxels,
                                    statistics.ground_voxels, statistics.components}) {
    sum.add(count);
  }
  for (const std::uint64_t dropped : statistics.dropped) sum.add(dropped);
}

/// The parts of a keyframe stream, in the order of the pipeline.
enum class StreamPart : std::uint8_t {
  kPoses,
  kLabels,
  kStaticCells,
  kDynamicCells,
  kKeypoints,
  kPlanes,
  kTriangles,
  kLoops,
  kCounts
};
inline constexpr std::size_t kStreamParts = 9;
inline constexpr std::array<const char*, kStreamParts> kStreamPartNames = {
    "poses",  "labels",    "static cells", "dynamic cells", "keypoints",
    "planes", "triangles", "loops",        "counts"};

using StreamChecksums = std::array<std::uint64_t, kStreamParts>;

/// Adds up the keyframes of a stream.
class StreamChecksum {
 public:
  explicit StreamChecksum(const PipelineConfig& config)
      : triangle_config_(config.loop_search.triangles),
        labels_(config.keyframe.max_points_per_scan),
        triangles_(triangle_config_.max_triangles) {}

  /// Adds the pipeline's finished keyframe.
  void add(const Pipeline& pipeline) {
    const KeyframeView& view = pipeline.keyframe();
    ++keyframes;
    add_poses(view, part(StreamPart::kPoses));
    for (std::size_t scan = 0; scan < view.scans.size(); ++scan) {
      const std::size_t count = pipeline.labels(scan, labels_);
      for (std::size_t i = 0; i < count; ++i) part(StreamPart::kLabels).add(labels_[i]);
    }
    add_cells(view.static_cells, part(StreamPart::kStaticCells));
    add_cells(view.dynamic_cells, part(StreamPart::kDynamicCells));
    add_keypoints(view.place.keypoints, part(StreamPart::kKeypoints));
    add_planes(view.place.planes, part(StreamPart::kPlanes));
    add_triangles(view.place);
    add_loops(view.loops, part(StreamPart::kLoops));
    add_counts(*view.statistics, part(StreamPart::kCounts));
    dynamic_cells += view.dynamic_cells.size();
    keypoints += view.place.keypoints.size();
    planes += view.place.planes.size();
    loops += view.loops.size();
  }

  [[nodiscard]] StreamChecksums checksums() const {
    StreamChecksums result{};
    for (std::size_t i = 0; i < kStreamParts; ++i) result[i] = parts_[i].value();
    return result;
  }

  /// What was added up, so that a test can tell that there was something.
  std::size_t keyframes = 0, dynamic_cells = 0, keypoints = 0, planes = 0, triangles = 0, loops = 0;

 private:
  Fnv1a& part(StreamPart which) { return parts_[static_cast<std::size_t>(which)]; }

  void add_triangles(const PlaceView& place) {
    place::build_triangles(place.keypoints, triangle_config_, *triangles_);
    triangles += triangles_->size();
    for (const place::Triangle& triangle : *triangles_) {
      Fnv1a& sum = part(StreamPart::kTriangles);
      sum.add(triangle.side_cm);
      sum.add(triangle.vertex);
      sum.add(triangle.dot);
      sum.add(triangle.left_handed);
      sum.add(triangle.heading);
    }
  }

  TriangleConfig triangle_config_;
  std::vector<PointLabel> labels_;
  Owned<FixedVector<place::Triangle>> triangles_;
  std::array<Fnv1a, kStreamParts> parts_;
};

}  // namespace unimapper::test
