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

std::int32_t in_thousandths(float log_odds) noexcept {
  return static_cast<std::int32_t>(log_odds * 1000.0F + 0.5F);
}

/// How many of up to 63 words have each bit set: a counter per bit, the counters' digits side by
/// side, so that one addition serves 64 cells.
struct CellCounts {
  std::uint64_t digit[6] = {};

  [[nodiscard]] std::int32_t of(std::uint64_t cell) const noexcept {
    std::int32_t count = 0;
    for (std::int32_t d = 0; d < 6; ++d) count += (digit[d] & cell) != 0 ? 1 << d : 0;
    return count;
  }
};

CellCounts count_per_cell(std::span<const std::uint64_t> words) noexcept {
  CellCounts counts;
  for (const std::uint64_t word : words) {
    std::uint64_t carry = word;
    for (std::uint32_t d = 0; d < 6 && carry != 0; ++d) {
      const std::uint64_t both = counts.digit[d] & carry;
      counts.digit[d] ^= carry;
      carry = both;
    }
  }
  return counts;
}

}  // namespace

struct BayesFilter::Group {
  std::uint32_t size;
  std::uint32_t first_block;
  std::uint32_t blocks;
  std::uint32_t block_end[kGroup];  ///< per block: one past its last candidate
  // One entry per candidate, in the order of the table's rows.
  std::uint32_t row[kGroup];
  std::uint8_t bit[kGroup];  ///< number within its block
  float x[kGroup];
  float y[kGroup];
  float z[kGroup];
  std::int32_t log_odds[kGroup];  ///< thousandths
};

void BayesFilter::attach(Arena& arena, const PipelineConfig& config) noexcept {
  free_space_ = config.free_space;
  log_odds_ = {in_thousandths(config.removal.log_odds_free),
               in_thousandths(config.removal.log_odds_occupied),
               in_thousandths(config.removal.log_odds_weakly_occupied),
               in_thousandths(config.removal.firm_log_odds)};
  group_ = arena.allocate<Group>(1);
}

void BayesFilter::run(const EvidenceWindow& window, const ImageProjection& projection,
                      CellTable& cells) noexcept {
  for (std::uint32_t block = 0; block < cells.blocks().size();) {
    block = collect(window.blocks(), cells, block);
    add_window(window, projection, cells);
    decide(cells);
  }
}

std::uint32_t BayesFilter::collect(const BlockWindow& window, const CellTable& cells,
                                   std::uint32_t first_block) noexcept {
  Group& group = *group_;
  const std::span<const Block> blocks = cells.blocks();
  std::uint32_t size = 0;
  std::uint32_t b = first_block;
  // A block is never split; with 64 cells at most it fits while so much room is left.
  for (; b < blocks.size() && b - first_block < kGroup && size + 64 <= kGroup; ++b) {
    const CellCounts met = count_per_cell(window.occupied(b));
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      if ((cells.flags(row) & kCellCandidate) == 0) continue;
      group.row[size] = row;
      group.bit[size] = static_cast<std::uint8_t>(std::countr_zero(left));
      group.x[size] = cells.x()[row];
      group.y[size] = cells.y()[row];
      group.z[size] = cells.z()[row];
      group.log_odds[size] = -log_odds_.occupied * met.of(left & (~left + 1));
      ++size;
    }
    group.block_end[b - first_block] = size;
  }
  group.size = size;
  group.first_block = first_block;
  group.blocks = b - first_block;
  return b;
}

void BayesFilter::add_window(const EvidenceWindow& window, const ImageProjection& projection,
                             const CellTable& cells) noexcept {
  for (std::uint32_t age = window.earlier_count(); age >= 1; --age) {
    const KeyframeEvidence& evidence = window.earlier(age);
    if (free_space_.columns) add_columns(window.blocks(), evidence, age, cells);
    const Eigen::Vector3f offset =
        (cells.grid().origin_m() - evidence.grid.origin_m()).cast<float>();
    const std::span<const RangeImage> images = evidence.painted();
    const std::uint32_t stride = free_space_.earlier_image_stride;
    for (std::size_t i = images.empty() ? 0 : (images.size() - 1) % stride; i < images.size();
         i += stride) {
      add_image(images[i], projection, offset);
    }
  }
  if (!free_space_.own_keyframe) return;
  for (const RangeImage& image : window.current().painted()) {
    add_image(image, projection, Eigen::Vector3f::Zero());
  }
}

void BayesFilter::add_columns(const BlockWindow& blocks, const KeyframeEvidence& evidence,
                              std::uint32_t age, const CellTable& cells) noexcept {
  Group& group = *group_;
  const GridShift shift = shift_between(cells.grid(), evidence.grid);
  if (!shift.representable) return;
  std::uint32_t at = 0;
  for (std::uint32_t b = 0; b < group.blocks; ++b) {
    const std::uint32_t end = group.block_end[b];
    if (at == end) continue;
    const std::uint64_t occupied = blocks.occupied(group.first_block + b, age);
    for (; at < end; ++at) {
      if ((occupied >> group.bit[at] & 1U) != 0) continue;
      if (evidence.columns.is_free(moved(cells.index(group.row[at]), shift.cells))) {
        group.log_odds[at] += log_odds_.free;
      }
    }
  }
}

void BayesFilter::add_image(const RangeImage& image, const ImageProjection& projection,
                            const Eigen::Vector3f& image_grid_from_cells_m) noexcept {
  Group& group = *group_;
  const Eigen::Matrix3f r = image.R_grid_sensor.transpose();
  const Eigen::Vector3f t = r * (image_grid_from_cells_m - image.t_grid_sensor);
  const float margin_scale = 1.0F + free_space_.range_margin_relative;
  const float margin = free_space_.range_margin_m;
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  float range_m[kBatch];
  std::int32_t pixel[kBatch];
  for (std::uint32_t first = 0; first < group.size; first += kBatch) {
    const std::size_t size = std::min<std::size_t>(kBatch, group.size - first);
    for (std::size_t i = 0; i < size; ++i) {
      const float px = group.x[first + i];
      const float py = group.y[first + i];
      const float pz = group.z[first + i];
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
        group.log_odds[first + i] += log_odds_.free;
      } else if (seen_m > far) {
        group.log_odds[first + i] -= log_odds_.weakly_occupied;
      }
    }
  }
}

void BayesFilter::decide(CellTable& cells) const noexcept {
  const Group& group = *group_;
  for (std::uint32_t i = 0; i < group.size; ++i) {
    // Probability above one half.
    if (group.log_odds[i] > 0) {
      cells.set_flag(group.row[i], kCellDynamic);
      cells.set_flag(group.row[i], kCellProven);
    }
    if (group.log_odds[i] <= -log_odds_.firm) cells.set_flag(group.row[i], kCellFirm);
  }
}

}  // namespace unimapper::onboard
