#include "unimapper/place/describer.hpp"

#include <algorithm>
#include <cmath>

#include "local_ground.hpp"
#include "plane_voxels.hpp"
#include "src/core/fixed_vector.hpp"
#include "src/core/parts.hpp"
#include "src/core/quantise.hpp"
#include "structure_map.hpp"

namespace unimapper {

using namespace place;

namespace {

// Cells farther above or below the sensor are not described (and would not fit the grids).
constexpr float kMaxHeight = 200.0F;
// Upright planes are looked for at this height above the ground, where walls are seen best.
constexpr float kWallHeight = 1.5F;
// A corner's response in the units of `Keypoint::strength`.
constexpr float kStrengthScale = 100.0F;
// Bounds of one step.
constexpr std::size_t kSelectedPerStep = 16384;
constexpr std::size_t kEnteredPerStep = 8192;
constexpr std::uint32_t kFitsPerStep = 1024;

}  // namespace

class PlaceDescriber::State {
 public:
  void allocate(Arena& arena, const DescriptorConfig& config,
                const DescriptorInput& input) noexcept;
  void allocate_scratch(Arena& arena, const DescriptorConfig& config,
                        const DescriptorInput& input) noexcept {
    structure_cells_.allocate(arena, input.max_cells);
    ground_.allocate(arena, config);
    planes_.allocate_scratch(arena, config);
    structure_.allocate(arena, config);
  }
  void begin(std::span<const FineCell> cells) noexcept;
  bool step() noexcept;
  [[nodiscard]] std::uint32_t steps_left() const noexcept;
  [[nodiscard]] PlaceView place() const noexcept { return {keypoints_.view(), planes_.planes()}; }
  std::span<const PlanePatch> find_planes(std::span<const FineCell> cells) noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  /// What the next step does, in the order of the description.
  enum class Stage : std::uint8_t {
    kSelection,  ///< of the cells within range
    kGround,     ///< heights
    kStructure,  ///< moments of it, and its map
    kFits,       ///< of planes to the moments
    kPlanes,     ///< selected among all
    kCorners,    ///< of the map, pass by pass
    kKeypoints,
    kDone
  };

  void go_to(Stage stage) noexcept {
    stage_ = stage;
    done_ = 0;
  }
  /// Works on the next piece of some cells; after the last one `next` is due.
  template <typename Work>
  void take_piece(std::span<const FineCell> cells, std::size_t most, Stage next,
                  Work&& work) noexcept;
  /// The two halves of a stage that write to different places, at once if there are two workers.
  template <typename First, typename Second>
  void do_both(const First& first, const Second& second) const noexcept;
  [[nodiscard]] bool is_within_range(const FineCell& cell) const noexcept;
  void select_cells(std::span<const FineCell> cells) noexcept;
  template <bool kStructure, bool kGround>
  void select(std::span<const FineCell> cells) noexcept;
  void enter_structure(std::span<const FineCell> cells) noexcept;
  void finish_selection() noexcept;
  void select_keypoints() noexcept;

  DescriptorConfig config_{};
  Executor executor_;
  bool only_planes_ = false;
  Stage stage_ = Stage::kDone;
  std::size_t done_ = 0;             // cells or passes of the stage
  std::span<const FineCell> cells_;  // to be described
  std::uint64_t structure_count_ = 0;
  FixedVector<FineCell> structure_cells_;  // not ground, within range
  FixedVector<Keypoint> keypoints_;
  LocalGround ground_;
  PlaneVoxels planes_;
  StructureMap structure_;
  std::uint64_t dropped_ = 0;
};

void PlaceDescriber::State::allocate(Arena& arena, const DescriptorConfig& config,
                                     const DescriptorInput& input) noexcept {
  config_ = config;
  executor_ = input.executor;
  keypoints_.allocate(arena, config.max_keypoints);
  planes_.allocate(arena, config, input.voxel_size_m);
  dropped_ = 0;
}

void PlaceDescriber::State::begin(std::span<const FineCell> cells) noexcept {
  cells_ = cells;
  dropped_ = 0;
  structure_count_ = 0;
  only_planes_ = false;
  ground_.clear();
  structure_cells_.clear();
  go_to(Stage::kSelection);
}

template <typename Work>
void PlaceDescriber::State::take_piece(std::span<const FineCell> cells, std::size_t most,
                                       Stage next, Work&& work) noexcept {
  const std::size_t count = std::min(cells.size() - done_, most);
  work(cells.subspan(done_, count));
  done_ += count;
  if (done_ == cells.size()) go_to(next);
}

template <typename First, typename Second>
void PlaceDescriber::State::do_both(const First& first, const Second& second) const noexcept {
  for_parts(executor_, 2, [&](std::uint32_t part, std::uint32_t) noexcept {
    if (part == 0) {
      first();
    } else {
      second();
    }
  });
}

bool PlaceDescriber::State::step() noexcept {
  switch (stage_) {
    case Stage::kSelection:
      take_piece(cells_, kSelectedPerStep, Stage::kGround,
                 [this](auto piece) { select_cells(piece); });
      break;
    case Stage::kGround:
      finish_selection();
      do_both([this] { ground_.finish(); },
              [this] {
                planes_.begin();
                structure_.begin();
              });
      go_to(Stage::kStructure);
      break;
    case Stage::kStructure:
      take_piece(structure_cells_.view(), kEnteredPerStep, Stage::kFits,
                 [this](auto piece) { enter_structure(piece); });
      break;
    case Stage::kFits:
      if (!planes_.fit_some(kFitsPerStep, executor_)) go_to(Stage::kPlanes);
      break;
    case Stage::kPlanes:
      planes_.select(ground_);
      go_to(Stage::kCorners);
      break;
    case Stage::kCorners:
      structure_.run_pass(static_cast<std::uint32_t>(done_), executor_);
      if (++done_ == StructureMap::kPasses) go_to(Stage::kKeypoints);
      break;
    case Stage::kKeypoints:
      select_keypoints();
      dropped_ += planes_.dropped() + structure_.dropped();
      go_to(Stage::kDone);
      break;
    case Stage::kDone:
      break;
  }
  return stage_ != Stage::kDone;
}

std::uint32_t PlaceDescriber::State::steps_left() const noexcept {
  const auto pieces = [](std::size_t elements, std::size_t per_step) {
    return static_cast<std::uint32_t>((elements + per_step - 1) / per_step);
  };
  if (stage_ == Stage::kDone) return 0;
  // What is selected is known only later: until then all cells count.
  const bool selects = stage_ == Stage::kSelection;
  const std::size_t structure = selects ? cells_.size() : structure_cells_.size();
  std::uint32_t steps = 1;
  if (stage_ <= Stage::kSelection) {
    steps += pieces(cells_.size() - done_, kSelectedPerStep);
  }
  if (stage_ <= Stage::kGround) ++steps;
  if (stage_ <= Stage::kStructure) {
    steps += pieces(structure - (stage_ == Stage::kStructure ? done_ : 0), kEnteredPerStep);
  }
  if (stage_ <= Stage::kFits) {
    steps += 1 + pieces(planes_.unfitted(), kFitsPerStep);
  }
  if (stage_ <= Stage::kPlanes) ++steps;
  if (stage_ < Stage::kCorners) steps += StructureMap::kPasses;
  if (stage_ == Stage::kCorners) {
    steps += StructureMap::kPasses - static_cast<std::uint32_t>(done_);
  }
  return steps;
}

std::span<const PlanePatch> PlaceDescriber::State::find_planes(
    std::span<const FineCell> cells) noexcept {
  begin(cells);
  only_planes_ = true;
  while (stage_ < Stage::kCorners) step();
  go_to(Stage::kDone);
  return planes_.planes();
}

bool PlaceDescriber::State::is_within_range(const FineCell& cell) const noexcept {
  // Comparisons with NaN are false, so what is not finite never enters.
  const Eigen::Vector3f& p = cell.position;
  return p.x() * p.x() + p.y() * p.y() < config_.range_m * config_.range_m &&
         std::abs(p.z()) < kMaxHeight;
}

// Selects the cells that are finite and within range. Ground cells go to the height grid, structure
// is kept.
void PlaceDescriber::State::select_cells(std::span<const FineCell> cells) noexcept {
  if (executor_.workers > 1) {
    return do_both([&] { select<true, false>(cells); }, [&] { select<false, true>(cells); });
  }
  select<true, true>(cells);
}

template <bool kStructure, bool kGround>
void PlaceDescriber::State::select(std::span<const FineCell> cells) noexcept {
  for (const FineCell& cell : cells) {
    if (!is_within_range(cell)) {
      if (kStructure) dropped_ += cell.position.allFinite() ? 0 : 1;
      continue;
    }
    if (cell.ground != 0) {
      if (kGround) ground_.add(cell);
    } else if (kStructure) {
      ++structure_count_;
      structure_cells_.push_back(cell);
    }
  }
}

void PlaceDescriber::State::enter_structure(std::span<const FineCell> cells) noexcept {
  do_both([&] { planes_.collect(cells); },
          [&] {
            if (!only_planes_) structure_.accumulate(cells, ground_);
          });
}

// When there is too much structure, every n-th cell of the input is kept: a sparser sample of the
// whole scene gives the same keypoints, the first half of it does not.
void PlaceDescriber::State::finish_selection() noexcept {
  if (!ground_.any_marked()) {
    for (const FineCell& cell : structure_cells_) ground_.add(cell);
  }
  const std::uint64_t count = structure_count_;
  const std::uint64_t kept = structure_cells_.size();
  if (kept == count) return;
  dropped_ += count - kept;
  structure_cells_.clear();
  std::uint64_t share = 0;  // grows by `kept` with every cell; a cell enters when it passes `count`
  for (const FineCell& cell : cells_) {
    if (!is_within_range(cell) || cell.ground != 0) continue;
    share += kept;
    if (share < count) continue;
    share -= count;
    structure_cells_.push_back(cell);
  }
}

// The strongest corners that keep their distance from stronger ones.
void PlaceDescriber::State::select_keypoints() noexcept {
  keypoints_.clear();
  const float radius_squared = config_.suppression_radius_m * config_.suppression_radius_m;
  for (const StructureCorner& corner : structure_.corners()) {
    if (keypoints_.full()) break;
    const bool suppressed =
        std::any_of(keypoints_.begin(), keypoints_.end(), [&](const Keypoint& kept) {
          const float dx = kept.position.x() - corner.x;
          const float dy = kept.position.y() - corner.y;
          return dx * dx + dy * dy < radius_squared;
        });
    if (suppressed) continue;
    const std::uint64_t occupancy = structure_.occupancy(corner.x, corner.y);
    if (occupancy == 0) continue;
    const float ground = ground_.height(corner.x, corner.y);
    // On the grid on which keypoints travel: robot and base form the same triangles, bit by bit.
    const auto position = to_millimetres({corner.x, corner.y, ground});
    const auto normal =
        octahedral(planes_.bordering_normal({corner.x, corner.y, ground + kWallHeight}));
    if (!position || !normal) continue;
    Keypoint keypoint;
    keypoint.position = from_millimetres(*position);
    keypoint.normal = unit_vector(*normal);
    keypoint.occupancy = occupancy;
    keypoint.strength =
        static_cast<std::uint16_t>(std::min(std::sqrt(corner.response) * kStrengthScale, 65535.0F));
    keypoints_.push_back(keypoint);
  }
}

void PlaceDescriber::allocate(Arena& arena, const DescriptorConfig& config,
                              const DescriptorInput& input) noexcept {
  allocate_kept(arena, config, input);
  allocate_scratch(arena, config, input);
}

void PlaceDescriber::allocate_kept(Arena& arena, const DescriptorConfig& config,
                                   const DescriptorInput& input) noexcept {
  state_ = create_in<State>(arena, config, input);
}

void PlaceDescriber::allocate_scratch(Arena& arena, const DescriptorConfig& config,
                                      const DescriptorInput& input) noexcept {
  State measured;
  (state_ == nullptr ? measured : *state_).allocate_scratch(arena, config, input);
}

PlaceView PlaceDescriber::describe(std::span<const FineCell> cells) noexcept {
  begin(cells);
  while (step()) {
  }
  return place();
}

void PlaceDescriber::begin(std::span<const FineCell> cells) noexcept {
  if (state_ != nullptr) state_->begin(cells);
}

bool PlaceDescriber::step() noexcept { return state_ != nullptr && state_->step(); }

std::uint32_t PlaceDescriber::steps_left() const noexcept {
  return state_ == nullptr ? 0 : state_->steps_left();
}

PlaceView PlaceDescriber::place() const noexcept {
  return state_ == nullptr ? PlaceView{} : state_->place();
}

std::span<const PlanePatch> PlaceDescriber::find_planes(std::span<const FineCell> cells) noexcept {
  return state_ == nullptr ? std::span<const PlanePatch>{} : state_->find_planes(cells);
}

std::uint64_t PlaceDescriber::dropped() const noexcept {
  return state_ == nullptr ? 0 : state_->dropped();
}

}  // namespace unimapper
