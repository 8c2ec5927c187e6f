#include "final_labels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "cell_counts.hpp"
#include "src/free_space/relabelling.hpp"

namespace unimapper::onboard {
namespace {

/// Static cells that so many later keyframes observed stay static, whatever images say.
constexpr std::int32_t kStaticObservations = 3;
/// As many images of each keyframe are used: the others repeat them.
constexpr std::uint32_t kImagesPerKeyframe = 2;

constexpr std::uint32_t kHistoryAhead = 8;  ///< blocks whose history is loaded in advance

/// Zones of equal area, rings around the origin of a keyframe's grid, which is next to its first
/// scan: the first has a radius of 16 blocks, blocks beyond the last one belong to it.
constexpr std::uint32_t kZones = 512;

std::uint32_t zone_of(const VoxelIndex& block) noexcept {
  const auto squared = [](std::int32_t a) {
    return static_cast<std::uint64_t>(std::int64_t{a} * a);
  };
  const std::uint64_t zone = (squared(block.x) + squared(block.y)) >> 8U;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(zone, kZones - 1));
}

// A block's place: its index above its entry in the window. 13 bits an axis are 0.8 km to each side
// with the smallest cells, more than any range.
constexpr std::uint32_t kAxisBits = 13;
constexpr std::uint32_t kEntryBits = 64 - 3 * kAxisBits;
constexpr std::int32_t kAxisLimit = 1 << (kAxisBits - 1);

bool has_place(const VoxelIndex& index, std::uint32_t entry) noexcept {
  const auto fits = [](std::int32_t a) { return a >= -kAxisLimit && a < kAxisLimit; };
  return fits(index.x) && fits(index.y) && fits(index.z) && entry >> kEntryBits == 0;
}

std::uint64_t place_of(const VoxelIndex& index, std::uint32_t entry) noexcept {
  const auto bits = [](std::int32_t a) { return static_cast<std::uint64_t>(a + kAxisLimit); };
  return ((bits(index.x) << kAxisBits | bits(index.y)) << kAxisBits | bits(index.z)) << kEntryBits |
         entry;
}

std::int32_t axis_of(std::uint64_t place, std::uint32_t axis) noexcept {
  const std::uint64_t bits = place >> (kEntryBits + (2 - axis) * kAxisBits);
  return static_cast<std::int32_t>(bits & ((1U << kAxisBits) - 1)) - kAxisLimit;
}

/// Cells that are static without enough evidence.
std::uint64_t open_cells(const CellMarks& marks) noexcept {
  return marks.candidate & ~marks.dynamic & ~marks.confirmed_static;
}

/// The outermost zone that there is still room for, and how much: blocks.
struct Reach {
  std::uint32_t zone = 0;
  std::uint32_t room = 0;

  /// Whether a block may be stored, which takes room if it lies in that zone.
  bool admits(std::uint32_t block_zone) noexcept {
    if (block_zone != zone) return block_zone < zone;
    return room > 0 && room-- > 0;
  }
};

/// How far `room` undecided blocks of a keyframe reach.
Reach reach_of(std::uint32_t room, const CellTable& cells) noexcept {
  std::uint32_t blocks[kZones] = {};
  for (std::uint32_t b = 0; b < cells.blocks().size(); ++b) {
    const CellMarks& marks = cells.marks(b);
    if ((marks.dynamic | open_cells(marks)) != 0) ++blocks[zone_of(cells.blocks()[b].index)];
  }
  Reach reach{0, room};
  while (reach.zone < kZones && blocks[reach.zone] <= reach.room) {
    reach.room -= blocks[reach.zone++];
  }
  return reach;
}

}  // namespace

VoxelIndex FinalLabels::OpenBlock::index() const noexcept {
  return {axis_of(place, 0), axis_of(place, 1), axis_of(place, 2)};
}

std::uint32_t FinalLabels::OpenBlock::entry() const noexcept {
  return static_cast<std::uint32_t>(place & ((1U << kEntryBits) - 1));
}

struct FinalLabels::Group {
  std::uint32_t size;
  std::uint32_t blocks;
  float x[kGroup];
  float y[kGroup];
  float z[kGroup];
  std::int32_t log_odds[kGroup];
  // One entry per block.
  std::uint32_t block[kGroup];   ///< its number among the open ones
  std::uint64_t open[kGroup];    ///< its undecided static cells but those that stay static
  std::uint32_t first[kGroup];   ///< its first cell
  std::int32_t decided[kGroup];  ///< evidence for its cells that stay static

  /// For all cells of another block; blocks may have none left.
  [[nodiscard]] bool has_room() const noexcept {
    return size + Block::kCells <= kGroup && blocks < kGroup;
  }
};

void FinalLabels::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  on_ = config.removal.final_labels && config.free_space.visibility;
  if (!on_) return;
  prior_ = in_thousandths(EvidenceDefaults::kPriorLogOdds);
  occupied_ = in_thousandths(config.removal.log_odds_occupied);
  confirmed_static_ = in_thousandths(std::min(config.removal.confirmed_static_log_odds, 30.0F));
  stride_ = std::max(1U, config.free_space.images_per_keyframe / kImagesPerKeyframe);
  // Most blocks hold nothing but ground and confirmed static cells. With a window of ten there is
  // room for two fifths of a keyframe's blocks.
  keyframe_capacity_ = config.removal.window + 1;
  capacity_ = std::max(config.voxel.max_cells, keyframe_capacity_);
  open_ = arena.allocate<OpenBlock>(capacity_);
  executor_ = config.executor;
  slice_cells_ = slice_size(config, kGroup);
  groups_ = arena.allocate<Group>(executor_.workers);
  changed_.allocate(arena, config.voxel.max_cells / 16 + 1);
}

void FinalLabels::drop_oldest() noexcept {
  if (is_in_progress()) progress_ = Progress::kNone;
  std::copy(keyframes_ + 1, keyframes_ + stored_, keyframes_);
  --stored_;
}

void FinalLabels::store(const EvidenceWindow& window, const CellTable& cells,
                        std::uint32_t sequence) noexcept {
  if (!on_) return;
  not_stored_ = 0;
  if (stored_ == keyframe_capacity_) drop_oldest();
  const BlockWindow& blocks = window.blocks();
  Stored now{sequence, blocks.keyframe(), next_, 0, 0, cells.grid()};
  Reach reach = reach_of(capacity_ / keyframe_capacity_, cells);
  for (std::uint32_t b = 0; b < cells.blocks().size(); ++b) {
    const CellMarks& marks = cells.marks(b);
    const std::uint64_t open = open_cells(marks);
    if ((marks.dynamic | open) == 0) continue;
    const VoxelIndex& index = cells.blocks()[b].index;
    const std::uint32_t entry = blocks.entry(b);
    if (!reach.admits(zone_of(index)) || !has_place(index, entry)) {
      ++not_stored_;
      continue;
    }
    ring(next_) = {marks.dynamic, open, place_of(index, entry)};
    next_ = (next_ + 1) % capacity_;
    ++now.count;
    now.cells += popcount(marks.dynamic | open);
  }
  keyframes_[stored_++] = now;
}

bool FinalLabels::begin_evicted(const EvidenceWindow& window, bool keeps_result) noexcept {
  const BlockWindow& blocks = window.blocks();
  progress_ = Progress::kNone;
  result_.available = result_.available && keeps_result;
  if (!on_) return false;
  // Keyframes that were evicted early are gone.
  while (stored_ > 0 && blocks.age_of(keyframes_[0].keyframe) > blocks.earlier_count()) {
    drop_oldest();
  }
  if (stored_ == 0 || blocks.age_of(keyframes_[0].keyframe) < blocks.longest_age()) return false;
  begin_first(blocks.keyframe());
  return true;
}

bool FinalLabels::begin_oldest(const EvidenceWindow& window) noexcept {
  result_.available = false;
  if (!on_ || stored_ == 0) return false;
  begin_first(window.blocks().keyframe() - 1);
  return true;
}

void FinalLabels::begin_first(std::uint32_t latest) noexcept {
  latest_ = latest;
  next_block_ = cells_passed_ = 0;
  progress_ = Progress::kBegun;
}

void FinalLabels::start(const BlockWindow& blocks) noexcept {
  const Stored& keyframe = keyframes_[0];
  grid_ = keyframe.grid;
  changed_.clear();
  result_ = {false, keyframe.sequence, blocks.age_of(keyframe.keyframe) - blocks.age_of(latest_), 0,
             0};
  for (std::uint32_t i = 0; i < executor_.workers; ++i) groups_[i].size = groups_[i].blocks = 0;
  progress_ = Progress::kUnderWay;
}

bool FinalLabels::step(const EvidenceWindow& window, void (*beside)(void*),
                       void* context) noexcept {
  if (!is_in_progress()) {
    if (beside != nullptr) beside(context);
    return false;
  }
  if (progress_ == Progress::kBegun) start(window.blocks());
  const Stored& keyframe = keyframes_[0];
  const Ages ages{window.blocks().age_of(keyframe.keyframe), window.blocks().age_of(latest_)};
  const Slice some = next_slice();
  constexpr std::uint32_t kOpenBlocksPerPart = 64;
  const Cut cut(executor_, some, kOpenBlocksPerPart);
  const std::uint32_t first = beside == nullptr ? 0 : 1;
  for_parts(executor_, first + cut.parts(), [&](std::uint32_t part, std::uint32_t worker) noexcept {
    if (part < first) return beside(context);
    Group& group = groups_[worker];
    const Slice own = cut[part - first];
    for (std::uint32_t b = own.first; b < own.end; ++b) {
      if (!group.has_room()) finish_group(window, ages, group);
      window.blocks().prefetch_entry(ring(keyframe.first + b + kHistoryAhead).entry());
      add(window.blocks(), b, ages, group);
    }
  });
  for_parts(executor_, executor_.workers, [&](std::uint32_t part, std::uint32_t) noexcept {
    finish_group(window, ages, groups_[part]);
  });
  for (std::uint32_t b = some.first; b < some.end; ++b) take(ring(keyframe.first + b));
  if (next_block_ < keyframe.count) return true;
  progress_ = Progress::kDone;
  result_.available = true;
  drop_oldest();
  return false;
}

Slice FinalLabels::next_slice() noexcept {
  const Stored& keyframe = keyframes_[0];
  const std::uint32_t first = next_block_;
  std::uint32_t cells = 0;
  for (; next_block_ < keyframe.count && cells <= slice_cells_ - Block::kCells; ++next_block_) {
    const OpenBlock& block = ring(keyframe.first + next_block_);
    cells += popcount(block.dynamic | block.open);
  }
  cells_passed_ += cells;
  return {first, next_block_};
}

std::uint32_t FinalLabels::steps_left() const noexcept {
  if (!is_in_progress()) return 0;
  // A step ends when there is no room for another full block.
  const std::uint32_t least = slice_cells_ - Block::kCells + 1;
  return 1 + (keyframes_[0].cells - cells_passed_) / least;
}

void FinalLabels::add(const BlockWindow& blocks, std::uint32_t open_block, const Ages& ages,
                      Group& group) noexcept {
  const OpenBlock& block = ring(keyframes_[0].first + open_block);
  const auto [age, latest_age] = ages;
  group.block[group.blocks] = open_block;
  group.open[group.blocks] = block.open;
  group.first[group.blocks] = group.size;
  const std::uint32_t number = group.blocks++;
  group.decided[number] = 0;
  const float size_m = grid_.cell_size_m;
  const VoxelIndex index = block.index();
  const std::uint32_t entry = block.entry();
  std::uint64_t occupied_later[RemovalConfig::kMaxWindow + 1];
  blocks.occupied_entry(entry, latest_age, age, occupied_later);
  const CellCounts occupied({occupied_later, age - latest_age});
  for (std::uint64_t left = block.dynamic | block.open; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    const VoxelIndex cell = cell_in(index, bit);
    const std::int32_t prior = (block.dynamic >> bit & 1U) != 0 ? prior_ : 0;
    const std::int32_t sum = prior - occupied_ * occupied.of(bit);
    if ((block.open >> bit & 1U) != 0 && sum <= -kStaticObservations * occupied_) {
      group.open[number] &= ~(std::uint64_t{1} << bit);
      group.decided[number] += std::max(sum, -confirmed_static_);
      continue;
    }
    group.x[group.size] = (static_cast<float>(cell.x) + 0.5F) * size_m;
    group.y[group.size] = (static_cast<float>(cell.y) + 0.5F) * size_m;
    group.z[group.size] = (static_cast<float>(cell.z) + 0.5F) * size_m;
    group.log_odds[group.size] = sum;
    ++group.size;
  }
}

void FinalLabels::finish_group(const EvidenceWindow& window, const Ages& ages,
                               Group& group) noexcept {
  const ObservedPoints points{group.x, group.y, group.z, group.log_odds, group.size};
  for (std::uint32_t later = ages.latest_age; later < ages.age; ++later) {
    const KeyframeEvidence& evidence = later == 0 ? window.current() : window.earlier(later);
    evidence.observe(stride_, grid_, points);
  }
  for (std::uint32_t b = 0; b < group.blocks; ++b) {
    // Nothing else reads the block any more: what changes takes its place until it is taken down.
    OpenBlock& block = ring(keyframes_[0].first + group.block[b]);
    block.open = group.open[b];
    const Changed change = change_of(block, group.log_odds + group.first[b], group.decided[b]);
    block.dynamic = change.now_dynamic;
    block.open = change.now_static;
  }
  group.size = group.blocks = 0;
}

FinalLabels::Changed FinalLabels::change_of(const OpenBlock& block, const std::int32_t* log_odds,
                                            std::int32_t decided) const noexcept {
  const std::uint64_t undecided = block.dynamic | block.open;
  EvidenceSum evidence;
  const std::int32_t* sum = log_odds;
  for (std::uint64_t left = undecided; left != 0; left &= left - 1) {
    evidence.add(std::clamp(*sum++, -confirmed_static_, confirmed_static_), 0);
  }
  evidence.log_odds += decided;
  // Kept cells are removed only if there is one more observation of every cell against them.
  const ComponentClass all = class_by_mean(evidence, occupied_);
  std::uint64_t dynamic = 0;
  sum = log_odds;
  for (std::uint64_t left = undecided; left != 0; left &= left - 1, ++sum) {
    const std::uint64_t cell = lowest_bit(left);
    const bool was_dynamic = (cell & block.dynamic) != 0;
    if (is_dynamic_relabelled(all, {was_dynamic, *sum <= -confirmed_static_,
                                    was_dynamic && *sum >= confirmed_static_})) {
      dynamic |= cell;
    }
  }
  return {dynamic & block.open, ~dynamic & block.dynamic};
}

void FinalLabels::take(const OpenBlock& block) noexcept {
  const Changed change{block.dynamic, block.open};
  if ((change.now_dynamic | change.now_static) == 0) return;
  const std::uint32_t entry = changed_.find_or_insert(pack(block.index()));
  if (entry == FixedHashMap<Changed>::kNotFound) return;
  changed_[entry] = change;
  result_.cells_now_dynamic += popcount(change.now_dynamic);
  result_.cells_now_static += popcount(change.now_static);
}

std::size_t FinalLabels::relabel(const PointView& points, const Pose& T_odometry_sensor,
                                 std::span<PointLabel> labels) const noexcept {
  if (!result_.available || changed_.size() == 0) return 0;
  const double per_metre = 1.0 / static_cast<double>(grid_.cell_size_m);
  const Eigen::Matrix3f r = (T_odometry_sensor.rotation * per_metre).cast<float>();
  const Eigen::Vector3f t =
      ((T_odometry_sensor.translation - grid_.origin_m()) * per_metre).cast<float>();
  std::size_t changed = 0;
  for (std::size_t i = 0; i < std::min(points.count, labels.size()); ++i) {
    if (labels[i] == PointLabel::kUnknown) continue;
    const Eigen::Vector3f p = points[i];
    const VoxelIndex cell{
        floor_to_int(r(0, 0) * p.x() + r(0, 1) * p.y() + r(0, 2) * p.z() + t.x()),
        floor_to_int(r(1, 0) * p.x() + r(1, 1) * p.y() + r(1, 2) * p.z() + t.y()),
        floor_to_int(r(2, 0) * p.x() + r(2, 1) * p.y() + r(2, 2) * p.z() + t.z())};
    if (!is_representable(cell)) continue;
    const std::uint32_t entry = changed_.find(pack(block_of(cell)));
    if (entry == FixedHashMap<Changed>::kNotFound) continue;
    const std::uint64_t bit = std::uint64_t{1} << bit_of(cell);
    const bool now_dynamic = (changed_[entry].now_dynamic & bit) != 0;
    const bool now_static = (changed_[entry].now_static & bit) != 0;
    const PointLabel before = labels[i];
    if (now_dynamic) labels[i] = PointLabel::kDynamic;
    if (now_static) labels[i] = PointLabel::kStatic;
    changed += labels[i] != before ? 1 : 0;
  }
  return changed;
}

}  // namespace unimapper::onboard
