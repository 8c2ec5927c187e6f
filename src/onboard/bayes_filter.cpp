#include "bayes_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace unimapper::onboard {
namespace {

constexpr std::size_t kBatch = 256;
constexpr std::uint32_t kAhead = 4;  ///< blocks whose history is loaded in advance

VoxelIndex moved(const VoxelIndex& cell, const VoxelIndex& by) noexcept {
  return {cell.x + by.x, cell.y + by.y, cell.z + by.z};
}

std::int32_t in_thousandths(float log_odds) noexcept {
  return static_cast<std::int32_t>(log_odds * 1000.0F + 0.5F);
}

/// How many of up to 63 words have each bit set: a counter per bit, the counters' digits side by
/// side, so that one addition serves 64 cells.
struct CellCounts {
  static constexpr std::int32_t kDigits = 6;
  std::uint64_t digit[kDigits] = {};

  [[nodiscard]] std::int32_t of(std::uint64_t cell) const noexcept {
    std::int32_t count = 0;
    for (std::int32_t d = 0; d < kDigits; ++d) count += (digit[d] & cell) != 0 ? 1 << d : 0;
    return count;
  }
};

CellCounts count_per_cell(std::span<const std::uint64_t> words) noexcept {
  CellCounts counts;
  for (const std::uint64_t word : words) {
    std::uint64_t carry = word;
    // All digits every time: where a carry ends cannot be predicted.
    for (std::uint64_t& digit : counts.digit) {
      const std::uint64_t both = digit & carry;
      digit ^= carry;
      carry = both;
    }
  }
  return counts;
}

}  // namespace

struct BayesFilter::Group {
  std::uint32_t size;
  // One entry per candidate.
  std::uint32_t row[kGroup];
  float x[kGroup];
  float y[kGroup];
  float z[kGroup];
  std::int32_t log_odds[kGroup];  ///< thousandths

  void add(const CellTable& cells, std::uint32_t cell, std::int32_t sum) noexcept {
    row[size] = cell;
    x[size] = cells.x()[cell];
    y[size] = cells.y()[cell];
    z[size] = cells.z()[cell];
    log_odds[size] = sum;
    ++size;
  }
  /// A block is never split: there is room for another one.
  [[nodiscard]] bool has_room() const noexcept { return size + Block::kCells <= kGroup; }
};

void BayesFilter::attach(Arena& arena, const PipelineConfig& config) noexcept {
  free_space_ = config.free_space;
  log_odds_ = {in_thousandths(config.removal.log_odds_free),
               in_thousandths(config.removal.log_odds_occupied),
               in_thousandths(config.removal.log_odds_weakly_occupied),
               in_thousandths(config.removal.firm_log_odds),
               in_thousandths(config.removal.most_carried_log_odds)};
  met_again_ = arena.allocate<Group>(1);
  new_ = arena.allocate<Group>(1);
  sums_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
  sums_before_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
}

void BayesFilter::run(const EvidenceWindow& window, const ImageProjection& projection,
                      CellTable& cells) noexcept {
  met_again_->size = new_->size = 0;
  std::fill_n(sums_, cells.size(), kNotJudged);
  for (std::uint32_t block = 0; block < cells.blocks().size(); ++block) {
    if (!met_again_->has_room()) finish_met_again(window, projection, cells);
    if (!new_->has_room()) finish_new(window, projection, cells);
    prefetch(window.blocks(), block + kAhead);
    collect(window, cells, block);
  }
  finish_met_again(window, projection, cells);
  finish_new(window, projection, cells);
  std::swap(sums_, sums_before_);
}

void BayesFilter::prefetch(const BlockWindow& blocks, std::uint32_t block) const noexcept {
  if (block >= blocks.numbered()) return;
  const std::span<const std::uint64_t> history = blocks.occupied(block);
  __builtin_prefetch(&history.front());
  __builtin_prefetch(&history.back());
  __builtin_prefetch(sums_before_ + blocks.before(block).first);
}

void BayesFilter::collect(const EvidenceWindow& window, const CellTable& cells,
                          std::uint32_t b) noexcept {
  const Block& block = cells.blocks()[b];
  const std::uint64_t candidates = cells.marks(b).candidate;
  const BlockHistory before = window.blocks().before(b);
  std::uint64_t unknown = candidates;
  if (log_odds_.most_carried > 0) {
    for (std::uint64_t left = candidates & before.occupied; left != 0; left &= left - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint64_t lower = (std::uint64_t{1} << bit) - 1U;
      const std::int16_t sum = sums_before_[before.first + count_bits(before.occupied & lower)];
      if (sum == kNotJudged) continue;
      met_again_->add(cells, row_of(block, bit), sum - log_odds_.occupied);
      unknown &= ~lowest_bit(left);
    }
  }
  if (unknown == 0) return;
  const CellCounts met = count_per_cell(window.blocks().occupied(b));
  for (std::uint64_t left = unknown; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    // Occupied in the current keyframe, too, which is no evidence.
    const std::int32_t times = met.of(lowest_bit(left)) - 1;
    new_->add(cells, row_of(block, bit), -log_odds_.occupied * times);
  }
}

void BayesFilter::finish_met_again(const EvidenceWindow& window, const ImageProjection& projection,
                                   CellTable& cells) noexcept {
  if (met_again_->size == 0) return;
  if (free_space_.columns) add_columns(*met_again_, window.blocks(), window.earlier(1), 1, cells);
  // The images of the keyframe before were weighed there if those of the own keyframe count.
  const KeyframeEvidence& latest = free_space_.own_keyframe ? window.current() : window.earlier(1);
  add_images(*met_again_, latest, 1, projection, cells);
  decide(*met_again_, cells);
}

void BayesFilter::finish_new(const EvidenceWindow& window, const ImageProjection& projection,
                             CellTable& cells) noexcept {
  for (std::uint32_t age = window.earlier_count(); age >= 1; --age) {
    const KeyframeEvidence& evidence = window.earlier(age);
    if (free_space_.columns) add_columns(*new_, window.blocks(), evidence, age, cells);
    add_images(*new_, evidence, free_space_.earlier_image_stride, projection, cells);
  }
  if (free_space_.own_keyframe) add_images(*new_, window.current(), 1, projection, cells);
  decide(*new_, cells);
}

void BayesFilter::add_columns(Group& group, const BlockWindow& blocks,
                              const KeyframeEvidence& evidence, std::uint32_t age,
                              const CellTable& cells) const noexcept {
  const GridShift shift = shift_between(cells.grid(), evidence.grid);
  if (!shift.representable) return;
  for (std::uint32_t i = 0; i < group.size; ++i) {
    const std::uint32_t row = group.row[i];
    const std::uint64_t occupied = blocks.occupied(cells.block_of_row(row), age);
    if ((occupied >> cells.bit_of_row(row) & 1U) != 0) continue;
    if (evidence.columns.is_free(moved(cells.index(row), shift.cells))) {
      group.log_odds[i] += log_odds_.free;
    }
  }
}

void BayesFilter::add_images(Group& group, const KeyframeEvidence& evidence, std::uint32_t stride,
                             const ImageProjection& projection,
                             const CellTable& cells) const noexcept {
  const Eigen::Vector3f offset = (cells.grid().origin_m() - evidence.grid.origin_m()).cast<float>();
  const std::span<const RangeImage> images = evidence.painted();
  for (std::size_t i = images.empty() ? 0 : (images.size() - 1) % stride; i < images.size();
       i += stride) {
    add_image(group, images[i], projection, offset);
  }
}

void BayesFilter::add_image(Group& group, const RangeImage& image,
                            const ImageProjection& projection,
                            const Eigen::Vector3f& image_grid_from_cells_m) const noexcept {
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
        group.log_odds[first + i] += free_at(range_m[i]);
      } else if (seen_m > far) {
        group.log_odds[first + i] -= log_odds_.weakly_occupied;
      }
    }
  }
}

std::int32_t BayesFilter::free_at(float range_m) const noexcept {
  const float sure_m = free_space_.sure_range_m;
  if (!(sure_m > 0.0F) || range_m <= sure_m) return log_odds_.free;
  return static_cast<std::int32_t>(static_cast<float>(log_odds_.free) * sure_m / range_m);
}

void BayesFilter::decide(Group& group, CellTable& cells) noexcept {
  const std::int32_t most = log_odds_.most_carried;
  for (std::uint32_t i = 0; i < group.size; ++i) {
    const std::uint32_t row = group.row[i];
    const std::int32_t sum = group.log_odds[i];
    // Probability above one half.
    if (sum > 0) {
      cells.set(row, &CellMarks::dynamic);
      cells.set(row, &CellMarks::proven);
    }
    if (sum <= -log_odds_.firm) cells.set(row, &CellMarks::firm);
    sums_[row] = static_cast<std::int16_t>(std::clamp(sum, -most, most));
  }
  group.size = 0;
}

}  // namespace unimapper::onboard
