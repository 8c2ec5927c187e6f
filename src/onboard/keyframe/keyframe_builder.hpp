// Scans to keyframes
#pragma once

#include <cstdint>

#include "keyframe.hpp"
#include "scan_accumulator.hpp"
#include "src/onboard/attitude/ground_aligner.hpp"
#include "src/onboard/removal/evidence_window.hpp"
#include "src/onboard/sampling/sampling_monitor.hpp"
#include "src/onboard/slice_cost.hpp"
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
        slice_points_(config.deferred ? 16384 : SIZE_MAX),
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
  /// Whether the first scan is to be measured before it is added, as every few keyframes.
  bool must_measure() const noexcept {
    return !open_ && !measured_ && (measuring_ || sampling_.is_due());
  }
  /// A slice of measuring the first scan (`SamplingMonitor::step`). False once nothing of it is
  /// left.
  bool measure(const PointView& first_points) noexcept;
  /// A slice of adding a scan that is usable to `keyframe`, which begins with it if none is open;
  /// the first one measures what is left to be measured. False once the scan is added; until then
  /// the next slice is of the same scan. O(points); with `deferred` of 16,384 of them but for the
  /// last slice, where the scan is painted into a range image.
  bool add_step(const PointView& points, const ScanOrigin& origin, EvidenceWindow& window,
                Keyframe& keyframe) noexcept;
  /// A scan was begun and is not added yet.
  [[nodiscard]] bool is_adding() const noexcept { return adding_; }
  /// Expected cost (`slice_cost`), by that of the scans before: of the next slice of adding a scan
  /// of so many points, of all slices that are left, and of a whole scan after that.
  [[nodiscard]] std::uint32_t step_cost(std::size_t points) const noexcept;
  [[nodiscard]] std::uint32_t cost_left(std::size_t points) const noexcept;
  [[nodiscard]] std::uint32_t cost_later(std::size_t points) const noexcept {
    return slice_cost::kBeginningScan + slice_cost::of_points(points, later_scan_cost_);
  }
  /// A keyframe has at least one scan and is not closed yet.
  [[nodiscard]] bool is_open() const noexcept { return open_; }
  [[nodiscard]] bool is_complete(const Keyframe& keyframe) const noexcept;
  /// Closes the keyframe: its scans, its frame as the odometry levels it, what is known of the
  /// sensor.
  void close(Keyframe& keyframe) noexcept;
  /// The keyframe is not to be sent: the slip is that of the next one.
  void keep_slip(const SlipCovariance& slip) noexcept { slip_ += slip; }

  /// The points of the open keyframe, or of the last one.
  [[nodiscard]] const ScanAccumulator& scans() const noexcept { return accumulator_; }
  /// Scans that the next keyframe will have if it closes as the last one did.
  [[nodiscard]] std::uint32_t expected_scans() const noexcept { return expected_scans_; }
  /// Images and spacing of rays, as measured.
  [[nodiscard]] const FreeSpaceConfig& free_space() const noexcept {
    return sampling_.free_space();
  }
  /// The pose that a scan of the window was used at, by the pose that came with it.
  [[nodiscard]] const Pose& used_pose(const Pose& T_odometry_sensor) const noexcept {
    return aligner_.used_pose(T_odometry_sensor);
  }

 private:
  void begin(const PointView& first_points, const Pose& first_pose, EvidenceWindow& window,
             Keyframe& keyframe) noexcept;
  void begin_scan(const PointView& points, const ScanOrigin& origin, EvidenceWindow& window,
                  Keyframe& keyframe) noexcept;
  [[nodiscard]] std::uint32_t points_cost(std::size_t points) const noexcept;
  void note_cost() noexcept;
  void paint(const PointView& points, EvidenceWindow& window, const Keyframe& keyframe) noexcept;

  KeyframeConfig keyframe_config_;
  VoxelConfig voxel_config_;
  std::size_t slice_points_;  ///< that a slice enters into cells
  bool paints_;
  std::int64_t (*clock_ns_)();
  ScanAccumulator accumulator_;
  RangePainter painter_;
  SamplingMonitor sampling_;
  GroundAligner aligner_;
  SlipCovariance slip_ = SlipCovariance::Zero();  ///< since the last keyframe was closed
  bool adding_ = false;                           ///< a scan was begun and is not added yet
  bool open_ = false;
  bool measuring_ = false;  ///< the first scan of the next keyframe is being measured
  bool measured_ = false;   ///< the first scan of the next keyframe was measured
  std::uint32_t expected_scans_ = 0;
  // Cost of 1024 points of the last scan that began a keyframe, and of the last one that did not:
  // the former enters most of the blocks.
  std::uint32_t first_scan_cost_ = 32;
  std::uint32_t later_scan_cost_ = 32;
  std::uint32_t blocks_before_ = 0;  ///< the scan that is being added
  bool sampling_changed_ = false;    ///< since the last keyframe closed
};

}  // namespace unimapper::onboard
