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

struct BayesFilter::Worker {
  Group known;  ///< candidates of the keyframe before, too
  Group fresh;
};

void BayesFilter::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  free_space_ = config.free_space;
  log_odds_ = {EvidenceWeights::of(config.removal),
               in_thousandths(config.removal.confirmed_static_log_odds),
               in_thousandths(RemovalConfig::kConfirmedDynamicLogOdds),
               in_thousandths(config.removal.log_odds_clamp), 0};
  log_odds_.store = std::min(std::max(log_odds_.clamp, log_odds_.confirmed_static), 30000);
  executor_ = config.executor;
  workers_ = arena.allocate<Worker>(executor_.workers);
  slice_blocks_ = slice_size(config, kSliceBlocks);
  sums_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
  sums_before_ = arena.allocate<std::int16_t>(config.voxel.max_cells);
}

void BayesFilter::begin(const EvidenceWindow& window, const CellTable& cells) noexcept {
  for (std::uint32_t i = 0; i < executor_.workers; ++i) {
    workers_[i].known.size = workers_[i].fresh.size = 0;
  }
  loop_.begin();
  const std::uint32_t own = free_space_.own_keyframe ? window.current().image_count : 0;
  images_ = own;
  for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
    images_ += 1 + window.earlier(age).image_count / free_space_.earlier_image_stride;
  }
  latest_images_ = own != 0 || window.earlier_count() == 0 ? own : window.earlier(1).image_count;
  std::fill_n(sums_, cells.size(), kNoCandidate);
  begin_slices(window, cells);
}

bool BayesFilter::step(const EvidenceWindow& window, CellTable& cells) noexcept {
  const Slice some = next_slice();
  for_slices(executor_, some, is_deferred() ? kRun : kBlocksPerPart,
             [&](Slice part, std::uint32_t worker) noexcept {
               collect_all(window, cells, part, workers_[worker]);
             });
  slice_.first = some.end;
  const bool is_last = slice_.size() == 0 && loop_.is_over();
  // A deferred slice leaves no candidates to the next one: what it takes follows from its own.
  if (is_deferred() || is_last) {
    for_parts(executor_, executor_.workers, [&](std::uint32_t part, std::uint32_t) noexcept {
      finish_known(window, cells, workers_[part].known);
      finish_new(window, cells, workers_[part].fresh);
    });
  }
  if (!is_last) {
    if (slice_.size() == 0) begin_slices(window, cells);
    return true;
  }
  std::swap(sums_, sums_before_);
  rows_ = cells.size();
  return false;
}

void BayesFilter::begin_slices(const EvidenceWindow& window, const CellTable& cells) noexcept {
  slice_ = loop_.next(static_cast<std::uint32_t>(cells.blocks().size()), slice_blocks_);
  if (!is_deferred()) return;
  slices_begin_ = slice_.first;
  const std::uint32_t runs = (slice_.size() + kRun - 1) / kRun;
  for_parts(executor_, runs, [&](std::uint32_t run, std::uint32_t) noexcept {
    const std::uint32_t first = slice_.first + run * kRun;
    projections_[run] = 0;
    for (std::uint32_t b = first; b < std::min(first + kRun, slice_.end); ++b) {
      const std::uint32_t fresh = new_of(window, cells, b);
      const std::uint32_t known = popcount(cells.marks(b).candidate) - fresh;
      projections_[run] += fresh * images_ + known * latest_images_;
    }
  });
}

Slice BayesFilter::next_slice() const noexcept {
  if (!is_deferred() || slice_.size() == 0) return slice_;
  std::uint32_t run = (slice_.first - slices_begin_) / kRun;
  std::uint32_t end = slice_.first;
  std::uint32_t sum = 0;
  do {
    sum += projections_[run++];
    end = std::min(end + kRun, slice_.end);
  } while (end < slice_.end && sum + projections_[run] <= kSliceProjections);
  return {slice_.first, end};
}

std::uint32_t BayesFilter::step_projections() const noexcept {
  if (!is_deferred()) return 0;
  const Slice some = next_slice();
  std::uint32_t sum = 0;
  for (std::uint32_t b = some.first; b < some.end; b += kRun) {
    sum += projections_[(b - slices_begin_) / kRun];
  }
  return sum;
}

std::uint32_t BayesFilter::new_of(const EvidenceWindow& window, const CellTable& cells,
                                  std::uint32_t b) const noexcept {
  const std::uint64_t candidates = cells.marks(b).candidate;
  if (candidates == 0) return 0;
  const BlockHistory before = window.blocks().before(b);
  const std::uint64_t known = log_odds_.clamp > 0 ? candidates & before.occupied : 0;
  std::uint32_t count = popcount(candidates & ~known);
  for (std::uint64_t left = known; left != 0; left &= left - 1) {
    const std::uint32_t rank = popcount(before.occupied & (lowest_bit(left) - 1U));
    count += sums_before_[before.first + rank] == kNoCandidate ? 1U : 0U;
  }
  return count;
}

void BayesFilter::collect_all(const EvidenceWindow& window, CellTable& cells, Slice blocks,
                              Worker& worker) noexcept {
  for (std::uint32_t b = blocks.first; b < blocks.end; ++b) {
    if (!worker.known.has_room()) finish_known(window, cells, worker.known);
    if (!worker.fresh.has_room()) finish_new(window, cells, worker.fresh);
    prefetch(window.blocks(), b + kHistoryAhead);
    collect(window, cells, b, worker);
  }
}

void BayesFilter::prefetch(const BlockWindow& blocks, std::uint32_t block) const noexcept {
  if (block >= blocks.numbered()) return;
  const std::span<const std::uint64_t> history = blocks.occupied(block);
  prefetch_for_read(&history.front());
  prefetch_for_read(&history.back());
  prefetch_for_read(sums_before_ + blocks.before(block).first);
}

void BayesFilter::collect(const EvidenceWindow& window, const CellTable& cells, std::uint32_t b,
                          Worker& worker) const noexcept {
  const std::uint64_t candidates = cells.marks(b).candidate;
  if (candidates == 0) return;
  const Block& block = cells.blocks()[b];
  const BlockHistory before = window.blocks().before(b);
  const std::int16_t* const sums_before = sums_before_ + before.first;
  const std::uint64_t occupied_before = log_odds_.clamp > 0 ? before.occupied : 0;
  Group& fresh = worker.fresh;
  const std::uint32_t first_new = fresh.size;
  std::uint32_t row = block.first;
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1, ++row) {
    const std::uint64_t cell = lowest_bit(left);
    if ((candidates & cell) == 0) continue;
    std::int32_t sum = kNoCandidate;
    if ((occupied_before & cell) != 0) sum = sums_before[popcount(before.occupied & (cell - 1U))];
    if (sum == kNoCandidate) {
      fresh.add(cells, row, 0);
    } else {
      const std::int32_t carried = std::clamp(sum, -log_odds_.clamp, log_odds_.clamp);
      worker.known.add(cells, row, carried - log_odds_.weights.occupied);
    }
  }
  if (fresh.size == first_new) return;
  const CellCounts occupied(window.blocks().occupied(b));
  for (std::uint32_t i = first_new; i < fresh.size; ++i) {
    // Occupied in the current keyframe, too, which is no evidence.
    const std::int32_t times = occupied.of(cells.bit_of_row(fresh.row[i])) - 1;
    fresh.log_odds[i] = -log_odds_.weights.occupied * times;
  }
}

void BayesFilter::finish_known(const EvidenceWindow& window, CellTable& cells,
                               Group& known) noexcept {
  if (known.size == 0) return;
  if (free_space_.columns) add_columns(known, window.blocks(), window.earlier(1), 1, cells);
  // Its own images were weighed with the keyframe before if images of the own keyframe count.
  const KeyframeEvidence& latest = free_space_.own_keyframe ? window.current() : window.earlier(1);
  latest.observe(1, cells.grid(), known.points());
  decide(known, cells);
}

void BayesFilter::finish_new(const EvidenceWindow& window, CellTable& cells,
                             Group& fresh) noexcept {
  for (std::uint32_t age = window.earlier_count(); age >= 1; --age) {
    const KeyframeEvidence& evidence = window.earlier(age);
    if (free_space_.columns) add_columns(fresh, window.blocks(), evidence, age, cells);
    evidence.observe(free_space_.earlier_image_stride, cells.grid(), fresh.points());
  }
  if (free_space_.own_keyframe) {
    window.current().observe(1, cells.grid(), fresh.points());
  }
  decide(fresh, cells);
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
