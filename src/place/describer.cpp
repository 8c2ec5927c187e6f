#include "unimapper/place/describer.hpp"

#include <algorithm>
#include <cmath>

#include "local_ground.hpp"
#include "plane_voxels.hpp"
#include "structure_map.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/core/quantise.hpp"

namespace unimapper {

using namespace place;

namespace {

// Cells farther above or below the sensor are not described (and would not fit the grids).
constexpr float kMaxHeight = 200.0F;
// Upright planes are looked for at this height above the ground, where walls are seen best.
constexpr float kWallHeight = 1.5F;
// A corner's response in the units of `Keypoint::strength`.
constexpr float kStrengthScale = 100.0F;

}  // namespace

class PlaceDescriber::State {
 public:
  void allocate(Arena& arena, const DescriptorConfig& config,
                const DescriptorInput& input) noexcept;
  PlaceView describe(std::span<const FineCell> cells) noexcept;
  std::span<const PlanePatch> find_planes(std::span<const FineCell> cells) noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  void select_cells(std::span<const FineCell> cells) noexcept;
  void select_keypoints() noexcept;

  DescriptorConfig config_{};
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
  structure_cells_.allocate(arena, input.max_cells);
  keypoints_.allocate(arena, config.max_keypoints);
  ground_.allocate(arena, config);
  planes_.allocate(arena, config, input.voxel_size_m);
  structure_.allocate(arena, config);
  dropped_ = 0;
}

PlaceView PlaceDescriber::State::describe(std::span<const FineCell> cells) noexcept {
  dropped_ = 0;
  select_cells(cells);
  ground_.finish();
  planes_.build(structure_cells_.view(), ground_);
  structure_.build(structure_cells_.view(), ground_);
  select_keypoints();
  dropped_ += planes_.dropped() + structure_.dropped();
  return {keypoints_.view(), planes_.planes()};
}

std::span<const PlanePatch> PlaceDescriber::State::find_planes(
    std::span<const FineCell> cells) noexcept {
  dropped_ = 0;
  select_cells(cells);
  ground_.finish();
  planes_.build(structure_cells_.view(), ground_);
  return planes_.planes();
}

// Selects the cells that are finite and within range. Ground cells go to the height grid, structure
// is kept. When there is too much of it, every n-th cell of the input is kept: a sparser sample of
// the whole scene gives the same keypoints, the first half of it does not.
void PlaceDescriber::State::select_cells(std::span<const FineCell> cells) noexcept {
  const float range_squared = config_.range_m * config_.range_m;
  const auto within_range = [&](const Eigen::Vector3f& p) {
    // Comparisons with NaN are false, so what is not finite never enters.
    return p.x() * p.x() + p.y() * p.y() < range_squared && std::abs(p.z()) < kMaxHeight;
  };
  ground_.clear();
  structure_cells_.clear();
  std::uint64_t count = 0;
  for (const FineCell& cell : cells) {
    if (!within_range(cell.position)) {
      dropped_ += cell.position.allFinite() ? 0 : 1;
      continue;
    }
    if (cell.ground != 0) {
      ground_.add(cell);
      continue;
    }
    ++count;
    structure_cells_.push_back(cell);
  }
  if (!ground_.any_marked()) {
    for (const FineCell& cell : structure_cells_) ground_.add(cell);
  }
  const std::uint64_t kept = structure_cells_.size();
  if (kept == count) return;
  dropped_ += count - kept;
  structure_cells_.clear();
  std::uint64_t share = 0;  // grows by `kept` with every cell; a cell enters when it passes `count`
  for (const FineCell& cell : cells) {
    if (!within_range(cell.position) || cell.ground != 0) continue;
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
  state_ = create_in<State>(arena, config, input);
}

PlaceView PlaceDescriber::describe(std::span<const FineCell> cells) noexcept {
  return state_ == nullptr ? PlaceView{} : state_->describe(cells);
}

std::span<const PlanePatch> PlaceDescriber::find_planes(std::span<const FineCell> cells) noexcept {
  return state_ == nullptr ? std::span<const PlanePatch>{} : state_->find_planes(cells);
}

std::uint64_t PlaceDescriber::dropped() const noexcept {
  return state_ == nullptr ? 0 : state_->dropped();
}

}  // namespace unimapper
