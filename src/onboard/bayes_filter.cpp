#include "bayes_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace unimapper::onboard {
namespace {

constexpr std::size_t kBatch = 256;

VoxelIndex moved(const VoxelIndex& cell, const VoxelIndex& by) noexcept {
  return {cell.x + by.x, cell.y + by.y, cell.z + by.z};
}

}  // namespace

void BayesFilter::attach(Arena& arena, const PipelineConfig& config) noexcept {
  free_space_ = config.free_space;
  removal_ = config.removal;
  row_ = arena.allocate<std::uint32_t>(config.voxel.max_cells);
  bit_ = arena.allocate<std::uint8_t>(config.voxel.max_cells);
  block_end_ = arena.allocate<std::uint32_t>(config.voxel.max_cells);
  x_ = arena.allocate<float>(config.voxel.max_cells);
  y_ = arena.allocate<float>(config.voxel.max_cells);
  z_ = arena.allocate<float>(config.voxel.max_cells);
  log_odds_ = arena.allocate<float>(config.voxel.max_cells);
  occupied_ = arena.allocate<std::uint8_t>(config.voxel.max_cells);
}

void BayesFilter::run(const EvidenceWindow& window, const ImageProjection& projection,
                      CellTable& cells) noexcept {
  collect_candidates(cells);
  for (std::uint32_t age = window.earlier_count(); age >= 1; --age) {
    const KeyframeEvidence& evidence = window.earlier(age);
    add_occupancy(evidence, cells);
    if (free_space_.columns) add_columns(evidence, cells);
    const Eigen::Vector3f offset =
        (cells.grid().origin_m() - evidence.grid.origin_m()).cast<float>();
    for (const RangeImage& image : evidence.painted()) add_image(image, projection, offset);
    clamp();
  }
  if (free_space_.own_keyframe) {
    for (const RangeImage& image : window.current().painted()) {
      add_image(image, projection, Eigen::Vector3f::Zero());
    }
  }
  for (std::uint32_t i = 0; i < size_; ++i) {
    // Probability above one half.
    if (log_odds_[i] > 0.0F) {
      cells.set_flag(row_[i], kCellDynamic);
      cells.set_flag(row_[i], kCellProven);
    }
    if (log_odds_[i] <= -removal_.firm_log_odds) cells.set_flag(row_[i], kCellFirm);
  }
}

void BayesFilter::collect_candidates(const CellTable& cells) noexcept {
  const FixedHashMap<Block>& blocks = cells.blocks();
  size_ = 0;
  block_count_ = blocks.size();
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      if ((cells.flags(row) & kCellCandidate) == 0) continue;
      row_[size_] = row;
      bit_[size_] = static_cast<std::uint8_t>(std::countr_zero(left));
      x_[size_] = cells.x()[row];
      y_[size_] = cells.y()[row];
      z_[size_] = cells.z()[row];
      log_odds_[size_] = 0.0F;
      ++size_;
    }
    block_end_[b] = size_;
  }
}

void BayesFilter::add_occupancy(const KeyframeEvidence& evidence, const CellTable& cells) noexcept {
  const GridShift shift = shift_between(cells.grid(), evidence.grid);
  if (!shift.representable) {
    std::fill_n(occupied_, size_, std::uint8_t{0});
    return;
  }
  // Grids are shifted by whole blocks: a block is one look-up and its cells are bits of one word.
  const VoxelIndex by = block_of(shift.cells);
  std::uint32_t first = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    const std::uint32_t end = block_end_[b];
    if (first == end) continue;
    const VoxelIndex here = unpack(cells.blocks().key(b));
    const std::uint32_t entry =
        evidence.blocks.find(pack({here.x + by.x, here.y + by.y, here.z + by.z}));
    const std::uint64_t mask =
        entry == FixedHashMap<BlockHistory>::kNotFound ? 0 : evidence.blocks[entry].occupied;
    for (; first < end; ++first) {
      const auto occupied = static_cast<std::uint8_t>(mask >> bit_[first] & 1U);
      occupied_[first] = occupied;
      log_odds_[first] -= occupied != 0 ? removal_.log_odds_occupied : 0.0F;
    }
  }
}

void BayesFilter::add_columns(const KeyframeEvidence& evidence, const CellTable& cells) noexcept {
  const GridShift shift = shift_between(cells.grid(), evidence.grid);
  if (!shift.representable) return;
  for (std::uint32_t i = 0; i < size_; ++i) {
    if (occupied_[i] != 0) continue;
    if (evidence.columns.is_free(moved(cells.index(row_[i]), shift.cells))) {
      log_odds_[i] += removal_.log_odds_free;
    }
  }
}

void BayesFilter::add_image(const RangeImage& image, const ImageProjection& projection,
                            const Eigen::Vector3f& image_grid_from_cells_m) noexcept {
  const Eigen::Matrix3f r = image.R_grid_sensor.transpose();
  const Eigen::Vector3f t = r * (image_grid_from_cells_m - image.t_grid_sensor);
  const float margin_scale = 1.0F + free_space_.range_margin_relative;
  const float margin = free_space_.range_margin_m;
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  float range_m[kBatch];
  std::int32_t pixel[kBatch];
  for (std::uint32_t first = 0; first < size_; first += kBatch) {
    const std::size_t size = std::min<std::size_t>(kBatch, size_ - first);
    for (std::size_t i = 0; i < size; ++i) {
      const float px = x_[first + i];
      const float py = y_[first + i];
      const float pz = z_[first + i];
      x[i] = r(0, 0) * px + r(0, 1) * py + r(0, 2) * pz + t.x();
      y[i] = r(1, 0) * px + r(1, 1) * py + r(1, 2) * pz + t.y();
      z[i] = r(2, 0) * px + r(2, 1) * py + r(2, 2) * pz + t.z();
    }
    projection.project(x, y, z, size, pixel, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      if (pixel[i] == ImageProjection::kOutside) continue;
      const std::uint16_t seen = image.pixels[pixel[i]];
      if (seen == kNoRange) continue;
      const float seen_m = static_cast<float>(seen) * (1.0F / kRangeUnitsPerMetre);
      const float near = range_m[i] * margin_scale + margin;
      const float far = 2.0F * range_m[i] - near;
      if (seen_m > near) {
        log_odds_[first + i] += removal_.log_odds_free;
      } else if (seen_m > far) {
        log_odds_[first + i] -= removal_.log_odds_weakly_occupied;
      }
    }
  }
}

void BayesFilter::clamp() noexcept {
  const float limit = removal_.log_odds_limit;
  for (std::uint32_t i = 0; i < size_; ++i) {
    log_odds_[i] = std::min(std::max(log_odds_[i], -limit), limit);
  }
}

}  // namespace unimapper::onboard
