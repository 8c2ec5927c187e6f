// Scans to keyframes
#pragma once

#include <cstdint>

#include "evidence_window.hpp"
#include "ground_aligner.hpp"
#include "keyframe.hpp"
#include "sampling_monitor.hpp"
#include "scan_accumulator.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/free_space/range_image.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Collects the scans of a keyframe (paper section IV-A): their points in fine cells, range images
/// of some of them in the window, and what they say of sensor and poses.
class KeyframeBuilder {
 public:
  explicit KeyframeBuilder(const PipelineConfig& config) noexcept
      : keyframe_config_(config.keyframe),
        voxel_config_(config.voxel),
        paints_(config.free_space.visibility),
        clock_ns_(config.clock_ns) {}
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;
  /// What is in use only until the cells of a keyframe are laid out in a table.
  void allocate_cells(Arena& arena, const PipelineConfig& config) noexcept {
    accumulator_.allocate_cells(arena, config);
  }

  /// The odometry was restarted: ground seen before says nothing.
  void forget() noexcept { aligner_.forget(); }

  /// Whether a scan has a point to add. O(1) if one of its first points is.
  [[nodiscard]] bool is_usable(const PointView& points) const noexcept {
    return accumulator_.has_valid_point(points);
  }
  /// Every few keyframes the first scan is measured before it is added: whether that is due,
  bool must_measure() const noexcept { return !open_ && !measured_ && sampling_.is_due(); }
  /// and a slice of it (`SamplingMonitor::step`). False once nothing of it is left.
  bool measure(const PointView& first_points) noexcept;
  /// Adds a scan that is usable to `keyframe`, which begins with it if none is open; measures what
  /// is left to be measured. O(points).
  void add(const PointView& points, const ScanOrigin& origin, EvidenceWindow& window,
           Keyframe& keyframe) noexcept;
  /// A keyframe has at least one scan and is not closed yet.
  [[nodiscard]] bool is_open() const noexcept { return open_; }
  [[nodiscard]] bool is_complete(const Keyframe& keyframe) const noexcept;
  /// Closes the keyframe: its scans, its frame as the odometry levels it, what is known of the
  /// sensor.
  void close(Keyframe& keyframe) noexcept;

  /// The points of the open keyframe, or of the last one.
  [[nodiscard]] const ScanAccumulator& scans() const noexcept { return accumulator_; }
  /// Scans that the next keyframe will have if it closes as the last one did.
  [[nodiscard]] std::uint32_t expected_scans() const noexcept { return expected_scans_; }
  /// Between two rays of a ring, as measured, degrees; 0: not known.
  [[nodiscard]] float ray_spacing_deg() const noexcept {
    return sampling_.free_space().ray_spacing_deg;
  }
  /// The pose that a scan of the window was used at, by the pose that came with it.
  [[nodiscard]] const Pose& used_pose(const Pose& T_odometry_sensor) const noexcept {
    return aligner_.used_pose(T_odometry_sensor);
  }

 private:
  void begin(const PointView& first_points, const Pose& first_pose, EvidenceWindow& window,
             Keyframe& keyframe) noexcept;
  void ingest(const PointView& points, const Pose& pose, EvidenceWindow& window,
              Keyframe& keyframe) noexcept;

  KeyframeConfig keyframe_config_;
  VoxelConfig voxel_config_;
  bool paints_;
  std::int64_t (*clock_ns_)();
  ScanAccumulator accumulator_;
  RangePainter painter_;
  SamplingMonitor sampling_;
  GroundAligner aligner_;
  bool open_ = false;
  bool measuring_ = false;  ///< the first scan of the next keyframe,
  bool measured_ = false;   ///< and that is done
  std::uint32_t expected_scans_ = 0;
  bool sampling_changed_ = false;  ///< since the last keyframe closed
};

}  // namespace unimapper::onboard
