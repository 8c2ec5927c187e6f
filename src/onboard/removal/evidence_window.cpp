#include "evidence_window.hpp"

#include <algorithm>

#include "src/onboard/sampling/sampling_monitor.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::onboard {

void KeyframeEvidence::observe(std::uint32_t stride, const Grid& points_grid,
                               const ObservedPoints& points) const noexcept {
  const Eigen::Vector3f offset = (points_grid.origin_m() - grid.origin_m()).cast<float>();
  for (std::uint32_t i = image_count == 0 ? 0 : (image_count - 1) % stride; i < image_count;
       i += stride) {
    const Eigen::Matrix3f r = images[i].R_grid_sensor.transpose();
    const Eigen::Vector3f t = r * (offset - images[i].t_grid_sensor);
    model.add(images[i].pixels, projection, r, t, points);
  }
}

void EvidenceWindow::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  const std::size_t pixels_per_image = SamplingMonitor::max_pixels(config.free_space);
  executor_ = config.executor;
  free_space_ = config.free_space;
  weights_ = EvidenceWeights::of(config.removal);
  blocks_.allocate(arena, config);
  slot_count_ = config.removal.window + 1;
  scans_per_keyframe_ = config.keyframe.scans;
  images_per_keyframe_ = config.free_space.images_per_keyframe;
  last_scan_unknown_ = config.keyframe.distance_m > 0.0F;
  for (std::uint32_t i = 0; i < slot_count_; ++i) {
    KeyframeEvidence& slot = slots_[i];
    slot.columns.allocate(arena, config.free_space.columns ? config.voxel.max_blocks() : 0);
    if (!config.free_space.visibility) continue;
    slot.images = arena.allocate<RangeImage>(images_per_keyframe_);
    for (std::uint32_t image = 0; image < images_per_keyframe_; ++image) {
      auto* const pixels = arena.allocate<std::uint16_t>(pixels_per_image);
      if (slot.images != nullptr) slot.images[image].pixels = pixels;
    }
  }
}

void EvidenceWindow::follow(const FreeSpaceConfig& free_space) noexcept {
  free_space_ = free_space;
}

void EvidenceWindow::begin(const Grid& grid) noexcept {
  KeyframeEvidence& slot = current();
  slot.grid = grid;
  slot.shape = free_space_.image_shape();
  slot.projection = ImageProjection(slot.shape);
  slot.model = {VisibilityTest(free_space_.range_margin_m, EvidenceDefaults::kRangeMarginRelative),
                weights_, free_space_.full_weight_range_m};
  slot.full_weight_range_m = free_space_.full_weight_range_m;
  slot.image_count = 0;
  slot.columns.clear();
  blocks_.begin(grid);
}

RangeImage* EvidenceWindow::image_for(std::uint32_t scan, const Pose& T_odometry_sensor) noexcept {
  KeyframeEvidence& slot = current();
  const std::uint32_t gaps = std::max(images_per_keyframe_, 2U) - 1;
  const bool due = scan * gaps >= slot.image_count * (scans_per_keyframe_ - 1);
  std::uint32_t at = slot.image_count;
  if (!due || at == images_per_keyframe_) {
    if (!last_scan_unknown_ || images_per_keyframe_ < 2) return nullptr;
    // Any scan may turn out to be the last one: the latest image is kept up to date.
    at = std::max(at, 2U) - 1;
  }
  RangeImage& image = slot.images[at];
  image.scan = scan;
  image.R_grid_sensor = T_odometry_sensor.rotation.cast<float>();
  image.t_grid_sensor = (T_odometry_sensor.translation - slot.grid.origin_m()).cast<float>();
  slot.image_count = std::max(slot.image_count, at + 1);
  return &image;
}

void EvidenceWindow::leave_out_ground(const CellTable& cells) noexcept {
  for_slices(executor_, {0, blocks_.numbered()}, kBlocksPerPart,
             [&](Slice some, std::uint32_t) noexcept {
               for (std::uint32_t b = some.first; b < some.end; ++b) {
                 const std::uint64_t ground = cells.marks(b).ground;
                 if (ground != 0) blocks_.leave_out(b, ground);
               }
             });
}

void EvidenceWindow::record(const CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for_slices(executor_, {0, blocks_.numbered()}, kBlocksPerPart,
             [&](Slice some, std::uint32_t) noexcept {
               for (std::uint32_t i = some.first; i < some.end; ++i) {
                 const CellMarks& marks = cells.marks(i);
                 blocks_.record(i, {blocks[i].occupied, marks.dynamic, marks.proven & marks.dynamic,
                                    blocks[i].first});
               }
             });
  blocks_.advance();
  current_ = (current_ + 1) % slot_count_;
  earlier_ = std::min(earlier_ + 1, slot_count_ - 1);
}

}  // namespace unimapper::onboard
