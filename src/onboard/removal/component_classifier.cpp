#include "component_classifier.hpp"

#include <algorithm>
#include <bit>

#include "src/onboard/slice_cost.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::onboard {

void ComponentClassifier::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  config_ = config.removal;
  slice_blocks_ = slice_size(config, 4096);
  confirmed_static_ = in_thousandths(std::min(config.removal.confirmed_static_log_odds, 30.0F));
  // Blocks have 1.3 parts each at most, with every sensor measured, and are no more than 0.6 of
  // those there is room for.
  const std::size_t max_parts = config.voxel.max_blocks() + config.voxel.max_blocks() / 2;
  labels_.allocate(arena, config.voxel.max_blocks(), max_parts);
  tally_ = arena.allocate<ComponentTally>(max_parts);
  outcome_ = arena.allocate<Outcome>(max_parts);
  cell_m_ = config.voxel.fine_size_m;
  clusters_.allocate(arena, config);
}

void ComponentClassifier::begin() noexcept {
  labels_.begin();
  loop_.begin();
  task_ = Task::kSplit;
}

bool ComponentClassifier::step(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                               const Viewpoint& viewpoint, CellTable& cells) noexcept {
  const auto blocks = static_cast<std::uint32_t>(cells.blocks().size());
  const auto neighbour = [&](std::uint32_t b, const BlockOffset& offset) noexcept {
    return window.neighbour(b, offset);
  };
  if (task_ == Task::kSpread) {
    const auto signs = [&](std::uint32_t b) noexcept { return signs_of(window, cells, b); };
    if (!labels_.spread(blocks, slice_blocks_, signs, neighbour)) task_ = Task::kFollow;
    return true;
  }
  const Slice some = loop_.next(blocks, slice_blocks_);
  switch (task_) {
    case Task::kSplit:
      labels_.split(some, blocks, [&](std::uint32_t b) noexcept {
        const std::uint64_t following = followers(window, cells, b);
        return LabelledCells{cells.marks(b).candidate & ~following, following};
      });
      break;
    case Task::kSpread:
      break;
    case Task::kFollow:
      labels_.add_low(some, blocks, neighbour);
      break;
    case Task::kCount:
      if (some.first == 0) {
        components_ = labels_.size();
        std::fill_n(tally_, components_, ComponentTally{});
      }
      count(window, log_odds, cells, some);
      clusters_.collect(log_odds, cells, some);
      if (loop_.is_over()) decide_all(viewpoint);
      break;
    case Task::kMark:
      mark(cells, some);
      break;
    case Task::kClusters:
      clusters_.mark(window, log_odds, labels_, tally_, cells);
      task_ = Task::kDone;
      return false;
    case Task::kDone:
      return false;
  }
  if (loop_.is_over()) {
    task_ = static_cast<Task>(static_cast<std::uint8_t>(task_) + 1U);
    loop_.begin();
  }
  return true;
}

std::uint32_t ComponentClassifier::step_cost() const noexcept {
  switch (task_) {
    case Task::kSplit:
      return slice_cost::kParts;
    case Task::kSpread:
      return slice_cost::kSpreading;
    case Task::kFollow:
      return slice_cost::kFollowing;
    case Task::kCount:
      return slice_cost::kTallies;
    case Task::kMark:
      return slice_cost::kMarking;
    case Task::kClusters:
      return slice_cost::kClusters;
    case Task::kDone:
      break;
  }
  return slice_cost::kBookkeeping;
}

void ComponentClassifier::count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                                const CellTable& cells, Slice some_blocks) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = some_blocks.first; b < some_blocks.end; ++b) {
    labels_.visit(b, [&](std::uint32_t component, std::uint64_t some) noexcept {
      ComponentTally& tally = tally_[component];
      count_cells(tally, some, blocks[b], log_odds, window.before(b));
      if (tally.box.width() > kWidestPole) return;
      const std::uint64_t high = some & ~cells.marks(b).follower;
      if (high != 0) tally.box.include(blocks[b].index, high);
    });
  }
}

void ComponentClassifier::count_cells(ComponentTally& tally, std::uint64_t cells,
                                      const Block& block, std::span<const std::int16_t> log_odds,
                                      const BlockHistory& before) const noexcept {
  tally.cells += popcount(cells);
  std::int32_t all = 0;
  std::int32_t positive = 0;
  visit_rows(block, cells, [&](std::uint64_t, std::uint32_t row) noexcept {
    const std::int32_t sum =
        std::clamp<std::int32_t>(log_odds[row], -confirmed_static_, confirmed_static_);
    all += sum;
    positive += std::max(sum, 0);
  });
  tally.evidence += static_cast<std::uint32_t>(2 * positive - all);  // sum of the magnitudes
  tally.evidence_dynamic += static_cast<std::uint32_t>(positive);
  tally.was_dynamic += popcount(cells & before.proven);
  tally.was_static += popcount(cells & before.occupied & ~before.dynamic);
}

bool ComponentClassifier::persists(const ComponentTally& tally) const noexcept {
  return config_.persistence_share > 0.0F && tally.was_dynamic > 0 &&
         static_cast<float>(tally.was_dynamic) >=
             config_.persistence_share * static_cast<float>(tally.cells) &&
         tally.was_dynamic >= 2 * tally.was_static;
}

bool ComponentClassifier::may_be_missed(const ComponentTally& tally, Outline outline,
                                        const Viewpoint& viewpoint) const noexcept {
  if (!(viewpoint.ray_spacing_deg > 0.0F)) return false;
  const CellBox& box = tally.box;
  float squared_m = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const float middle_m = 0.5F * cell_m_ * static_cast<float>(box.low[axis] + box.high[axis] + 1);
    const float away_m = middle_m - viewpoint.sensor_m[axis];
    squared_m += away_m * away_m;
  }
  const float resolved_m =
      config_.pole_width_m * static_cast<float>(kDegreesPerRadian) / viewpoint.ray_spacing_deg;
  if (squared_m <= resolved_m * resolved_m) return false;
  if (outline == Outline::kPole) return true;
  constexpr float kUndisputed = 0.75F;
  const bool disputed =
      static_cast<float>(tally.evidence_dynamic) < kUndisputed * static_cast<float>(tally.evidence);
  return disputed || 2 * (tally.was_dynamic + tally.was_static) >= tally.cells;
}

ComponentClassifier::Outcome ComponentClassifier::decide(
    const ComponentTally& tally, const Viewpoint& viewpoint) const noexcept {
  const Outline outline =
      config_.pole_width_m > 0.0F ? outline_of(tally.box, cell_m_) : Outline::kWide;
  if (outline == Outline::kWide) {
    if (persists(tally)) return Outcome::kPersists;
  } else if (may_be_missed(tally, outline, viewpoint)) {
    return Outcome::kThin;
  }
  switch (classify(tally.evidence_dynamic, tally.evidence, config_.component_dynamic_share,
                   EvidenceDefaults::kComponentStaticShare)) {
    case ComponentClass::kDynamic:
      return Outcome::kDynamic;
    case ComponentClass::kStatic:
      return Outcome::kStatic;
    case ComponentClass::kMixed:
      break;
  }
  return Outcome::kMixed;
}

void ComponentClassifier::decide_all(const Viewpoint& viewpoint) noexcept {
  for (std::uint32_t c = 0; c < components_; ++c) outcome_[c] = decide(tally_[c], viewpoint);
}

void ComponentClassifier::mark(CellTable& cells, Slice some_blocks) noexcept {
  for (std::uint32_t b = some_blocks.first; b < some_blocks.end; ++b) {
    labels_.visit(b, [&](std::uint32_t component, std::uint64_t some) noexcept {
      mark_block(b, some, outcome_[component], cells.marks(b));
    });
  }
}

void ComponentClassifier::mark_block(std::uint32_t b, std::uint64_t cells, Outcome outcome,
                                     CellMarks& marks) noexcept {
  switch (outcome) {
    case Outcome::kThin:
      marks.dynamic &= ~cells;
      break;
    case Outcome::kPersists:
      marks.dynamic |= cells;
      marks.proven |= cells;
      break;
    case Outcome::kDynamic:
      marks.dynamic |= cells & ~(marks.confirmed_static & ~marks.follower);
      break;
    case Outcome::kStatic:
      marks.dynamic &= ~(cells & ~marks.confirmed_dynamic);
      return;
    case Outcome::kMixed:
      return;
  }
  clusters_.leave_out(b, cells);
}

}  // namespace unimapper::onboard
