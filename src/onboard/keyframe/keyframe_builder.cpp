#include "keyframe_builder.hpp"

#include <algorithm>

#include "grid.hpp"
#include "src/onboard/stage_clock.hpp"

namespace unimapper::onboard {
namespace {

void count_points(const ScanCounts& counts, Keyframe& keyframe) noexcept {
  keyframe.statistics.points_in += counts.points;
  keyframe.statistics.points_valid += counts.valid;
  keyframe.dropped(DropCause::kNotFinite) += counts.not_finite;
  keyframe.dropped(DropCause::kOutOfRange) += counts.out_of_range;
  keyframe.dropped(DropCause::kScanTooLarge) += counts.beyond_capacity;
  keyframe.dropped(DropCause::kCellsFull) += counts.no_cell;
}

}  // namespace

void KeyframeBuilder::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  accumulator_.allocate(arena, config);
  painter_.allocate(arena, {.shape = config.free_space.image_shape(),
                            .range_min_m = config.keyframe.range_min_m,
                            .range_max_m = config.keyframe.range_max_m,
                            .max_points = config.keyframe.max_points_per_scan,
                            .max_pixels = SamplingMonitor::max_pixels(config.free_space)});
  sampling_.allocate(arena, config);
  aligner_.allocate(arena, config);
  expected_scans_ = config.keyframe.scans;
}

bool KeyframeBuilder::measure(const PointView& first_points) noexcept {
  if (measured_) return false;
  if (!measuring_) sampling_.begin();
  measuring_ = sampling_.step(first_points);
  measured_ = !measuring_;
  return measuring_;
}

bool KeyframeBuilder::add_step(const PointView& points, const ScanOrigin& origin,
                               EvidenceWindow& window, Keyframe& keyframe) noexcept {
  if (!adding_) {
    begin_scan(points, origin, window, keyframe);
    adding_ = true;
    return true;
  }
  const StageTimer timer(clock_ns_, keyframe.statistics, Stage::kIngest);
  adding_ = accumulator_.add_points(points, slice_points_, window.blocks());
  if (adding_) return true;
  count_points(accumulator_.counts(), keyframe);
  note_cost();
  paint(points, window, keyframe);
  return false;
}

void KeyframeBuilder::begin_scan(const PointView& points, const ScanOrigin& origin,
                                 EvidenceWindow& window, Keyframe& keyframe) noexcept {
  // What does not fit the scan's capacity is never looked at.
  PointView fitting = points;
  fitting.count = std::min<std::size_t>(points.count, keyframe_config_.max_points_per_scan);
  if (!open_) begin(fitting, origin.T_odometry_sensor, window, keyframe);
  open_ = true;
  const Pose used = aligner_.align(fitting, origin.T_odometry_sensor);
  accumulator_.begin_scan(used);
  blocks_before_ = accumulator_.cells().block_count();
  keyframe.scans[accumulator_.scans()] = {origin.index, origin.stamp_ns, used};
  keyframe.statistics.aligned_scans += aligner_.aligned() ? 1 : 0;
  slip_ += origin.slip;
  sampling_.add_pose(origin.T_odometry_sensor);
}

void KeyframeBuilder::begin(const PointView& first_points, const Pose& first_pose,
                            EvidenceWindow& window, Keyframe& keyframe) noexcept {
  const Grid grid = grid_near(first_pose.translation, voxel_config_);
  keyframe.statistics = {};
  while (measure(first_points)) {
  }
  measured_ = false;
  if (sampling_.has_changed()) {
    painter_.reshape(sampling_.free_space().image_shape());
    window.follow(sampling_.free_space());
    sampling_changed_ = true;
  }
  accumulator_.begin(grid);
  window.begin(grid);
}

void KeyframeBuilder::note_cost() noexcept {
  const std::uint32_t new_blocks = accumulator_.cells().block_count() - blocks_before_;
  (accumulator_.scans() == 1 ? first_scan_cost_ : later_scan_cost_) =
      slice_cost::of_1024_points(accumulator_.counts(), new_blocks);
}

/// Of so many points of the scan that is added, or of the next one.
std::uint32_t KeyframeBuilder::points_cost(std::size_t points) const noexcept {
  const bool first = accumulator_.scans() == 0 || !open_;
  return slice_cost::of_points(points, first ? first_scan_cost_ : later_scan_cost_);
}

std::uint32_t KeyframeBuilder::step_cost(std::size_t points) const noexcept {
  if (!is_adding()) return slice_cost::kBeginningScan;
  return points_cost(std::min(points - accumulator_.added(), slice_points_));
}

std::uint32_t KeyframeBuilder::cost_left(std::size_t points) const noexcept {
  if (is_adding()) return points_cost(points - accumulator_.added());
  return slice_cost::kBeginningScan + points_cost(points);
}

void KeyframeBuilder::paint(const PointView& points, EvidenceWindow& window,
                            const Keyframe& keyframe) noexcept {
  if (!paints_) return;
  const std::uint32_t scan = accumulator_.scans() - 1;
  RangeImage* const image = window.image_for(scan, keyframe.scans[scan].T_odometry_sensor);
  if (image != nullptr) painter_.paint(points, image->pixels);
}

bool KeyframeBuilder::is_complete(const Keyframe& keyframe) const noexcept {
  const std::uint32_t count = accumulator_.scans();
  if (count >= keyframe_config_.scans) return true;
  const Eigen::Vector3d travelled = keyframe.scans[count - 1].T_odometry_sensor.translation -
                                    keyframe.scans[0].T_odometry_sensor.translation;
  const auto distance_m = static_cast<double>(keyframe_config_.distance_m);
  return distance_m > 0.0 && travelled.squaredNorm() >= distance_m * distance_m;
}

void KeyframeBuilder::close(Keyframe& keyframe) noexcept {
  open_ = false;
  if (is_complete(keyframe)) expected_scans_ = accumulator_.scans();
  KeyframeView& view = keyframe.view;
  view.scans = {keyframe.scans, accumulator_.scans()};
  view.reference_scan = accumulator_.scans() / 2;
  view.T_odometry_keyframe = level_frame(keyframe.scans[view.reference_scan].T_odometry_sensor);
  // Half of what a keyframe may have, so that rounding makes none invalid.
  const float most = std::max(slip_.maxCoeff(), 1.0F);
  view.slip = slip_ * std::min(1.0F, 0.5F * kMostSlip_m2 / most);
  slip_.setZero();
  view.points_in = keyframe.statistics.points_in;
  keyframe.statistics.attitude_noise_deg = aligner_.noise_deg();
  keyframe.statistics.sweep_tilt_deg = aligner_.sweep_tilt_deg();
  if (sampling_.close()) sampling_changed_ = true;
  keyframe.statistics.sampling = sampling_.statistics();
  keyframe.statistics.cells = accumulator_.cells().size();
  keyframe.use(Capacity::kPointsPerScan, accumulator_.largest_scan(),
               keyframe_config_.max_points_per_scan);
  keyframe.use(Capacity::kCells, keyframe.statistics.cells, voxel_config_.max_cells);
  keyframe.sampling_changed = sampling_changed_;
  sampling_changed_ = false;
}

}  // namespace unimapper::onboard
