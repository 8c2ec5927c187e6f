#include "unimapper/place/describer.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/core/quantise.hpp"

namespace unimapper {
namespace {

// Cells farther above or below the sensor are no part of a place (and would not fit the grids).
constexpr float kMaxHeight = 200.0F;
// Upright planes are looked for at this height above the ground, where walls are seen best.
constexpr float kWallHeight = 1.5F;
// A corner's response in the units of `Keypoint::strength`.
constexpr float kStrengthScale = 100.0F;

}  // namespace

void PlaceDescriber::allocate(Arena& arena, const DescriptorConfig& config) noexcept {
  config_ = config;
  structure_cells_.allocate(arena, config.max_cells);
  keypoints_.allocate(arena, config.max_keypoints);
  ground_.allocate(arena, config);
  planes_.allocate(arena, config);
  structure_.allocate(arena, config);
  dropped_ = 0;
}

PlaceView PlaceDescriber::describe(std::span<const FineCell> cells) noexcept {
  dropped_ = 0;
  admit(cells);
  ground_.finish();
  planes_.build(structure_cells_.view(), ground_);
  structure_.build(structure_cells_.view(), ground_);
  select_keypoints();
  dropped_ += planes_.dropped() + structure_.dropped();
  return {keypoints_.view(), planes_.planes()};
}

std::span<const PlanePatch> PlaceDescriber::find_planes(std::span<const FineCell> cells) noexcept {
  dropped_ = 0;
  admit(cells);
  ground_.finish();
  planes_.build(structure_cells_.view(), ground_);
  return planes_.planes();
}

// Takes the cells that are finite and within range; the rest of the code need not ask again. Ground
// goes where its height is averaged, structure is kept. When there is too much of it, what is kept
// is spread evenly over the input: a thinner place is still the same place, half a place is not.
void PlaceDescriber::admit(std::span<const FineCell> cells) noexcept {
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
void PlaceDescriber::select_keypoints() noexcept {
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

}  // namespace unimapper
