// Order of closing a keyframe, from its last scan to its labels
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "src/core/parts.hpp"
#include "src/onboard/pipeline_state.hpp"
#include "src/onboard/removal/stray_returns.hpp"
#include "src/onboard/stage_clock.hpp"
#include "unimapper/core/angles.hpp"

namespace unimapper {

using namespace onboard;

void Pipeline::State::close() noexcept {
  if (!builder.is_open() || closing != Closing::kNone) return;
  closing = Closing::kBegin;
  closing_cost = 0;
  if (!config.deferred) close_now();
}

void Pipeline::State::close_after_last_scan() noexcept {
  if (waiting.is_empty()) return close();
  waiting.back().closes = true;
}

/// The order of everything, from the last scan of a keyframe to its labels.
void Pipeline::State::close_step() noexcept {
  switch (closing) {
    case Closing::kBegin:
      begin_closing();
      break;
    case Closing::kRemoval:
      if (removal.step(builder.scans().cells(), window)) return;
      break;
    case Closing::kComponents:
      if (relabels_beside()) {
        classify_and_relabel();
      } else if (removal.classify_step(window)) {
        return;
      }
      break;
    case Closing::kDecision:
      decide();
      break;
    case Closing::kOutput:
      if (output.step(window.blocks(), removal.cells(), removal.voxels())) return;
      break;
    case Closing::kRecord:
      record();
      break;
    case Closing::kCalibration:
      if (calibration.step()) return;
      break;
    case Closing::kCounting:
      count_points();
      break;
    case Closing::kAnnouncement:
      announce();
      break;
    case Closing::kNone:
      return;
  }
  closing = static_cast<Closing>(static_cast<std::uint8_t>(closing) + 1U);
}

/// All of it at once, and what would be deferred.
void Pipeline::State::close_now() noexcept {
  close_step();
  remove_now();
  const bool is_kept = !current->view.repeats;
  if (is_kept) {
    finisher.begin(*current);
    finisher.finish_now();
  }
  close_step();
  close_step();
  if (is_kept) tell_finished();
}

void Pipeline::State::remove_now() noexcept {
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kRemoval);
  while (closing < Closing::kCounting) close_step();
}

void Pipeline::State::begin_closing() noexcept {
  current->view = {};
  builder.close(*current);
  standing.close(current->view.scans);
  removal.begin(builder.scans().grid(), viewpoint());
}

void Pipeline::State::classify_and_relabel() noexcept {
  finisher.labels().begin_evicted(window, finished_untold);
  finisher.labels().step(window, classify_components, this);
}

void Pipeline::State::decide() noexcept {
  const bool is_relabelled = relabels_beside();
  current->view.repeats = standing.repeats(window.blocks(), removal.cells());
  current->view.sequence = current->view.repeats ? sequence - 1 : sequence++;
  if (current->view.repeats) {
    builder.keep_slip(current->view.slip);
  } else {
    if (!is_relabelled) finisher.begin_labels(window, finished_untold);
    // Neither needs the other: two workers do them at the same time.
    for_parts(config.executor, 2, [this](std::uint32_t part, std::uint32_t) noexcept {
      if (part == 0) {
        finisher.store_labels(window, removal.cells(), *current);
      } else {
        find_up();
      }
    });
  }
  output.begin(window.blocks(), removal.cells(), current->view.T_odometry_keyframe,
               builder.scans().intensities());
}

void Pipeline::State::record() noexcept {
  if (current->view.repeats) {
    window.discard();
    removal.discard();
  } else {
    window.record(removal.cells());
    write_images();
  }
  write_view();
}

void Pipeline::State::announce() noexcept {
  current->spent_us = config.deferred ? longest_call_us : budget.spent_us();
  current->statistics.deadline_missed = budget.is_missed_by(current->spent_us);
  current->statistics.late_slices = std::exchange(late_slices, 0);
  longest_call_us = 0.0F;
  const std::uint64_t blocks = std::max(builder.scans().cells().block_count(), 1U);
  cost_of_1024_blocks = static_cast<std::uint32_t>(closing_cost * std::uint64_t{1024} / blocks);
  if (!current->view.repeats) events.closed(*current);
  events.odometry(odometry, current->view);
  events.calibration(calibration, current->view);
  closed = std::exchange(current, closed);
  ready_untold = true;
  if (config.deferred && !closed->view.repeats) finisher.begin(*closed);
}

Viewpoint Pipeline::State::viewpoint() const noexcept {
  const Eigen::Vector3d& sensor = current->view.T_odometry_keyframe.translation;
  const FreeSpaceConfig& measured = builder.free_space();
  return {(sensor - builder.scans().grid().origin_m()).cast<float>(), measured.ray_spacing_deg,
          onboard::stray_range_m(measured, config.keyframe, config.voxel.fine_size_m)};
}

void Pipeline::State::find_up() noexcept {
  const GravityScene scene = gravity_planes.collect(removal.cells(), removal.voxels());
  const UpEstimate& estimate = gravity.add(scene);
  KeyframeStatistics& statistics = current->statistics;
  KeyframeView& view = current->view;
  statistics.walls = static_cast<std::uint32_t>(scene.walls.size());
  statistics.up_known = estimate.known;
  statistics.up_contradicted = estimate.contradicted;
  if (!estimate.known) return;
  Pose& frame = view.T_odometry_keyframe;
  frame = level_frame(view.scans[view.reference_scan].T_odometry_sensor, estimate.up);
  const Eigen::Matrix3d covariance =
      frame.rotation.transpose() * estimate.covariance * frame.rotation;
  view.up = {true, static_cast<float>(covariance(0, 0)), static_cast<float>(covariance(0, 1)),
             static_cast<float>(covariance(1, 1))};
  const auto level = static_cast<float>(estimate.up.head<2>().norm());
  statistics.odometry_tilt_deg =
      360.0F * direction_turns(static_cast<float>(estimate.up.z()), level);
}

void Pipeline::State::write_view() noexcept {
  KeyframeView& view = current->view;
  removal.tell(*current);
  view.static_cells = output.static_cells();
  view.dynamic_cells = output.dynamic_cells();
  current->statistics.dynamic_cells = static_cast<std::uint32_t>(view.dynamic_cells.size());
  const KeyframeScan& scan = view.scans[view.reference_scan];
  if (is_shut_in(view.static_cells, view.dynamic_cells)) {
    odometry.add_shut_in(scan, current->statistics.dynamic_cells, current->statistics.cells);
  } else {
    odometry.add(current->statistics.dynamic_cells, current->statistics.cells,
                 scan.T_odometry_sensor.translation.z());
  }
  view.odometry_contradicted = odometry.is_contradicted();
  view.statistics = &current->statistics;
  current->use(Capacity::kBlocks, window.blocks().size(), window.blocks().capacity());
}

void Pipeline::State::write_images() noexcept {
  KeyframeView& view = current->view;
  const KeyframeEvidence& recorded = window.earlier(1);
  const std::span<const RangeImage> painted = recorded.painted();
  for (std::size_t i = 0; i < painted.size(); ++i) {
    current->images[i] = {painted[i].scan, {painted[i].pixels, recorded.projection.pixels()}};
  }
  view.image_shape = recorded.shape;
  view.cell_size_m = config.voxel.fine_size_m;
  view.image_full_weight_range_m = recorded.full_weight_range_m;
  view.images = {current->images, painted.size()};
}

void Pipeline::State::count_points() noexcept {
  KeyframeStatistics& statistics = current->statistics;
  const std::uint64_t invalid =
      statistics.dropped_by(DropCause::kNotFinite) + statistics.dropped_by(DropCause::kOutOfRange);
  statistics.points_dynamic = output.count_dynamic(builder.scans());
  statistics.points_static = statistics.points_in - invalid - statistics.points_dynamic;
  current->view.points_dynamic = statistics.points_dynamic;
}

}  // namespace unimapper
