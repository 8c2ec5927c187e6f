#include "bayes_filter.hpp"

#include <algorithm>
#include <bit>

#include "cell_counts.hpp"
#include "src/core/prefetch.hpp"

namespace unimapper::onboard {
namespace {

constexpr std::uint32_t kHistoryAhead = 4;  ///< blocks whose history is loaded in advance

VoxelIndex moved(const VoxelIndex& cell, const VoxelIndex& by) noexcept {
  return {cell.x + by.x, cell.y + by.y, cell.z + by.z};
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
  [[nodiscard]] ObservedPoints points() noexcept { return {x, y, z, log_odds, size}; }
  /// A block is never split: there is room for another one.
  [[nodiscard]] bool has_room() const noexcept { return size + Block::kCells <= kGroup; }
};

void BayesFilter::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  free_space_ = config.free_space;
  log_odds_ = {EvidenceWeights::of(config.removal),
               in_thousandths(config.removal.confirmed_static_log_odds),
               in_thousandths(RemovalConfig::kConfirmedDynamicLogOdds),
               in_thousandths(config.removal.log_odds_clamp), 0};
  log_odds_.store = std::min(std::max(log_odds_.clamp, log_odds_.confirmed_static), 30000);
  known_ = arena.allocate<Group>(1);
  new_ = arena.allocate<Group>(1);
  sums_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
  sums_before_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
}

void BayesFilter::begin(const EvidenceWindow& window, const CellTable& cells) noexcept {
  known_->size = new_->size = 0;
  next_block_ = 0;
  images_ = free_space_.own_keyframe ? window.current().image_count : 0;
  for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
    images_ += 1 + window.earlier(age).image_count / free_space_.earlier_image_stride;
  }
  std::fill_n(sums_, cells.size(), kNoCandidate);
}

bool BayesFilter::step(const EvidenceWindow& window, CellTable& cells) noexcept {
  constexpr std::uint32_t kMostBlocks = 4096;
  constexpr std::uint32_t kMostProjections = 1U << 16U;
  const auto block_count = static_cast<std::uint32_t>(cells.blocks().size());
  const std::uint32_t end = std::min(block_count - next_block_, kMostBlocks) + next_block_;
  std::uint32_t projections = 0;
  for (; next_block_ < end && projections < kMostProjections; ++next_block_) {
    if (!known_->has_room()) finish_known(window, cells);
    if (!new_->has_room()) {
      finish_new(window, cells);
      projections += kGroup * images_;
    }
    prefetch(window.blocks(), next_block_ + kHistoryAhead);
    collect(window, cells, next_block_);
  }
  if (next_block_ < block_count) return true;
  finish_known(window, cells);
  finish_new(window, cells);
  std::swap(sums_, sums_before_);
  rows_ = cells.size();
  return false;
}

void BayesFilter::prefetch(const BlockWindow& blocks, std::uint32_t block) const noexcept {
  if (block >= blocks.numbered()) return;
  const std::span<const std::uint64_t> history = blocks.occupied(block);
  prefetch_for_read(&history.front());
  prefetch_for_read(&history.back());
  prefetch_for_read(sums_before_ + blocks.before(block).first);
}

void BayesFilter::collect(const EvidenceWindow& window, const CellTable& cells,
                          std::uint32_t b) noexcept {
  const std::uint64_t candidates = cells.marks(b).candidate;
  if (candidates == 0) return;
  const Block& block = cells.blocks()[b];
  const BlockHistory before = window.blocks().before(b);
  const std::int16_t* const sums_before = sums_before_ + before.first;
  const std::uint64_t occupied_before = log_odds_.clamp > 0 ? before.occupied : 0;
  const std::uint32_t first_new = new_->size;
  std::uint32_t row = block.first;
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1, ++row) {
    const std::uint64_t cell = lowest_bit(left);
    if ((candidates & cell) == 0) continue;
    std::int32_t sum = kNoCandidate;
    if ((occupied_before & cell) != 0) sum = sums_before[popcount(before.occupied & (cell - 1U))];
    if (sum == kNoCandidate) {
      new_->add(cells, row, 0);
    } else {
      const std::int32_t carried = std::clamp(sum, -log_odds_.clamp, log_odds_.clamp);
      known_->add(cells, row, carried - log_odds_.weights.occupied);
    }
  }
  if (new_->size == first_new) return;
  const CellCounts occupied(window.blocks().occupied(b));
  for (std::uint32_t i = first_new; i < new_->size; ++i) {
    // Occupied in the current keyframe, too, which is no evidence.
    const std::int32_t times = occupied.of(cells.bit_of_row(new_->row[i])) - 1;
    new_->log_odds[i] = -log_odds_.weights.occupied * times;
  }
}

void BayesFilter::finish_known(const EvidenceWindow& window, CellTable& cells) noexcept {
  if (known_->size == 0) return;
  if (free_space_.columns) add_columns(*known_, window.blocks(), window.earlier(1), 1, cells);
  // Its own images were weighed with the keyframe before if images of the own keyframe count.
  const KeyframeEvidence& latest = free_space_.own_keyframe ? window.current() : window.earlier(1);
  latest.observe(1, cells.grid(), known_->points());
  decide(*known_, cells);
}

void BayesFilter::finish_new(const EvidenceWindow& window, CellTable& cells) noexcept {
  for (std::uint32_t age = window.earlier_count(); age >= 1; --age) {
    const KeyframeEvidence& evidence = window.earlier(age);
    if (free_space_.columns) add_columns(*new_, window.blocks(), evidence, age, cells);
    evidence.observe(free_space_.earlier_image_stride, cells.grid(), new_->points());
  }
  if (free_space_.own_keyframe) {
    window.current().observe(1, cells.grid(), new_->points());
  }
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
      group.log_odds[i] += log_odds_.weights.free;
    }
  }
}

void BayesFilter::decide(Group& group, CellTable& cells) noexcept {
  const std::int32_t most = log_odds_.store;
  for (std::uint32_t i = 0; i < group.size; ++i) {
    const std::uint32_t row = group.row[i];
    const std::int32_t sum = group.log_odds[i];
    // Probability above one half.
    if (sum > 0) {
      cells.set(row, &CellMarks::dynamic);
      cells.set(row, &CellMarks::proven);
      if (sum >= log_odds_.confirmed_dynamic) cells.set(row, &CellMarks::confirmed_dynamic);
    }
    if (sum <= -log_odds_.confirmed_static) cells.set(row, &CellMarks::confirmed_static);
    sums_[row] = static_cast<std::int16_t>(std::clamp(sum, -most, most));
  }
  group.size = 0;
}

}  // namespace unimapper::onboard
